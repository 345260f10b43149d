// `palpate bundle`: makes a study one folder to deposit, and checks that everything in it follows
// from its data and its registration.

#include <sys/stat.h>

#include <chrono>
#include <filesystem>
#include <iostream>
#include <map>
#include <string>

#include "analysis/input/study_record.h"
#include "analysis/text.h"
#include "data/base/text.h"
#include "data/export/csv.h"
#include "data/export/datasets.h"
#include "data/export/study_about.h"
#include "data/files/utc.h"
#include "data/store/store.h"
#include "protocols/json_document.h"
#include "runner/commands/shared/command.h"
#include "runner/registration/about_file.h"
#include "runner/registration/bundle_contents.h"
#include "runner/registration/deviations.h"
#include "runner/registration/registration.h"
#include "runner/registration/sealed_folder.h"
#include "runner/station/protocol_choice.h"
#include "runner/study/export_settings.h"

namespace palpate::runner::commands {
namespace {

namespace po = boost::program_options;
namespace fs = std::filesystem;

struct BundleOptions {
  std::string database, registration, about, out, format, verify, digest;
  bool force = false;
};

void put_data(const BundleOptions& options, data::Store& store, const data::StudyAbout& about,
              const data::AtomicFolder& draft) {
  data::ExportSettings settings = study::export_settings();
  settings.times = data::Times::relative;
  settings.codebook = draft.prepare("data/codebook.csv");
  settings.recorded_as = (fs::path(options.out) / registration::kTrials).string();
  data::ExportResult done = data::export_csv(store, draft.prepare(registration::kTrials), settings);
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
  for (const std::string& name : registration::files_below(folder))
    registration::write_member(draft, "registration/" + name,
                               registration::read_member(folder, name));
}

/// "2026-11-25"
std::string today() {
  return data::format_utc(std::chrono::duration_cast<std::chrono::nanoseconds>(
                              std::chrono::system_clock::now().time_since_epoch())
                              .count())
      .substr(0, 10);
}

int make_bundle(const BundleOptions& options) {
  const std::string about_text = protocols::read_text_file(options.about);
  const data::StudyAbout about = registration::read_about_file(options.about);
  if (about.license.empty())
    throw UsageError(options.about +
                     ": expected a license, without which "
                     "nobody may use the bundle, such as "
                     "\"license\": \"CC-BY-4.0\"");
  registration::require_replaceable_folder(options.out, options.force, registration::kCrate);
  std::optional<registration::StudyCheck> check;
  if (!options.registration.empty())
    check = registration::check_study(registration::read_registration(options.registration),
                                      options.registration, options.database,
                                      {.digest = options.digest});
  data::Store store = data::Store::open(options.database, data::Store::Mode::read_for_export);
  const analysis::StudyRecord record = analysis::read_study_record(store);
  std::vector<data::Participant> without_trials;
  auto removed = static_cast<std::size_t>(store.counts().withdrawn);
  if (check) {
    without_trials = check->without_trials;
    removed = check->removed;
  } else {
    registration::require_one_study(record.protocols, options.database);
  }
  warn_of_exposure(options.database);
  data::AtomicFolder draft(options.out);
  put_data(options, store, about, draft);
  if (check) put_registration(options.registration, draft);
  registration::write_member(draft, "about.json", about_text);
  registration::write_member(draft, registration::kRecord,
                             registration::record_json(record, removed, without_trials));
  const registration::BundleFacts facts = registration::bundle_facts(
      draft / "", check ? check->points : std::vector<registration::CheckPoint>());
  for (const auto& [name, text] : registration::derived_files(facts))
    registration::write_member(draft, name, text);
  ::chmod((draft / "reproduce.sh").c_str(), 0700);
  registration::write_member(draft, registration::kCrate,
                             registration::crate_text(draft / "", facts, today()));
  registration::write_checksums(draft);
  draft.commit(options.force);
  std::cout << printable(options.out) << ": " << facts.name << ", "
            << analysis::counted(facts.participants, "participant", "participants")
            << (facts.label.empty() ? "" : ", " + facts.label) << "\n";
  registration::print_conclusion(facts);
  return 0;
}

}  // namespace

int bundle_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage =
      "palpate bundle --db FILE [--registration FOLDER] --about FILE.json --out FOLDER\n"
      "       [--format psych-ds|bids] [--digest SHA256] [--force]\n"
      "       palpate bundle --verify FOLDER [--digest SHA256]";
  line.summary =
      "Makes a folder to deposit: the data (as CSV, and as a Psych-DS or BIDS dataset; times are\n"
      "relative, without dates), the registration and the check against it, the analysis with\n"
      "report and figures, a description as RO-Crate, a script that reproduces the analysis, and\n"
      "checksums. Without --registration the folder says that the study was not registered.\n"
      "Nothing is sent anywhere. --verify makes everything that follows from data and\n"
      "registration again (analysis, verdicts, check, report, figures, descriptions), compares\n"
      "the bytes, and the tables of the dataset with the trials: exit status 1 if anything\n"
      "differs.";
  line.example =
      "  palpate bundle --db study.db --registration registration "
      "--about study.json --out study-1.0\n"
      "  palpate bundle --verify study-1.0";
  BundleOptions options;
  auto add = line.options.add_options();
  add("db", po::value(&options.database)->value_name("FILE"), "the study's database");
  add("registration", po::value(&options.registration)->value_name("FOLDER"),
      "what 'palpate register' made; none: an exploratory study, labelled so");
  add("about", po::value(&options.about)->value_name("FILE"),
      "authors, license, funding, as for 'palpate export'; a license is "
      "required");
  add("out", po::value(&options.out)->value_name("FOLDER"), "a new folder");
  add("format", po::value(&options.format)->default_value("psych-ds")->value_name("NAME"),
      "of the dataset: psych-ds or bids");
  add("digest", po::value(&options.digest)->value_name("SHA256"),
      "the digest that the registry holds: the registration must be that one");
  add("verify", po::value(&options.verify)->value_name("FOLDER"), "the bundle to verify");
  add("force", po::bool_switch(&options.force), "replace an earlier bundle");
  const auto values = line.parse(args);
  if (!values) return 0;
  const bool verify = values->count("verify") > 0;
  if (verify && values->count("registration"))
    throw UsageError("--verify: without --registration\nUsage: " + line.usage +
                     "\nMore: add --help");
  for (const char* option : {"db", "about", "out"}) {
    const bool given = values->count(option) > 0;
    if (given == verify)
      throw UsageError(std::string(verify ? "--verify: without --" : "expected --") + option +
                       "\nUsage: " + line.usage + "\nMore: add --help");
  }
  if (values->count("digest")) registration::read_digest(options.digest);
  if (!verify && values->count("digest") && options.registration.empty())
    throw UsageError("--digest: expected --registration, whose digest it is");
  if (verify) return registration::verify_bundle(options.verify, options.digest);
  if (options.format != "psych-ds" && options.format != "bids")
    throw UsageError("--format: expected psych-ds or bids, found '" +
                     printable(options.format, 60) + "'");
  return make_bundle(options);
}

}  // namespace palpate::runner::commands
