#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "analysis/figures/figures.h"
#include "analysis/figures/svg.h"
#include "analysis/input/study_record.h"
#include "analysis/report/report.h"
#include "analysis/statistics/analysis.h"
#include "analysis/text.h"
#include "data/base/json_text.h"
#include "data/base/markdown.h"
#include "data/base/text.h"
#include "data/export/csv.h"
#include "data/export/datasets.h"
#include "data/export/study_about.h"
#include "data/files/utc.h"
#include "data/store/store.h"
#include "protocols/json_document.h"
#include "runner/commands/check/deviations.h"
#include "runner/commands/register/registration_text.h"
#include "runner/commands/shared/about_file.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/shared/protocol_choice.h"
#include "runner/commands/shared/sealed_folder.h"

namespace palpate::runner::commands {

// The description of a bundle as RO-Crate 1.2 (https://w3id.org/ro/crate/1.2).

struct CrateFile {
  std::string name;  ///< in the bundle, folders separated by '/'
  std::uint64_t bytes = 0;
  std::string sha256;       ///< "": neither checksum nor size is stated
  std::string description;  ///< "" for none
};

struct CrateFacts {
  std::string name, description;
  std::string date;  ///< "2026-11-25"
  std::string program_version;
  data::StudyAbout about;  ///< with a license
  std::vector<CrateFile> files;
  /// How one file was made from others: name, sources, results.
  struct Action {
    std::string id, name;
    std::vector<std::string> sources, results;
  };
  std::vector<Action> actions;
};

/// ro-crate-metadata.json
std::string ro_crate_json(const CrateFacts& facts);

namespace {

using Json = nlohmann::ordered_json;

/// A path as a URI reference: reserved characters escaped, letters of every script kept.
std::string uri_of(std::string_view path) {
  constexpr std::string_view kPlain =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~/";
  std::string out;
  for (const char c : path) {
    if (kPlain.find(c) != std::string_view::npos || static_cast<unsigned char>(c) >= 0x80) {
      out += c;
    } else {
      constexpr std::string_view kHex = "0123456789ABCDEF";
      const auto byte = static_cast<unsigned char>(c);
      out += {'%', kHex[byte >> 4], kHex[byte & 15]};
    }
  }
  return out;
}

std::string format_of(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, const char*>, 14> kFormats = {{
      {".csv", "text/csv"},
      {".tsv", "text/tab-separated-values"},
      {".json", "application/json"},
      {".html", "text/html"},
      {".svg", "image/svg+xml"},
      {".md", "text/markdown"},
      {".sh", "application/x-sh"},
      {".gz", "application/gzip"},
      {".obj", "model/obj"},
      {".stl", "model/stl"},
      {".glb", "model/gltf-binary"},
      {".gltf", "model/gltf+json"},
      {".3mf", "model/3mf"},
      {".png", "image/png"},
  }};
  for (const auto& [end, format] : kFormats) {
    if (name.ends_with(end)) return format;
  }
  const std::string_view last = name.substr(name.rfind('/') + 1);
  return last.find('.') == std::string_view::npos ? "text/plain" : "application/octet-stream";
}

Json reference(const std::string& id) { return {{"@id", id}}; }

class Crate {
 public:
  explicit Crate(const CrateFacts& facts) : facts_(facts) {}

  std::string text() {
    put_descriptor();
    Json root = {{"@id", "./"},
                 {"@type", "Dataset"},
                 {"name", facts_.name},
                 {"description", facts_.description},
                 {"datePublished", facts_.date},
                 {"license", reference(license())}};
    put_people(root);
    put_files(root);
    put_actions(root);
    graph_.insert(graph_.begin() + 1, std::move(root));
    const Json document = {{"@context", "https://w3id.org/ro/crate/1.2/context"},
                           {"@graph", graph_}};
    return document.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
  }

 private:
  void put_descriptor() {
    graph_.push_back({{"@id", "ro-crate-metadata.json"},
                      {"@type", "CreativeWork"},
                      {"about", reference("./")},
                      {"conformsTo", reference("https://w3id.org/ro/crate/1.2")}});
  }

