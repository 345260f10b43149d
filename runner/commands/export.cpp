#include <atomic>
#include <iostream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

#include "data/export/bids.h"
#include "data/export/csv.h"
#include "data/export/psychds.h"
#include "data/store/store.h"
#include "protocols/protocol.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/shared/progress_line.h"
#include "runner/commands/shared/stop_signal.h"
#include "runner/safety/fault_table.h"
#include "stimuli/printable.h"

namespace palpate::runner {
namespace {

namespace po = boost::program_options;

/// Shows how far the export is, and ends it when that was asked for.
class Progress {
 public:
  Progress(data::Store& store, const std::atomic<bool>& stop_asked)
      : stop_asked_(stop_asked), line_("export") {
    if (!line_.on_terminal()) return;  // counting a million takes a while
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

/// Reads what is needed and no more: the text is a record, and exports must work years after the
/// protocol's rules have changed.
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
  if (!json.contains("stimuli") || !json["stimuli"].is_array()) return facts;
  for (const auto& stimulus : json["stimuli"]) {
    if (!stimulus.is_object() || !stimulus.contains("name") || !stimulus["name"].is_string())
      continue;
    nlohmann::ordered_json object = stimulus;
    object.erase("name");
    facts.stimuli.push_back({stimulus["name"], object.dump()});
  }
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

}  // namespace

int export_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage =
      "palpate export --db FILE --format csv|bids|psych-ds --out PATH\n"
      "       [--times relative|absolute] [--codebook FILE] [--force]";
  line.summary =
      "Writes the trials of a database for others, whole or not at all. Can be used while a\n"
      "session runs. csv: every completed trial as a row of PATH, and the attempts that were cut\n"
      "off, where there are any, to attempts.csv in the same folder. bids, psych-ds: a folder\n"
      "that describes itself, with the servo-rate samples where they were kept.\n"
      "Times are relative in bids and psych-ds: dates are shifted so that a participant's first\n"
      "trial is at 1900-01-01T00:00:00Z, and the column elapsed counts the seconds from it. csv "
      "has\n"
      "the true onset_utc unless --times relative is given.\n"
      "Texts that a spreadsheet would run (= + - @ in front) get a ' in front; analyze --csv takes "
      "it\n"
      "away again.";
  line.example =
      "  palpate export --db study.db --format csv --out trials.csv\n"
      "  palpate export --db study.db --format csv --out trials.csv --codebook codebook.csv\n"
      "  palpate export --db study.db --format bids --out study-bids\n"
      "  palpate export --db study.db --format psych-ds --out study-psychds --force   (replaces "
      "an\n"
      "      earlier export; a folder that palpate did not make is never replaced)";
  std::string database, format, out, times, codebook;
  auto add = line.options.add_options();
  add("db", po::value(&database)->required()->value_name("FILE"), "the study's database");
  add("format", po::value(&format)->required()->value_name("NAME"), "csv, bids or psych-ds");
  add("out", po::value(&out)->required()->value_name("PATH"),
      "the file (csv) or folder (others) to write");
  add("times", po::value(&times)->value_name("WORD"),
      "relative (default of bids and psych-ds) or absolute (default of csv)");
  add("codebook", po::value(&codebook)->value_name("FILE"),
      "csv only: what every column, value and fault bit means, as a table");
  add("force", po::bool_switch(), "replace an export that is there already");
  const auto values = line.parse(args);
  if (!values) return 0;
  if (format != "csv" && format != "bids" && format != "psych-ds") {
    throw UsageError("no format '" + format +
                     "'; there are: csv, bids, psych-ds\nUsage: " + line.usage);
  }
  const data::Times told = times_of(times, format, line.usage);
  if (!codebook.empty() && format != "csv") {
    throw UsageError("--codebook is for csv; " + format + " describes its columns in JSON files");
  }
  try {
    data::Store store = data::Store::open(database, data::Store::Mode::read_only);
    warn_of_exposure(database);
    data::ExportSettings settings;
    settings.force = (*values)["force"].as<bool>();
    settings.program_version = PALPATE_VERSION;
    settings.facts = facts_of;
    settings.times = told;
    settings.codebook = codebook;
    settings.fault_bits = fault_bits();
    data::ExportResult done;
    {
      Progress progress(store, watch_stop_signals());
      settings.progress = [&](std::int64_t trials) { progress.show(trials); };
      done = export_as(format, store, out, settings);
    }
    std::cerr << stimuli::printable(out) << ": " << done.trials << " trials";
    if (done.samples > 0) std::cerr << ", " << done.samples << " samples";
    std::cerr << (done.simulated ? ", of SIMULATED participants among them\n" : "\n");
    if (!done.attempts_path.empty()) {
      std::cerr << stimuli::printable(done.attempts_path) << ": " << done.attempts
                << " attempts that were cut off\n";
    }
    if (!codebook.empty()) std::cerr << stimuli::printable(codebook) << ": what the columns mean\n";
    if (!done.not_recorded.empty()) {
      std::cerr << "warning: 'palpate forget' will not list this export: "
                << stimuli::printable(done.not_recorded) << "\n";
    }
  } catch (const data::StoreRefused& error) {
    throw UsageError(error.what());  // the files named are bad input: status 2
  }
  return 0;
}

}  // namespace palpate::runner
