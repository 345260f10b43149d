#include "runner/registration/bundle_contents.h"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <utility>

#include "analysis/figures/figures.h"
#include "analysis/figures/svg.h"
#include "analysis/input/csv_reader.h"
#include "analysis/input/study_table.h"
#include "analysis/input/trials.h"
#include "analysis/report/study_report.h"
#include "analysis/text.h"
#include "data/base/cell_name.h"
#include "data/base/checksum.h"
#include "data/base/markdown.h"
#include "data/base/text.h"
#include "data/files/utc.h"
#include "data/stored_protocol.h"
#include "protocols/json_document.h"
#include "protocols/schedule.h"
#include "runner/registration/about_file.h"
#include "runner/registration/crate.h"
#include "runner/registration/sealed_folder.h"
#include "runner/usage_error.h"

namespace palpate::runner::registration {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using protocols::child_pointer;
using protocols::FaultList;
using protocols::ObjectReader;
using protocols::Presence;

constexpr std::size_t kMostListed = 1'000'000, kMostStudyText = 16'000'000, kMostStudyWord = 10'000;
constexpr double kMostStudyCount = 1e9;

/// The contents of record.json.
struct StatedStudy {
  analysis::StudyRecord record;
  std::size_t removed = 0;
  std::vector<data::Participant> without_trials;
};

void read_texts(ObjectReader& reader, const char* key, std::vector<std::string>& out) {
  const auto* list = reader.array(key, 0, kMostListed, Presence::required);
  for (std::size_t i = 0; list != nullptr && i < list->size(); ++i)
    protocols::read_text((*list)[i], child_pointer(reader.pointer(key), i), out.emplace_back(),
                         kMostStudyWord, reader.faults());
}

/// Elements of a list that is an object each.
void read_objects(ObjectReader& reader, const char* key,
                  const std::function<void(ObjectReader&)>& read) {
  const auto* list = reader.array(key, 0, kMostListed, Presence::required);
  for (std::size_t i = 0; list != nullptr && i < list->size(); ++i) {
    ObjectReader one((*list)[i], child_pointer(reader.pointer(key), i), reader.faults());
    read(one);
    one.refuse_unknown_keys();
  }
}

/// \throws InputError with every fault
StatedStudy read_record(const std::string& text, const std::string& file) {
  FaultList faults(file);
  const nlohmann::json json = protocols::read_json(text, faults);
  ObjectReader reader(json, "", faults);
  StatedStudy out;
  int version = 1;
  reader.integer("version", version, {1, 1}, Presence::required);
  read_objects(reader, "protocols", [&](ObjectReader& one) {
    analysis::ProtocolText& protocol = out.record.protocols.emplace_back();
    one.text("name", protocol.name, kMostStudyWord);
    one.checksum("sha256", protocol.sha256);
    one.text("text", protocol.text, kMostStudyText);
    if (one.has("text") && checksum_hex(protocol.text) != protocol.sha256)
      faults.add(one.pointer("sha256"), "expected the SHA-256 of the text, " +
                                            checksum_hex(protocol.text) + ", found " +
                                            protocol.sha256);
    const data::StoredProtocol stored = data::read_stored_protocol(protocol.text);
    protocol.title = stored.title;
    protocol.seed = stored.seed;
  });
  read_texts(reader, "devices", out.record.devices);
  read_texts(reader, "response_devices", out.record.response_devices);
  read_texts(reader, "builds", out.record.builds);
  read_texts(reader, "seeds", out.record.seeds);
  reader.count("attempts_cut_off", out.record.n_cut_off, {0, kMostStudyCount});
  reader.count("removed", out.removed, {0, kMostStudyCount});
  read_objects(reader, "without_trials", [&](ObjectReader& one) {
    data::Participant& person = out.without_trials.emplace_back();
    one.text("participant", person.code, kMostStudyWord);
    one.integer("number", person.enrolled_number, {1, kMostStudyCount}, Presence::required);
  });
  reader.refuse_unknown_keys();
  faults.throw_if_any();
  return out;
}

/// The fields of trials.csv by name.
class TrialFields {
 public:
  TrialFields(const TextTable& table, std::string file) : table_(table), file_(std::move(file)) {}

