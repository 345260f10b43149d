#include <algorithm>
#include <atomic>
#include <cstddef>
#include <iostream>
#include <map>
#include <stdexcept>
#include <string>
#include <thread>
#include <tuple>
#include <utility>

#include "analysis/text.h"
#include "data/base/text.h"
#include "data/export/csv.h"
#include "data/export/datasets.h"
#include "data/export/settings.h"
#include "data/store/store.h"
#include "data/store/sweep_file.h"
#include "runner/commands/shared/command.h"
#include "runner/movement/movement_study.h"
#include "runner/movement/touched_trial.h"
#include "runner/output/progress_line.h"
#include "runner/registration/about_file.h"
#include "runner/station/protocol_choice.h"
#include "runner/study/export_settings.h"

namespace palpate::runner::commands {
namespace {

// Movement in exports: the contact of each sample, and the measures of each trial.

/// Adds movement to the settings of an export. Must outlive that export.
class MovementExport {
 public:
  MovementExport(data::Store& store, std::string mesh_folder)
      : store_(store), stimuli_(std::move(mesh_folder)) {}

  /// Adds places and normals of the contacts to the samples, by rendering each trial again.
  void add_contacts(data::ExportSettings& settings);
  /// Tables of the measures. \throws UsageError: no trial has samples
  void add_measures(data::ExportSettings& settings, const movement::MovementRequest& request);
  /// Trials without contacts because rendering does not reproduce their recorded forces.
  std::size_t not_rendered() const { return not_rendered_; }

 private:
  data::Store& store_;
  movement::StudyStimuli stimuli_;
  std::size_t not_rendered_ = 0;
  std::map<movement::MovementStudy::TrialKey, data::DerivedMeasures::Values> measured_;
};

void MovementExport::add_contacts(data::ExportSettings& settings) {
  settings.contacts = [this](const data::StoredTrial& trial) {
    auto contacts = movement::contacts_of(*stimuli_.of(store_, trial), trial);
    if (contacts.empty() && !trial.record.samples.empty()) ++not_rendered_;
    return contacts;
  };
}

void MovementExport::add_measures(data::ExportSettings& settings,
                                  const movement::MovementRequest& request) {
  movement::MovementStudy study = movement::measure_study(request);
  movement::require_samples(study, request.database);
  for (const auto& [trial, row] : study.rows) {
    data::DerivedMeasures::Values& values = measured_[trial];
    values.missing = study.missing[row];
    if (values.missing.empty())
      values.numbers.assign(study.table.values[row].begin(), study.table.values[row].end());
  }
  data::DerivedMeasures derived;
  derived.name = "movement";
  derived.how = "The path was filtered with a low pass at " +
                analysis::fixed(request.settings.cutoff, 1) +
                " Hz; contacts come from rendering each trial again, to the bit.";
  for (const auto& one : analysis::measure_definitions()) {
    derived.columns.push_back({one.name, std::string("Movement: ") + one.meaning, one.unit});
  }
  derived.of = [this](const data::StoredTrial& trial) {
    const auto found = measured_.find(movement::key_of(trial));
    if (found != measured_.end()) return found->second;
    return data::DerivedMeasures::Values{{}, "it was added while the export was written"};
  };
  settings.derived = std::move(derived);
}

namespace po = boost::program_options;

/// Shows the progress of the export and ends it after Ctrl-C.
class Progress {
 public:
  Progress(data::Store& store, const std::atomic<bool>& stop_asked)
      : stop_asked_(stop_asked), line_("export") {
    if (!line_.on_terminal()) return;  // counting takes long in large databases
    const data::StoreCounts counts = store.counts();
    all_ = static_cast<double>(counts.completed + counts.cut_off);
  }

  void show(std::int64_t done) {
    if (stop_asked_) throw std::runtime_error("stopped; nothing was exported");
    line_.show(all_ > 0 ? static_cast<double>(done) / all_ : 1);
  }

