#include "runner/commands/movement/movement_study.h"

#include <atomic>
#include <exception>
#include <map>
#include <memory>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include "runner/commands/movement/touched_trial.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/shared/csv_text.h"
#include "runner/commands/shared/progress_line.h"
#include "runner/commands/shared/study_trials.h"
#include "runner/session/recorded_trial.h"

namespace palpate::runner {
namespace {

struct WaitingTrial {
  std::shared_ptr<const TouchedStimuli> stimuli;
  data::StoredTrial trial;
  MeasuredTrial measured;
};

/// The stimuli of each trial; those of a protocol are built once, or once for each run whose device
/// limited them.
class StudyStimuli {
 public:
  StudyStimuli(data::Store& store, std::string folder)
      : store_(store), folder_(std::move(folder)) {}

  std::shared_ptr<const TouchedStimuli> of(const data::StoredTrial& trial) {
    const std::string& sha = trial.protocol_sha256;
    const auto run = std::tuple(trial.participant.id, trial.record.session, trial.run.clock.utc_ns,
                                trial.run.clock.monotonic_ns);
    if (const auto known = by_run_.find(run); known != by_run_.end()) return known->second;
    bool limited = false;
    protocols::Protocol protocol = protocol_as_shown(store_, trial, folder_, limited);
    std::shared_ptr<const TouchedStimuli> made;
    if (const auto known = by_protocol_.find(sha); !limited && known != by_protocol_.end())
      made = known->second;
    else
      made = std::make_shared<TouchedStimuli>(std::move(protocol));
    if (!limited) by_protocol_[sha] = made;
    return by_run_[run] = made;
  }

 private:
  data::Store& store_;
  std::string folder_;
  std::map<std::string, std::shared_ptr<const TouchedStimuli>> by_protocol_;
  std::map<std::tuple<std::int64_t, int, std::int64_t, std::int64_t>,
           std::shared_ptr<const TouchedStimuli>>
      by_run_;
};

void measure_all(std::vector<WaitingTrial>& waiting, const MovementRequest& request) {
  std::atomic<std::size_t> next{0};
  std::exception_ptr failed;
  std::atomic<bool> has_failed{false};
  const auto work = [&] {
    try {
      for (std::size_t i = next++; i < waiting.size() && !has_failed; i = next++)
        waiting[i].measured =
            measure_trial(*waiting[i].stimuli, waiting[i].trial, request.settings);
    } catch (...) {
      if (!has_failed.exchange(true)) failed = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> threads;
    for (int i = 1; i < request.jobs; ++i) threads.emplace_back(work);
    work();
  }
  if (failed) std::rethrow_exception(failed);
}

std::vector<std::string> columns() {
  std::vector<std::string> names = {"participant_id", "session", "block",   "trial",
                                    "renderer",       "shape",   "correct", "simulated",
                                    "cutoff_hz",      "samples"};
  for (const auto& one : analysis::measure_definitions()) names.emplace_back(one.name);
  names.emplace_back("missing");
  return names;
}

/// As RFC 4180 has it: in quotes where there is a comma.
std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char letter : text) quoted += letter == '"' ? "\"\"" : std::string(1, letter);
  return quoted + "\"";
}

void put_row(CsvText& csv, const WaitingTrial& one, const analysis::MovementSettings& settings) {
  const data::TrialRecord& record = one.trial.record;
  csv << one.trial.participant.code << record.session << record.block << record.trial
      << record.renderer << record.shape << record.correct << one.trial.participant.simulated
      << settings.cutoff << one.measured.ticks;
  for (const auto& value : one.measured.values) {
    if (value)
      csv << *value;
    else
      csv << "";
  }
  csv << csv_field(one.measured.missing);
  csv.end_row();
}

}  // namespace

MovementStudy measure_study(const MovementRequest& request) {
  MovementStudy study;
  study.table.trials = read_study_trials(request.database, "");
  study.table.settings = request.settings;
  CsvText csv(columns(), "\n");
  data::Store store = data::Store::open(request.database, data::Store::Mode::read_only);
  StudyStimuli stimuli(store, request.mesh_folder);
  ProgressLine progress("movement");
  std::vector<WaitingTrial> waiting;
  std::size_t ticks = 0;
  const auto measure_waiting = [&] {
    measure_all(waiting, request);
    for (const WaitingTrial& one : waiting) {
      put_row(csv, one, request.settings);
      study.table.values.push_back(one.measured.values);
      if (!one.measured.missing.empty()) ++study.table.missing[one.measured.missing];
    }
    waiting.clear();
    ticks = 0;
    progress.show(static_cast<double>(study.table.values.size()) /
                  static_cast<double>(study.table.trials.rows.size()));
  };
  store.for_each_trial(
      [&](const data::StoredTrial& trial) {
        constexpr std::size_t kTicksAtOnce = 500'000;  // some 200 MB
        if (trial.record.practice) return;
        waiting.push_back({stimuli.of(trial), trial, {}});
        ticks += trial.record.samples.size();
        if (ticks >= kTicksAtOnce || waiting.size() >= 1000) measure_waiting();
      },
      true);
  measure_waiting();
  study.csv = csv.text();
  if (study.table.values.size() != study.table.trials.rows.size())
    throw UsageError(request.database + ": trials were added while they were read; try again");
  return study;
}

}  // namespace palpate::runner