  const std::string& text(std::size_t row, const char* name) const {
    const std::size_t column = table_.column(name);
    if (column == table_.header.size()) fail(row, std::string("a column '") + name + "'");
    return table_.rows[row][column];
  }
  double number(std::size_t row, const char* name) const {
    const std::string& field = text(row, name);
    double value = 0;
    const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
    if (error != std::errc() || end != field.data() + field.size())
      fail(row, std::string("a number in ") + name + ", found '" + printable(field, 60) + "'");
    return value;
  }
  /// A whole number from 0 on.
  std::uint64_t count(std::size_t row, const char* name) const {
    const std::string& field = text(row, name);
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
    if (error != std::errc() || end != field.data() + field.size())
      fail(row,
           std::string("a whole number in ") + name + ", found '" + printable(field, 60) + "'");
    return value;
  }
  bool has(const char* name) const { return table_.column(name) < table_.header.size(); }
  bool flag(std::size_t row, const char* name) const { return text(row, name) == "1"; }

 private:
  [[noreturn]] void fail(std::size_t row, const std::string& expected) const {
    throw protocols::InputError(
        {{file_, "trial " + std::to_string(row + 1), "expected " + expected, 0}});
  }
  const TextTable& table_;
  std::string file_;
};

void put_servo(const TextTable& table, const TrialFields& of, analysis::StudyRecord& record) {
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    if (of.flag(i, "practice")) continue;
    analysis::add_trial({of.text(i, "renderer"), of.count(i, "ticks"), of.count(i, "missed_ticks"),
                         of.number(i, "longest_period"), of.count(i, "faults") != 0,
                         of.flag(i, "started_inside"), of.number(i, "max_force")},
                        record.servo);
  }
}

std::optional<double> level_of(const TrialFields& of, std::size_t row) {
  if (of.text(row, "level").empty()) return std::nullopt;
  return of.number(row, "level");
}

/// The columns of a block's dimensions; empty: it has none, or a catch trial.
std::vector<double> point_of(const TrialFields& of, std::size_t row,
                             const std::vector<std::string>& dimensions) {
  std::vector<double> point;
  for (const std::string& name : dimensions) {
    if (of.has(name.c_str()) && !of.text(row, name.c_str()).empty())
      point.push_back(of.number(row, name.c_str()));
  }
  return point;
}

/// \param protocol  of the trial
study::ShownTrial shown_trial(const TrialFields& of, std::size_t row, int session,
                              const data::StoredProtocol& protocol) {
  study::ShownTrial out;
  CellName stimulus{of.text(row, "shape")};
  for (const data::StoredFactor& factor : protocol.factors) {
    const std::string& level = of.text(row, factor.name.c_str());
    if (!level.empty()) stimulus.levels.emplace_back(factor.name, level);
  }
  out.row = {session,
             of.text(row, "renderer"),
             stimulus.text(),
             {of.number(row, "orientation_w"), of.number(row, "orientation_x"),
              of.number(row, "orientation_y"), of.number(row, "orientation_z")}};
  out.practice = of.flag(row, "practice");
  out.outcome = {of.flag(row, "correct"), false, !of.flag(row, "timed_out"), std::nullopt};
  if (!of.has("task") || of.text(row, "block_name").empty()) return out;
  const std::string& comparison = of.text(row, "comparison_interval");
  const auto block =
      std::ranges::find(protocol.blocks, of.text(row, "block_name"), &data::StoredBlock::name);
  const std::vector<std::string> dimensions =
      block != protocol.blocks.end() ? block->dimensions : std::vector<std::string>();
  out.row.task = {static_cast<int>(of.count(row, "block")),
                  of.text(row, "block_name"),
                  static_cast<int>(of.count(row, "track")),
                  level_of(of, row),
                  of.flag(row, "catch_trial"),
                  comparison.empty() ? 0 : static_cast<int>(of.count(row, "comparison_interval")),
                  of.has("reach_kind") ? of.text(row, "reach_kind") : "",
                  point_of(of, row, dimensions)};
  out.outcome.success = of.flag(row, "success");
  out.outcome.level = level_of(of, row);
  out.outcome.point = out.row.task.point;
  return out;
}