  /// \return its id
  std::string license() {
    std::string url = data::license_url(facts_.about);
    graph_.push_back(
        {{"@id", url},
         {"@type", "CreativeWork"},
         {"name", facts_.about.license},
         {"description", "License of the data in this bundle: " + facts_.about.license}});
    return url;
  }

  std::string organization(const std::string& name) {
    auto& id = organizations_[name];
    if (!id.empty()) return id;
    id = "#organization-" + std::to_string(organizations_.size());
    graph_.push_back({{"@id", id}, {"@type", "Organization"}, {"name", name}});
    return id;
  }

  void put_people(Json& root) {
    const data::StudyAbout& about = facts_.about;
    Json authors = Json::array(), funders = Json::array(), works = Json::array();
    for (const data::StudyAuthor& author : about.authors) {
      const std::string id = author.orcid.empty() ? "#author-" + std::to_string(authors.size() + 1)
                                                  : "https://orcid.org/" + author.orcid;
      if (std::ranges::find(authors, reference(id)) != authors.end()) continue;
      Json person = {{"@id", id}, {"@type", "Person"}, {"name", author.name}};
      if (!author.affiliation.empty())
        person["affiliation"] = reference(organization(author.affiliation));
      graph_.push_back(std::move(person));
      authors.push_back(reference(id));
    }
    for (const data::StudyFunding& one : about.funding) {
      const Json funder = reference(organization(one.funder));
      if (std::ranges::find(funders, funder) == funders.end()) funders.push_back(funder);
    }
    for (const std::string& one : about.references) {
      const std::string id = "#reference-" + std::to_string(works.size() + 1);
      graph_.push_back({{"@id", id}, {"@type", "CreativeWork"}, {"name", one}});
      works.push_back(reference(id));
    }
    if (!authors.empty()) root["author"] = authors;
    if (!funders.empty()) root["funder"] = funders;
    if (!works.empty()) root["citation"] = works;
    if (!about.how_to_acknowledge.empty()) root["creditText"] = about.how_to_acknowledge;
    if (about.doi.empty()) return;
    graph_.push_back({{"@id", data::doi_url(about)},
                      {"@type", "PropertyValue"},
                      {"propertyID", "https://registry.identifiers.org/registry/doi"},
                      {"value", "doi:" + about.doi},
                      {"url", data::doi_url(about)}});
    root["identifier"] = reference(data::doi_url(about));
  }

  /// The entity of a folder, created with its parents. \param folder "data/psych-ds"; "": the root
  Json& parts_of(const std::string& folder) {
    const auto found = folders_.find(folder);
    if (found != folders_.end()) return found->second;
    if (!folder.empty()) {
      const std::size_t slash = folder.rfind('/');
      parts_of(slash == std::string::npos ? "" : folder.substr(0, slash))
          .push_back(reference(uri_of(folder) + "/"));
    }
    return folders_.emplace(folder, Json::array()).first->second;
  }

  void put_files(Json& root) {
    for (const CrateFile& file : facts_.files) {
      const std::size_t slash = file.name.rfind('/');
      parts_of(slash == std::string::npos ? "" : file.name.substr(0, slash))
          .push_back(reference(uri_of(file.name)));
      Json entity = {{"@id", uri_of(file.name)},
                     {"@type", "File"},
                     {"name", file.name},
                     {"encodingFormat", format_of(file.name)}};
      if (!file.sha256.empty()) {
        entity["contentSize"] = std::to_string(file.bytes);
        entity["sha256"] = file.sha256;
      }
      if (!file.description.empty()) entity["description"] = file.description;
      graph_.push_back(std::move(entity));
    }
    for (const auto& [folder, parts] : folders_) {
      if (folder.empty()) {
        root["hasPart"] = parts;
      } else {
        graph_.push_back({{"@id", uri_of(folder) + "/"},
                          {"@type", "Dataset"},
                          {"name", folder},
                          {"hasPart", parts}});
      }
    }
  }

