#include <algorithm>
#include <atomic>
#include <iostream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

#include "data/export/bids.h"
#include "data/export/csv.h"
#include "data/export/psychds.h"
#include "data/export/sweep_csv.h"
#include "data/store/store.h"
#include "data/store/sweep_file.h"
#include "protocols/protocol.h"
#include "protocols/tasks/levels.h"
#include "runner/commands/shared/about_file.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/shared/progress_line.h"
#include "runner/commands/shared/stop_signal.h"
#include "runner/safety/fault_table.h"
#include "stimuli/printable.h"

namespace palpate::runner {
namespace {

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
  ProgressLine line_;
  double all_ = 0;
};

std::vector<data::BlockFacts> blocks_of(const nlohmann::ordered_json& protocol) {
  std::vector<data::BlockFacts> blocks;
  const auto text = [](const nlohmann::ordered_json& object, const char* key) {
    const auto found = object.find(key);
    return found != object.end() && found->is_string() ? found->get<std::string>() : "";
  };
  if (!protocol.contains("blocks") || !protocol["blocks"].is_array()) return blocks;
  for (const auto& block : protocol["blocks"]) {
    if (!block.is_object()) continue;
    data::BlockFacts& facts = blocks.emplace_back();
    facts.name = text(block, "name");
    facts.task = text(block, "task");
    if (const auto level = block.find("level"); level != block.end() && level->is_object())
      facts.level_path = text(*level, "path");
    if (!facts.level_path.empty()) facts.level_unit = protocols::unit_of_level(facts.level_path);
  }
  return blocks;
}

/// "PAGE, ITEM" and what it asks.
std::vector<std::pair<std::string, std::string>> questions_of(const nlohmann::ordered_json& json) {
  std::vector<std::pair<std::string, std::string>> questions;
  const auto text = [](const nlohmann::ordered_json& of, const char* key) {
    return of.is_object() && of.contains(key) && of[key].is_string() ? of[key].get<std::string>()
                                                                     : std::string();
  };
  const auto list = [](const nlohmann::ordered_json& of, const char* key) {
    return of.is_object() && of.contains(key) && of[key].is_array()
               ? of[key]
               : nlohmann::ordered_json::array();
  };
  for (const auto& page : list(json, "pages")) {
    for (const auto& item : list(page, "items"))
      questions.emplace_back(text(page, "name") + ", " + text(item, "name"),
                             text(item, "question"));
  }
  return questions;
}

/// Reads only what an export needs from the stored text, so that old databases can be exported
/// after the rules for protocols have changed.
data::ProtocolFacts facts_of(const data::ProtocolInfo& info) {
  const auto json = nlohmann::ordered_json::parse(info.text, nullptr, false);
  if (!json.is_object())
    throw data::StoreRefused("the text of protocol " + info.name + " is damaged");
  data::ProtocolFacts facts{.servo_rate = protocols::Protocol{}.servo_rate};
  if (json.contains("title") && json["title"].is_string()) facts.title = json["title"];
  if (json.contains("servo") && json["servo"].is_object() && json["servo"].contains("rate_hz") &&
      json["servo"]["rate_hz"].is_number()) {
    facts.servo_rate = json["servo"]["rate_hz"];
  }
  if (!(facts.servo_rate > 0))
    throw data::StoreRefused("protocol " + info.name + " has no servo rate");
  facts.questions = questions_of(json);
  if (!json.contains("stimuli") || !json["stimuli"].is_array()) return facts;
  for (const auto& stimulus : json["stimuli"]) {
    if (!stimulus.is_object() || !stimulus.contains("name") || !stimulus["name"].is_string())
      continue;
    nlohmann::ordered_json object = stimulus;
    object.erase("name");
    facts.stimuli.push_back({stimulus["name"], object.dump()});
  }
  facts.blocks = blocks_of(json);
  return facts;
}

std::vector<data::FaultMeaning> fault_bits() {
  std::vector<data::FaultMeaning> all;
  all.reserve(kFaultTable.size());
  for (const rendering::FaultBit& fault : kFaultTable) {
    all.push_back({fault.bit, std::string(fault.name) + ": " + fault.meaning});
  }
  return all;
}

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
  std::string database, format, out, codebook, about;
  data::Times times = data::Times::absolute;
  bool force = false, pages = false;
};