/// The study as the check compares it, from the trials and record.json.
StudyData study_of(const TextTable& table, const TrialFields& of, const StatedStudy& stated) {
  StudyData out;
  std::map<std::string, data::StoredProtocol> protocols;  // by SHA-256
  for (const analysis::ProtocolText& one : stated.record.protocols) {
    out.protocols.push_back({one.name, one.text, one.sha256});
    protocols[one.sha256] = data::read_stored_protocol(one.text);
  }
  std::map<std::pair<std::string, std::string>, std::size_t> known;
  std::set<std::pair<std::size_t, std::uint64_t>> sessions;
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    const std::string& sha256 = of.text(i, "protocol_sha256");
    const std::string& code = of.text(i, "participant_id");
    const auto [at, added] = known.try_emplace({sha256, code}, out.participants.size());
    if (added) {
      StudyParticipant& one = out.participants.emplace_back();
      one.protocol_sha256 = sha256;
      one.person.id = static_cast<std::int64_t>(out.participants.size());
      one.person.code = code;
      one.person.enrolled_number = static_cast<int>(of.number(i, "participant_number"));
      one.person.simulated = of.flag(i, "simulated");
    }
    StudyParticipant& one = out.participants[at->second];
    const auto session = static_cast<int>(of.number(i, "session"));
    if (sessions.insert({at->second, of.count(i, "session")}).second) {
      data::StoredRun& run = out.runs.emplace_back();
      run.participant = one.person;
      run.protocol_sha256 = sha256;
      run.info.session = session;
      run.info.observer_sha256 = of.text(i, "observer_sha256");
    }
    one.shown.push_back(shown_trial(of, i, session, protocols[sha256]));
  }
  out.removed = stated.removed;
  return out;
}

void put_without_trials(const StatedStudy& stated, StudyData& study) {
  std::int64_t id = -1;
  for (const data::Participant& person : stated.without_trials) {
    study.runs.emplace_back().participant = person;
    study.runs.back().participant.id = id--;
  }
}

/// The study's own trials, with the shapes in the order of the protocol, as 'palpate check' has
/// them. \param own_only  those of the protocols of the registered name
analysis::StudyTable own_table(const std::string& folder, const StudyData& study, bool own_only,
                               const Registration& registered,
                               const analysis::StudyRecord& record) {
  std::vector<std::string> own;
  std::vector<analysis::ProtocolText> protocols;
  for (const data::ProtocolInfo& one : study.protocols) {
    if (own_only && one.name != registered.protocol.name) continue;
    own.push_back(one.sha256);
    const auto text =
        std::ranges::find(record.protocols, one.sha256, &analysis::ProtocolText::sha256);
    if (text != record.protocols.end()) protocols.push_back(*text);
  }
  return analysis::read_study_csv((fs::path(folder) / kTrials).string(), own, protocols);
}

void judge_all(analysis::StudyTable table, const Registration& registered, StudyCheck& check) {
  check.label = analysis::simulated_label(table.of_trials);
  const analysis::NamedResults results = analysis::named_results(
      analysis::study_json(study::analyze_study(std::move(table), registered.too_fast)),
      alpha_at(registered, check.participants));
  for (const analysis::Hypothesis& one : registered.hypotheses)
    check.hypotheses.emplace_back(one, analysis::judge(one, results));
}

/// What a table of tasks needs beside itself, for the analysis as in a database.
struct Design {
  std::vector<analysis::ProtocolText> protocols;  ///< empty: a study of shapes needs none
  /// Whose trials are analysed; "": all.
  std::string protocol;
};