  void put_actions(Json& root) {
    graph_.push_back({{"@id", "#palpate"},
                      {"@type", "SoftwareApplication"},
                      {"name", "palpate"},
                      {"description", "A psychophysics experiment runner for touch."},
                      {"softwareVersion", facts_.program_version}});
    for (const CrateFacts::Action& action : facts_.actions) {
      Json sources = Json::array(), results = Json::array();
      for (const std::string& name : action.sources) sources.push_back(reference(uri_of(name)));
      for (const std::string& name : action.results) results.push_back(reference(uri_of(name)));
      graph_.push_back({{"@id", action.id},
                        {"@type", "CreateAction"},
                        {"name", action.name},
                        {"instrument", reference("#palpate")},
                        {"object", sources},
                        {"result", results}});
      root["mentions"].push_back(reference(action.id));
    }
  }

  const CrateFacts& facts_;
  Json graph_ = Json::array();
  std::map<std::string, std::string> organizations_;  ///< name -> id
  std::map<std::string, Json> folders_;               ///< name -> its parts
};

}  // namespace

std::string ro_crate_json(const CrateFacts& facts) { return Crate(facts).text(); }

// `palpate bundle`: makes a study one folder to deposit, and checks that the analysis is
// reproducible.

namespace {

namespace po = boost::program_options;
namespace fs = std::filesystem;

constexpr const char* kCrate = "ro-crate-metadata.json";
constexpr const char* kTrials = "data/trials.csv";

struct BundleOptions {
  std::string database, registration, about, out, format, verify;
  bool force = false;
};

/// The text of analysis.json, from the trials in a bundle alone.
analysis::Analysis analyze_bundle(const std::string& folder, double too_fast) {
  analysis::TrialTable table = analysis::read_trials_csv((fs::path(folder) / kTrials).string());
  table.provenance.source = kTrials;
  analysis::AnalysisSettings settings;
  settings.too_fast = too_fast;
  return analysis::analyze(std::move(table), settings, PALPATE_VERSION);
}

/// A number that the shell and the options read back exactly.
std::string as_option(double value) { return nlohmann::json(value).dump(); }

std::string reproduce_script(double too_fast) {
  return R"sh(#!/bin/sh
# Makes analysis.json again from data/trials.csv and compares the bytes.
# Needs palpate )sh" PALPATE_VERSION
         R"sh( in PATH, or its place in the variable PALPATE.
set -eu
cd "$(dirname "$0")"
sha256sum --check --quiet SHA256SUMS
scratch=$(mktemp -d)
trap 'rm -r "$scratch"' EXIT
"${PALPATE:-palpate}" analyze --csv data/trials.csv --too-fast-s )sh" +
         as_option(too_fast) + R"sh( \
  --json "$scratch/analysis.json" > "$scratch/analysis.txt"
cmp "$scratch/analysis.json" analysis.json
echo "analysis.json is reproduced"
)sh";
}

std::string title_of(const protocols::Protocol& protocol) {
  return protocol.title.empty() ? protocol.name : protocol.title;
}