void add_options(CommandLine& line) {
  line.usage =
      "palpate export --db FILE --format csv|bids|psych-ds --out PATH\n"
      "       [--times relative|absolute] [--codebook FILE] [--about FILE.json]\n"
      "       [--pages] [--force]";
  line.summary =
      "Writes the trials of a database for others, completely or not at all. Can be used while a\n"
      "session runs. csv: every completed trial as a row of PATH, and the attempts that were cut\n"
      "off, if there are any, in attempts.csv in the same folder. bids, psych-ds: a\n"
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
      "the answers to pages as well, which are personal data: pages.csv in the same folder, or in "
      "the dataset");
  add("force", po::bool_switch(), "replace an existing export");
}

Request request_of(const po::variables_map& values, const std::string& usage) {
  Request request{values["db"].as<std::string>(), values["format"].as<std::string>(),
                  values["out"].as<std::string>(), values["codebook"].as<std::string>(),
                  values["about"].as<std::string>()};
  request.force = values["force"].as<bool>();
  request.pages = values["pages"].as<bool>();
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
  return request;
}

data::ExportResult write_export(const Request& request) {
  data::ExportSettings settings;
  if (!request.about.empty()) settings.about = read_about_file(request.about);
  data::Store store = data::Store::open(request.database, data::Store::Mode::read_only);
  warn_of_exposure(request.database);
  settings.force = request.force;
  settings.pages = request.pages;
  settings.program_version = PALPATE_VERSION;
  settings.facts = facts_of;
  settings.times = request.times;
  settings.codebook = request.codebook;
  settings.fault_bits = fault_bits();
  Progress progress(store, catch_stop_signals());
  settings.progress = [&](std::int64_t trials) { progress.show(trials); };
  return export_as(request.format, store, request.out, settings);
}

void print(const Request& request, const data::ExportResult& done) {
  std::cerr << stimuli::printable(request.out) << ": " << done.trials << " trials";
  if (done.samples > 0) std::cerr << ", " << done.samples << " samples";
  std::cerr << (done.simulated ? ", of SIMULATED participants among them\n" : "\n");
  if (!done.attempts_path.empty()) {
    std::cerr << stimuli::printable(done.attempts_path) << ": " << done.attempts
              << " attempts that were cut off\n";
  }
  if (request.pages) {
    std::cerr << stimuli::printable(done.pages_path.empty() ? request.out : done.pages_path) << ": "
              << done.answers << " answers to pages: personal data\n";
  }
  if (!request.codebook.empty())
    std::cerr << stimuli::printable(request.codebook) << ": what the columns mean\n";
  if (!done.not_recorded.empty()) {
    std::cerr << "warning: 'palpate forget' will not list this export: "
              << stimuli::printable(done.not_recorded) << "\n";
  }
}

}  // namespace

namespace {

void export_sweep(const Request& request, bool times_given) {
  if (request.format != "csv" || !request.codebook.empty() || times_given || request.pages) {
    throw UsageError(request.database +
                     ": is the file of a sweep, which is exported with --format csv alone, without "
                     "--times, --codebook and --pages");
  }
  data::SweepFile sweep = data::SweepFile::open(request.database);
  const std::atomic<bool>& stop_asked = catch_stop_signals();
  ProgressLine line("export");
  const auto all = static_cast<double>(std::max<std::int64_t>(1, sweep.count()));
  const std::int64_t points =
      data::export_sweep_csv(sweep, request.out, request.force, [&](std::int64_t done) {
        if (stop_asked) throw std::runtime_error("stopped; nothing was exported");
        line.show(static_cast<double>(done) / all);
      });
  line.clear();
  std::cerr << stimuli::printable(request.out) << ": " << points << " of " << sweep.plan().points
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

}  // namespace palpate::runner