/// \param registered  its trials are analysed, unless the study has none of its name; none: all
Design design_of(const Registration* registered, const analysis::StudyRecord& record) {
  std::vector<std::string> texts;
  for (const analysis::ProtocolText& one : record.protocols) texts.push_back(one.text);
  if (registered != nullptr) texts = {registered->protocol.source_text};
  if (!data::have_blocks(texts)) return {};
  if (registered == nullptr) return {record.protocols, ""};
  const std::string& name = registered->protocol.name;
  const bool there = std::ranges::find(record.protocols, name, &analysis::ProtocolText::name) !=
                     record.protocols.end();
  return {record.protocols, there ? name : ""};
}

/// The analysis of the trials in a bundle as reproduce.sh makes it, and its label.
void analyze_bundle(const std::string& folder, BundleFacts& facts) {
  const Registration* const registered = facts.checked ? &facts.checked->registered : nullptr;
  const Design design = design_of(registered, facts.record);
  const std::string trials = (fs::path(folder) / kTrials).string();
  std::vector<std::string> wanted;
  if (!design.protocol.empty()) wanted.push_back(design.protocol);
  analysis::StudyTable table = analysis::read_study_csv(trials, wanted, design.protocols);
  table.source = table.provenance.source = kTrials;
  if (table.times) table.times->provenance.source = kTrials;
  facts.label = analysis::simulated_label(table.of_trials);
  facts.analysis = study::analyze_study(std::move(table), facts.too_fast);
}

/// A number that the shell and the options read back exactly.
std::string as_option(double value) { return nlohmann::json(value).dump(); }

std::string reproduce_script(const BundleFacts& facts) {
  const Design design =
      design_of(facts.checked ? &facts.checked->registered : nullptr, facts.record);
  std::string options = as_option(facts.too_fast);
  if (!design.protocols.empty()) options += " --design data/record.json";
  if (!design.protocol.empty()) options += " --protocol " + design.protocol;
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
         options + R"sh( \
  --json "$scratch/analysis.json" > "$scratch/analysis.txt"
cmp "$scratch/analysis.json" analysis.json
echo "analysis.json is reproduced"
)sh";
}

/// How the study stands to a registration, and its verdicts.
std::string registration_in_words(const BundleFacts& facts) {
  if (!facts.checked)
    return "**" + conclusion_of(facts) +
           ": its analyses are exploratory. No hypothesis and no plan was fixed before the "
           "data.**\n\n";
  const Registration& registered = facts.checked->registered;
  std::string out = "Held against the registration of " +
                    data::format_utc(registered.made_utc_ns).substr(0, 10) + ": " +
                    conclusion_of(facts) + ". Digest of the registration: `" + registered.digest +
                    "`.\n\n";
  for (const auto& [one, judgement] : facts.checked->check.hypotheses)
    out += "* " + one.id + ", " + analysis::to_string(judgement.verdict) + ": " +
           as_markdown(one.text) + "\n";
  return out;
}