std::string readme(const Registration& registered, const StudyCheck& check,
                   const data::StudyAbout& about, const std::string& format) {
  const protocols::Protocol& protocol = registered.protocol;
  std::string authors;
  for (const data::StudyAuthor& author : about.authors)
    authors += (authors.empty() ? "" : ", ") + author.name;
  std::string out = "# " + as_markdown(title_of(protocol)) + "\n\n";
  if (!check.label.empty())
    out += "**" + check.label + ": a rehearsal. Data of " +
           (check.label.starts_with("PARTLY") ? "some of them" : "all of them") +
           " come from a model of a participant, not from people.**\n\n";
  if (!authors.empty()) out += as_paragraph(authors) + "\n\n";
  if (!protocol.description.empty()) out += as_paragraph(protocol.description) + "\n\n";
  out += "License: " + as_markdown(about.license) + ". " +
         analysis::counted(check.participants, "participant", "participants") +
         "; held against the registration of " +
         data::format_utc(registered.made_utc_ns).substr(0, 10) + ": " + conclusion_of(check) +
         ".\n\n";
  for (const auto& [one, judgement] : check.hypotheses)
    out += "* " + one.id + ", " + analysis::to_string(judgement.verdict) + ": " +
           as_markdown(one.text) + "\n";
  out +=
      "\n| file | what it is |\n|---|---|\n"
      "| `data/trials.csv` | one row a trial; times are relative, without "
      "dates |\n"
      "| `data/codebook.csv` | what every column and code means |\n"
      "| `data/" +
      format + "/` | the same data as a " + (format == "bids" ? "BIDS" : "Psych-DS") +
      " dataset, with servo-rate samples if they were kept |\n"
      "| `registration/` | what was registered before the first session |\n"
      "| `check.html`, `check.json` | the study held against its "
      "registration |\n"
      "| `report.html`, `figures/` | the analysis for reading |\n"
      "| `analysis.json` | every number of the analysis, made from "
      "`data/trials.csv` alone |\n"
      "| `about.json` | authors, license, funding |\n"
      "| `ro-crate-metadata.json` | this folder described for programs, "
      "RO-Crate 1.2 |\n"
      "| `reproduce.sh` | makes `analysis.json` again and compares the "
      "bytes |\n"
      "| `SHA256SUMS` | checksums of all files |\n\n"
      "`sh reproduce.sh`, or `palpate bundle --verify .`, with "
      "palpate " PALPATE_VERSION ", shows that the numbers follow from the data.\n";
  return out;
}

std::string description_of(const std::string& name) {
  static const std::vector<std::pair<std::string, std::string>> known = {
      {kTrials, "One row a trial; analysis.json is made from it alone."},
      {"data/codebook.csv", "What every column and code of the data means."},
      {"data/attempts.csv", "Attempts that were cut off and shown again."},
      {"analysis.json", "Every number of the analysis."},
      {"report.html", "The analysis for reading."},
      {"check.html", "The study held against its registration, for reading."},
      {"check.json", "The study held against its registration."},
      {"about.json", "Authors, license and funding."},
      {"reproduce.sh", "Makes analysis.json again and compares the bytes."},
      {"README.md", "What this bundle holds."},
      {"registration/registration.md", "The registration for reading."},
      {"registration/protocol.json", "The protocol of the sessions."},
      {"registration/hypotheses.json", "The hypotheses with their conditions."},
      {"registration/plan.json", "The power analysis."}};
  for (const auto& [file, description] : known) {
    if (file == name) return description;
  }
  return name.starts_with("registration/simulated/") ||
                 name == "registration/analysis-simulated.json"
             ? "SIMULATED: made before the study, to try its analysis."
             : "";
}

void put_data(const BundleOptions& options, data::Store& store, const data::StudyAbout& about,
              const data::AtomicFolder& draft) {
  data::ExportSettings settings = export_settings();
  settings.times = data::Times::relative;
  settings.codebook = draft.prepare("data/codebook.csv");
  settings.recorded_as = (fs::path(options.out) / kTrials).string();
  data::ExportResult done = data::export_csv(store, draft.prepare(kTrials), settings);
  std::string not_recorded = done.not_recorded;
  settings.codebook.clear();
  settings.about = about;
  settings.recorded_as = (fs::path(options.out) / "data" / options.format).string();
  const std::string dataset = draft / ("data/" + options.format);
  done = options.format == "bids" ? data::export_bids(store, dataset, settings)
                                  : data::export_psychds(store, dataset, settings);
  if (not_recorded.empty()) not_recorded = done.not_recorded;
  if (!not_recorded.empty())
    std::cerr << "warning: 'palpate forget' will not list this bundle: " << printable(not_recorded)
              << "\n";
}

void put_registration(const std::string& folder, const data::AtomicFolder& draft) {
  for (const std::string& name : files_below(folder))
    write_member(draft, "registration/" + name, read_member(folder, name));
}