 private:
  const std::atomic<bool>& stop_asked_;
  output::ProgressLine line_;
  double all_ = 0;
};

data::Times times_of(const std::string& word, const std::string& format, const std::string& usage) {
  if (word == "absolute") return data::Times::absolute;
  if (word == "relative") return data::Times::relative;
  if (word.empty()) return format == "csv" ? data::Times::absolute : data::Times::relative;
  throw UsageError("no times '" + word + "'; there are: absolute, relative\nUsage: " + usage);
}

data::ExportResult export_as(const std::string& format, data::Store& store, const std::string& out,
                             const data::ExportSettings& settings) {
  if (format == "bids") return data::export_bids(store, out, settings);
  if (format == "psych-ds") return data::export_psychds(store, out, settings);
  return data::export_csv(store, out, settings);
}

struct Request {
  std::string database, format, out, codebook, about, meshes;
  data::Times times = data::Times::absolute;
  bool force = false, pages = false, motion = false, contacts = false, movement = false;
  int jobs = 1;
};

void add_options(CommandLine& line) {
  line.usage =
      "palpate export --db FILE --format csv|bids|psych-ds --out PATH\n"
      "       [--times relative|absolute] [--codebook FILE] [--about FILE.json]\n"
      "       [--motion] [--contacts] [--movement] [--meshes DIR] [--pages] [--jobs N] [--force]";
  line.summary =
      "Writes the trials of a database for others, completely or not at all. Can be used while a\n"
      "session runs. csv: every completed trial as a row of PATH, and the attempts that were cut\n"
      "off, if there are any, in NAME_attempts.csv beside NAME.csv (attempts.csv beside "
      "trials.csv).\n"
      "bids, psych-ds: a\n"
      "self-describing folder, with the servo-rate samples if they were kept.\n"
      "Times are relative in bids and psych-ds: dates are shifted so that a participant's first\n"
      "trial is at 1900-01-01T00:00:00Z, and the column elapsed counts the seconds from it. csv\n"
      "has the true onset_utc unless --times relative is given.\n"
      "Texts that a spreadsheet would run as formulas (beginning with = + - @) get a ' in front;\n"
      "analyze --csv removes it.";
  line.example = R"(  palpate export --db study.db --format csv --out trials.csv
  palpate export --db study.db --format csv --out trials.csv --codebook codebook.csv
  palpate export --db study.db --format bids --out study-bids
  palpate export --db study.db --format bids --about study.json --out study-bids
      (study.json: {"version": 1, "authors": ["Ada Example", "Bo Example"], "license": "CC-BY-4.0"};
      all its keys: protocols/study.schema.json)
  palpate export --db study.db --format bids --motion --contacts --out study-motion
      (samples as Motion-BIDS, with the place and direction of each contact)
  palpate export --db people.sweep --format csv --out people.csv         a sweep: a row a point
  palpate export --db study.db --format psych-ds --out study-psychds --force
      (replaces an earlier export; a folder that palpate did not make is never replaced))";
  auto add = line.options.add_options();
  add("db", po::value<std::string>()->required()->value_name("FILE"),
      "the study's database, or a sweep's file (csv only)");
  add("format", po::value<std::string>()->required()->value_name("NAME"), "csv, bids or psych-ds");
  add("out", po::value<std::string>()->required()->value_name("PATH"),
      "the file (csv) or folder (others) to write");
  add("times", po::value<std::string>()->default_value("", "")->value_name("WORD"),
      "relative (default of bids and psych-ds) or absolute (default of csv)");
  add("codebook", po::value<std::string>()->default_value("", "")->value_name("FILE"),
      "csv only: what every column, value and fault bit means, as a table");
  add("about", po::value<std::string>()->default_value("", "")->value_name("FILE"),
      "bids and psych-ds: JSON with authors, license, funding, ethics_approvals, references, doi, "
      "which go into the dataset's description");
  add("pages", po::bool_switch(),
      "the answers to pages as well, which are personal data: NAME_pages.csv beside NAME.csv "
      "(pages.csv beside trials.csv), or in the dataset; bids: also in participants.tsv, where "
      "the protocol's questions name a column");
  add("motion", po::bool_switch(),
      "bids: servo samples as Motion-BIDS, in place of a physiological recording; larger, because "
      "BIDS does not compress motion");
  add("contacts", po::bool_switch(),
      "bids and psych-ds: samples with the place of the deepest contact and the surface's normal "
      "there, by rendering each trial again");
  add("movement", po::bool_switch(),
      "bids and psych-ds: tables of the measures of movement as well (analyze --movement)");
  add("meshes", po::value<std::string>()->default_value("", "")->value_name("DIR"),
      "with --contacts, --movement: folder of the protocol's mesh files, for an old database that "
      "does not have them; default: the working directory");
  add("jobs", po::value<int>()->value_name("N"),
      "bids: threads that compress samples; default: one for each core. The files do not depend on "
      "it");
  add("force", po::bool_switch(), "replace an existing export");
}

Request request_of(const po::variables_map& values, const std::string& usage) {
  Request request{values["db"].as<std::string>(),    values["format"].as<std::string>(),
                  values["out"].as<std::string>(),   values["codebook"].as<std::string>(),
                  values["about"].as<std::string>(), values["meshes"].as<std::string>()};
  request.force = values["force"].as<bool>();
  request.pages = values["pages"].as<bool>();
  request.motion = values["motion"].as<bool>();
  request.contacts = values["contacts"].as<bool>();
  request.movement = values["movement"].as<bool>();
  request.jobs = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  if (values.count("jobs")) {
    request.jobs = values["jobs"].as<int>();
    constexpr int kMostJobs = 256;
    if (request.jobs < 1 || request.jobs > kMostJobs)
      throw UsageError("--jobs: must be 1 to 256, not " + std::to_string(request.jobs));
    if (request.format != "bids") throw UsageError("--jobs: is for --format bids");
  }
  if (request.format != "csv" && request.format != "bids" && request.format != "psych-ds") {
    throw UsageError("no format '" + request.format +
                     "'; there are: csv, bids, psych-ds\nUsage: " + usage);
  }
  request.times = times_of(values["times"].as<std::string>(), request.format, usage);
  if (!request.codebook.empty() && request.format != "csv") {
    throw UsageError("--codebook is for csv; " + request.format +
                     " describes its columns in JSON files");
  }
  if (!request.about.empty() && request.format == "csv")
    throw UsageError("--about is for bids and psych-ds; a CSV file has no description");
  if (request.motion && request.format != "bids")
    throw UsageError("--motion: is for --format bids");
  if ((request.contacts || request.movement) && request.format == "csv") {
    throw UsageError(
        "--contacts, --movement: are for bids and psych-ds; for CSV there is palpate analyze "
        "--movement --movement-csv FILE");
  }
  if (!request.meshes.empty() && !request.contacts && !request.movement)
    throw UsageError("--meshes: is for --contacts and --movement");
  return request;
}

data::ExportResult write_export(const Request& request) {
  data::ExportSettings settings = study::export_settings();
  if (!request.about.empty()) settings.about = registration::read_about_file(request.about);
  data::Store store = data::Store::open(request.database, data::Store::Mode::read_for_export);
  warn_of_exposure(request.database);
  settings.force = request.force;
  settings.pages = request.pages;
  settings.times = request.times;
  settings.codebook = request.codebook;
  Progress progress(store, output::catch_stop_signals());
  settings.progress = [&](std::int64_t trials) { progress.show(trials); };
  settings.motion = request.motion;
  settings.jobs = request.jobs;
  MovementExport hand(store, request.meshes);
  if (request.contacts) hand.add_contacts(settings);
  if (request.movement) {
    movement::MovementRequest measures;
    measures.database = request.database;
    measures.mesh_folder = request.meshes;
    measures.jobs = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
    hand.add_measures(settings, measures);
  }
  data::ExportResult done = export_as(request.format, store, request.out, settings);
  if (hand.not_rendered() > 0) {
    std::cerr << "warning: " << hand.not_rendered()
              << " trials have no contacts: rendering them again gives other forces than were "
                 "recorded\n";
  }
  return done;
}

void print(const Request& request, const data::ExportResult& done) {
  std::cerr << printable(request.out) << ": " << done.trials << " trials";
  if (done.samples > 0) std::cerr << ", " << done.samples << " samples";
  std::cerr << (done.simulated ? ", of SIMULATED participants among them\n" : "\n");
  if (!done.attempts_path.empty()) {
    std::cerr << printable(done.attempts_path) << ": " << done.attempts
              << " attempts that were cut off\n";
  }
  if (request.pages) {
    std::cerr << printable(done.pages_path.empty() ? request.out : done.pages_path) << ": "
              << done.answers << " answers to pages: personal data\n";
  }
  if (!request.codebook.empty())
    std::cerr << printable(request.codebook) << ": what the columns mean\n";
  if (!done.not_recorded.empty()) {
    std::cerr << "warning: 'palpate forget' will not list this export: "
              << printable(done.not_recorded) << "\n";
  }
}

void export_sweep(const Request& request, bool times_given) {
  if (request.format != "csv" || !request.codebook.empty() || times_given || request.pages) {
    throw UsageError(request.database +
                     ": is the file of a sweep, which is exported with --format csv alone, without "
                     "--times, --codebook and --pages");
  }
  data::SweepFile sweep = data::SweepFile::open(request.database);
  const std::atomic<bool>& stop_asked = output::catch_stop_signals();
  output::ProgressLine line("export");
  const auto all = static_cast<double>(std::max<std::int64_t>(1, sweep.count()));
  const std::int64_t points =
      data::export_sweep_csv(sweep, request.out, request.force, [&](std::int64_t done) {
        if (stop_asked) throw std::runtime_error("stopped; nothing was exported");
        line.show(static_cast<double>(done) / all);
      });
  line.clear();
  std::cerr << printable(request.out) << ": " << points << " of " << sweep.plan().points
            << " points, of SIMULATED participants\n";
}

}  // namespace

int export_command(const std::vector<std::string>& args) {
  CommandLine line;
  add_options(line);
  const auto values = line.parse(args);
  if (!values) return 0;
  const Request request = request_of(*values, line.usage);
  try {
    if (data::is_sweep_file(request.database)) {
      export_sweep(request, !(*values)["times"].as<std::string>().empty());
      return 0;
    }
    print(request, write_export(request));
  } catch (const data::StoreRefused& error) {
    throw UsageError(error.what());  // the files named are bad input: status 2
  }
  return 0;
}

}  // namespace palpate::runner::commands