std::string readme(const BundleFacts& facts) {
  const data::StudyAbout& about = facts.about;
  std::string authors;
  for (const data::StudyAuthor& author : about.authors)
    authors += (authors.empty() ? "" : ", ") + author.name;
  std::string out = "# " + as_markdown(facts.title) + "\n\n";
  if (!facts.label.empty())
    out += "**" + facts.label + ": a rehearsal. Data of " +
           (facts.label.starts_with("PARTLY") ? "some of them" : "all of them") +
           " come from a model of a participant, not from people.**\n\n";
  if (!authors.empty()) out += as_paragraph(authors) + "\n\n";
  if (!facts.description.empty()) out += as_paragraph(facts.description) + "\n\n";
  out += "License: " + as_markdown(about.license) + ". " +
         analysis::counted(facts.participants, "participant", "participants") + ".\n\n" +
         registration_in_words(facts);
  const bool alone = design_of(facts.checked ? &facts.checked->registered : nullptr, facts.record)
                         .protocols.empty();
  out +=
      "\n| file | what it is |\n|---|---|\n"
      "| `data/trials.csv` | one row a trial; times are relative, without dates |\n"
      "| `data/codebook.csv` | what every column and code means |\n"
      "| `data/record.json` | what the trials leave out: devices, builds, seeds, protocols |\n"
      "| `data/" +
      facts.format + "/` | the same data as a " + (facts.format == "bids" ? "BIDS" : "Psych-DS") +
      " dataset, with servo-rate samples if they were kept |\n";
  if (facts.checked)
    out +=
        "| `registration/` | what was registered before the first session |\n"
        "| `check.html`, `check.json` | the study held against its registration |\n";
  out +=
      "| `report.html`, `figures/` | the analysis for reading |\n"
      "| `analysis.json` | every number of the analysis, made from `data/trials.csv` " +
      std::string(alone ? "alone" : "and the protocol in `data/record.json`") +
      " |\n"
      "| `about.json` | authors, license, funding |\n"
      "| `ro-crate-metadata.json` | this folder described for programs, RO-Crate 1.2 |\n"
      "| `reproduce.sh` | makes `analysis.json` again and compares the bytes |\n"
      "| `SHA256SUMS` | checksums of all files |\n\n"
      "`sh reproduce.sh`, or `palpate bundle --verify .`, with palpate " PALPATE_VERSION
      ", shows that the numbers follow from the data; the second also that " +
      std::string(facts.checked ? "verdicts, check, report, figures and dataset do. Compare the "
                                  "digest with the one that the registry holds (`--digest`).\n"
                                : "report, figures and dataset do.\n");
  return out;
}