void put_analysis(const BundleOptions& options, const Registration& registered,
                  const StudyCheck& check, const data::AtomicFolder& draft) {
  const analysis::Analysis analysis = analyze_bundle(draft / "", registered.too_fast);
  analysis::StudyRecord record = analysis::read_study_record(options.database);
  record.checked =
      conclusion_of(check) + " of " + data::format_utc(registered.made_utc_ns).substr(0, 10) + ".";
  for (const auto& [one, judgement] : check.hypotheses)
    record.checked += " " + one.id + " is " + analysis::to_string(judgement.verdict) + ".";
  record.check_page = "check.html";
  write_member(draft, "analysis.json", analysis::report_json(analysis));
  write_member(draft, "report.html", analysis::report_html(analysis, record));
  for (const analysis::Figure& figure : analysis::figures_of(analysis, record))
    write_member(draft, "figures/" + figure.id + ".svg",
                 analysis::figure_svg(figure, analysis::light_palette()));
}

void put_crate(const Registration& registered, const StudyCheck& check,
               const data::StudyAbout& about, const data::AtomicFolder& draft) {
  const std::string folder = draft / "";
  CrateFacts facts;
  facts.name =
      title_of(registered.protocol) + (check.label.empty() ? "" : " (" + check.label + ")");
  facts.description =
      (registered.protocol.description.empty() ? "" : registered.protocol.description + " ") +
      "Data, registration, check, analysis and report of a study of touch "
      "with " +
      analysis::counted(check.participants, "participant", "participants") + "." +
      (check.label.empty() ? "" : " " + check.label + ".");
  facts.date = data::format_utc(std::chrono::duration_cast<std::chrono::nanoseconds>(
                                    std::chrono::system_clock::now().time_since_epoch())
                                    .count())
                   .substr(0, 10);
  facts.program_version = PALPATE_VERSION;
  facts.about = about;
  for (const std::string& name : files_below(folder))
    facts.files.push_back({name, size_of_member(folder, name), checksum_of_member(folder, name),
                           description_of(name)});
  facts.files.push_back({kChecksums, 0, "", "Checksums of all files."});
  facts.actions = {
      {"#analysis", "Analysis of the trials", {kTrials}, {"analysis.json", "report.html"}},
      {"#check",
       "Check against the registration",
       {kTrials, "registration/registration.json"},
       {"check.json", "check.html"}}};
  write_member(draft, kCrate, ro_crate_json(facts));
}

int make_bundle(const BundleOptions& options) {
  const std::string about_text = protocols::read_text_file(options.about);
  const data::StudyAbout about = read_about_file(options.about);
  if (about.license.empty())
    throw UsageError(options.about +
                     ": expected a license, without which "
                     "nobody may use the bundle, such as "
                     "\"license\": \"CC-BY-4.0\"");
  const Registration registered = read_registration(options.registration);
  require_replaceable_folder(options.out, options.force, kCrate);
  const StudyCheck check = check_study(registered, options.registration, options.database, {});
  data::Store store = data::Store::open(options.database, data::Store::Mode::read_for_export);
  warn_of_exposure(options.database);
  data::AtomicFolder draft(options.out);
  put_data(options, store, about, draft);
  put_registration(options.registration, draft);
  write_member(draft, "check.json", check_json(check, registered));
  write_member(draft, "check.html", check_html(check, registered));
  put_analysis(options, registered, check, draft);
  write_member(draft, "about.json", about_text);
  write_member(draft, "README.md", readme(registered, check, about, options.format));
  write_member(draft, "reproduce.sh", reproduce_script(registered.too_fast));
  ::chmod((draft / "reproduce.sh").c_str(), 0700);
  put_crate(registered, check, about, draft);
  write_checksums(draft);
  draft.commit(options.force);
  std::cout << printable(options.out) << ": " << registered.protocol.name << ", "
            << analysis::counted(check.participants, "participant", "participants")
            << (check.label.empty() ? "" : ", " + check.label) << "\n"
            << conclusion_of(check) << "\n";
  for (const auto& [one, judgement] : check.hypotheses)
    std::cout << one.id << ": " << analysis::to_string(judgement.verdict) << "\n";
  return 0;
}

/// The number of the first differing line, from 1.
std::size_t first_different_line(const std::string& a, const std::string& b) {
  std::size_t line = 1;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()) && a[i] == b[i]; ++i)
    line += a[i] == '\n' ? 1 : 0;
  return line;
}

int verify_bundle(const std::string& folder) {
  const std::vector<std::string> faults = checksum_faults(folder);
  for (const std::string& fault : faults) std::cout << "DIFFERS  " << printable(fault) << "\n";
  if (faults.empty()) std::cout << "same     every file, by its checksum\n";
  const Registration registered = read_registration((fs::path(folder) / "registration").string());
  const std::string stored = read_member(folder, "analysis.json");
  const std::string made = analysis::report_json(analyze_bundle(folder, registered.too_fast));
  if (stored == made) {
    std::cout << "same     analysis.json, made again from " << kTrials << "\n";
    return faults.empty() ? 0 : 1;
  }
  std::cout << "DIFFERS  analysis.json, made again from " << kTrials << ", from line "
            << first_different_line(stored, made);
  const auto json = json_or_discarded(stored);
  const auto version =
      json.is_object() ? json.value("program_version", nlohmann::json()) : nlohmann::json();
  if (version != PALPATE_VERSION)
    std::cout << "; it was made with palpate " << json_excerpt(version)
              << ", this is " PALPATE_VERSION;
  std::cout << "\n";
  return 1;
}

}  // namespace

int bundle_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage =
      "palpate bundle --db FILE --registration FOLDER --about "
      "FILE.json --out FOLDER\n"
      "       [--format psych-ds|bids] [--force]\n"
      "       palpate bundle --verify FOLDER";
  line.summary =
      "Makes a folder to deposit: the data (as CSV, and as a "
      "Psych-DS or BIDS dataset; times are\n"
      "relative, without dates), the registration, the check "
      "against it, the analysis with report\n"
      "and figures, a description as RO-Crate, a script that "
      "reproduces the analysis, and\n"
      "checksums. Nothing is sent anywhere. --verify makes "
      "analysis.json of a bundle again from\n"
      "its data alone and compares the bytes: exit status 1 if "
      "anything differs.";
  line.example =
      "  palpate bundle --db study.db --registration registration "
      "--about study.json --out study-1.0\n"
      "  palpate bundle --verify study-1.0";
  BundleOptions options;
  auto add = line.options.add_options();
  add("db", po::value(&options.database)->value_name("FILE"), "the study's database");
  add("registration", po::value(&options.registration)->value_name("FOLDER"),
      "what 'palpate register' made");
  add("about", po::value(&options.about)->value_name("FILE"),
      "authors, license, funding, as for 'palpate export'; a license is "
      "required");
  add("out", po::value(&options.out)->value_name("FOLDER"), "a new folder");
  add("format", po::value(&options.format)->default_value("psych-ds")->value_name("NAME"),
      "of the dataset: psych-ds or bids");
  add("verify", po::value(&options.verify)->value_name("FOLDER"), "the bundle to verify");
  add("force", po::bool_switch(&options.force), "replace an earlier bundle");
  const auto values = line.parse(args);
  if (!values) return 0;
  const bool verify = values->count("verify") > 0;
  for (const char* option : {"db", "registration", "about", "out"}) {
    const bool given = values->count(option) > 0;
    if (given == verify)
      throw UsageError(std::string(verify ? "--verify: without --" : "expected --") + option +
                       "\nUsage: " + line.usage + "\nMore: add --help");
  }
  if (verify) return verify_bundle(options.verify);
  if (options.format != "psych-ds" && options.format != "bids")
    throw UsageError("--format: expected psych-ds or bids, found '" +
                     printable(options.format, 60) + "'");
  return make_bundle(options);
}

}  // namespace palpate::runner::commands