std::string description_of(const std::string& name) {
  static const std::vector<std::pair<std::string, std::string>> known = {
      {kTrials, "One row a trial; analysis.json is made from it alone."},
      {"data/codebook.csv", "What every column and code of the data means."},
      {kRecord, "What the table of trials leaves out: devices, builds, seeds, protocols."},
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

/// With the conclusion of the check, for the report.
analysis::StudyRecord with_check(const BundleFacts& facts) {
  analysis::StudyRecord record = facts.record;
  if (!facts.checked) {
    record.checked = conclusion_of(facts) + ": exploratory.";
    return record;
  }
  const auto& [registered, check] = *facts.checked;
  record.checked =
      conclusion_of(check) + " of " + data::format_utc(registered.made_utc_ns).substr(0, 10) + ".";
  for (const auto& [one, judgement] : check.hypotheses)
    record.checked += " " + one.id + " is " + analysis::to_string(judgement.verdict) + ".";
  record.checked += " Digest of the registration: " + registered.digest + ".";
  record.check_page = "check.html";
  return record;
}

/// Holds the trials against the registration. \param points  of the check so far
void check_again(const std::string& folder, const std::string& registration,
                 const StatedStudy& stated, const std::vector<CheckPoint>& points, StudyData study,
                 BundleFacts& facts) {
  auto& [registered, check] = *facts.checked;
  const bool own_only = !keep_study_named(registered.protocol.name, study).empty();
  put_without_trials(stated, study);
  check.participants = facts.participants = study.participants.size();
  check.points = points;
  const auto digest = std::ranges::find(points, "digest", &CheckPoint::id);
  const bool compared = digest != points.end() && digest->finding == Finding::as_registered;
  for (const CheckPoint& again :
       points_of_trials(registered, registration, study,
                        {.digest = compared ? registered.digest : std::string()})) {
    const auto at = std::ranges::find(check.points, again.id, &CheckPoint::id);
    if (at == check.points.end()) {
      check.points.push_back(again);
    } else if (again.id != "digest" || at->finding != Finding::deviation) {
      *at = again;
    }
  }
  judge_all(own_table(folder, study, own_only, registered, facts.record), registered, check);
  facts.label = check.label;
}

}  // namespace

std::size_t TextTable::column(std::string_view name) const {
  return static_cast<std::size_t>(std::ranges::find(header, name) - header.begin());
}

TextTable read_text_table(const std::string& path) {
  analysis::CsvReader reader(path);
  TextTable out;
  while (reader.next()) {
    std::vector<std::string> row(reader.fields().begin(), reader.fields().end());
    if (out.header.empty()) {
      out.header = std::move(row);
    } else if (row.size() == out.header.size()) {
      out.rows.push_back(std::move(row));
    } else {
      throw protocols::InputError(
          {{path, "line " + std::to_string(reader.line()),
            "expected " + std::to_string(out.header.size()) + " fields, as in the header; found " +
                std::to_string(row.size()),
            0}});
    }
  }
  if (!reader.fault().empty())
    throw protocols::InputError(
        {{path, "line " + std::to_string(reader.line()), reader.fault(), 0}});
  return out;
}

std::string record_json(const analysis::StudyRecord& record, std::size_t removed,
                        const std::vector<data::Participant>& without_trials) {
  Json out = {{"version", 1}, {"protocols", Json::array()}};
  for (const analysis::ProtocolText& one : record.protocols)
    out["protocols"].push_back({{"name", one.name}, {"sha256", one.sha256}, {"text", one.text}});
  out["devices"] = record.devices;
  out["response_devices"] = record.response_devices;
  out["builds"] = record.builds;
  out["seeds"] = record.seeds;
  out["attempts_cut_off"] = record.n_cut_off;
  out["removed"] = removed;
  out["without_trials"] = Json::array();
  for (const data::Participant& one : without_trials)
    out["without_trials"].push_back({{"participant", one.code}, {"number", one.enrolled_number}});
  return out.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

analysis::StudyRecord parse_record(const std::string& text, const std::string& file) {
  return read_record(text, file).record;
}

std::vector<CheckPoint> parse_points(const std::string& text, const std::string& file) {
  constexpr std::size_t kMostPoints = 100, kMostEvidence = 10'000, kMostText = 1'000'000;
  FaultList faults(file);
  const nlohmann::json json = protocols::read_json(text, faults);
  ObjectReader reader(json, "", faults);
  std::vector<CheckPoint> out;
  const auto* list = reader.array("points", 1, kMostPoints, Presence::required);
  for (std::size_t i = 0; list != nullptr && i < list->size(); ++i) {
    ObjectReader one((*list)[i], protocols::child_pointer("/points", i), faults);
    CheckPoint& point = out.emplace_back();
    one.text("id", point.id, kMostText);
    one.text("title", point.title, kMostText);
    one.choice("finding", point.finding,
               {std::pair{"as registered", Finding::as_registered},
                {"deviation", Finding::deviation},
                {"note", Finding::note}},
               Presence::required);
    one.text("sentence", point.sentence, kMostText);
    const auto* evidence = one.array("evidence", 0, kMostEvidence, Presence::required);
    for (std::size_t k = 0; evidence != nullptr && k < evidence->size(); ++k)
      protocols::read_text((*evidence)[k], protocols::child_pointer(one.pointer("evidence"), k),
                           point.evidence.emplace_back(), kMostText, faults);
  }
  faults.throw_if_any();
  return out;
}

void require_one_study(const std::vector<analysis::ProtocolText>& protocols,
                       const std::string& source) {
  std::set<std::string> names;
  for (const analysis::ProtocolText& one : protocols) names.insert(one.name);
  if (names.size() == 1) return;
  if (names.empty()) throw UsageError(printable(source) + ": expected trials of a protocol");
  throw UsageError(
      printable(source) + ": expected the trials of one protocol, found " +
      printable(analysis::joined(std::vector<std::string>(names.begin(), names.end()))) +
      ": with --registration the registered one is analysed");
}

BundleFacts bundle_facts(const std::string& folder, const std::vector<CheckPoint>& points) {
  const std::string registration = (fs::path(folder) / "registration").string();
  BundleFacts out;
  if (fs::exists(registration)) {
    Registration& registered = out.checked.emplace().registered;
    registered = read_registration(registration);
    out.name = registered.protocol.name;
    out.title = registered.protocol.title;
    out.description = registered.protocol.description;
  }
  out.too_fast =
      out.checked ? out.checked->registered.too_fast : analysis::AnalysisSettings{}.too_fast;
  out.about = read_about_text(read_member(folder, "about.json"),
                              (fs::path(folder) / "about.json").string());
  out.format = fs::is_directory(fs::path(folder) / "data/bids") ? "bids" : "psych-ds";
  const std::string trials = (fs::path(folder) / kTrials).string();
  out.trials = read_text_table(trials);
  const StatedStudy stated =
      read_record(read_member(folder, kRecord), (fs::path(folder) / kRecord).string());
  out.record = stated.record;
  const TrialFields fields(out.trials, trials);
  put_servo(out.trials, fields, out.record);
  analyze_bundle(folder, out);
  StudyData study = study_of(out.trials, fields, stated);
  if (out.checked) {
    check_again(folder, registration, stated, points, std::move(study), out);
  } else {
    require_one_study(out.record.protocols, (fs::path(folder) / kRecord).string());
    out.participants = study.participants.size();
    const analysis::ProtocolText& last = out.record.protocols.back();
    out.name = last.name;
    out.title = last.title;
    out.description = data::read_stored_protocol(last.text).description;
  }
  if (out.title.empty()) out.title = out.name;
  return out;
}

std::string conclusion_of(const BundleFacts& facts) {
  return facts.checked ? conclusion_of(facts.checked->check) : "The study was not registered";
}

std::map<std::string, std::string> derived_files(const BundleFacts& facts) {
  const analysis::StudyRecord record = with_check(facts);
  std::map<std::string, std::string> out = {
      {"analysis.json", analysis::study_json(facts.analysis)},
      {"report.html", analysis::study_html(facts.analysis, record)},
      {"README.md", readme(facts)},
      {"reproduce.sh", reproduce_script(facts)}};
  if (facts.checked) {
    out["check.json"] = check_json(facts.checked->check, facts.checked->registered);
    out["check.html"] = check_html(facts.checked->check, facts.checked->registered);
  }
  for (const analysis::Figure& figure : analysis::study_figures(facts.analysis, record))
    out["figures/" + figure.id + ".svg"] = analysis::figure_svg(figure, analysis::light_palette());
  return out;
}

std::string crate_text(const std::string& folder, const BundleFacts& facts,
                       const std::string& date) {
  const std::string of_label = facts.label.empty() ? "" : " " + facts.label + ".";
  CrateFacts crate;
  crate.name = facts.title + (facts.label.empty() ? "" : " (" + facts.label + ")");
  crate.description =
      (facts.description.empty() ? "" : facts.description + " ") +
      (facts.checked ? "Data, registration, check, analysis and report of a study of touch with "
                     : "Data, exploratory analysis and report of a study of touch that was not "
                       "registered, with ") +
      analysis::counted(facts.participants, "participant", "participants") + "." + of_label;
  crate.date = date;
  crate.program_version = PALPATE_VERSION;
  crate.about = facts.about;
  for (const std::string& name : files_below(folder)) {
    if (name != kCrate && name != kChecksums)
      crate.files.push_back({name, size_of_member(folder, name), checksum_of_member(folder, name),
                             description_of(name)});
  }
  crate.files.push_back({kChecksums, 0, "", "Checksums of all files."});
  crate.actions = {
      {"#analysis", "Analysis of the trials", {kTrials}, {"analysis.json", "report.html"}}};
  if (facts.checked)
    crate.actions.push_back({"#check",
                             "Check against the registration",
                             {kTrials, "registration/registration.json"},
                             {"check.json", "check.html"}});
  return ro_crate_json(crate);
}

}  // namespace palpate::runner::registration
