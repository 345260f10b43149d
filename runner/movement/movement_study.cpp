#include "runner/movement/movement_study.h"

#include <atomic>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include "data/base/text.h"
#include "runner/movement/touched_trial.h"
#include "runner/output/outputs.h"
#include "runner/output/progress_line.h"
#include "runner/session/recorded_trial.h"
#include "runner/study/study_trials.h"
#include "runner/usage_error.h"

namespace palpate::runner::movement {
namespace {

/// The kept values of a trial.
struct TrialRow {
  MovementStudy::TrialKey key;
  std::string participant, renderer, shape;
  int session = 0, block = 0, trial = 0;
  bool correct = false, simulated = false;
  movement::MeasuredTrial measured;
};

/// Reads the trials of a study, shared among threads: unpacking and rendering samples takes most of
/// the time.
class StudyReader {
 public:
  StudyReader(const MovementRequest& request, movement::StudyStimuli& stimuli, std::size_t trials)
      : request_(request), stimuli_(stimuli), taken_(trials), rows_(trials) {}

  /// \throws UsageError: the database has changed meanwhile
  const std::vector<TrialRow>& read() {
    {
      std::vector<std::jthread> threads;
      for (int i = 1; i < request_.jobs; ++i) threads.emplace_back([this] { work(nullptr); });
      output::ProgressLine progress("movement");
      work(&progress);
    }
    if (failed_) std::rethrow_exception(failed_);
    return rows_;
  }

 private:
  void work(output::ProgressLine* progress) {
    try {
      read_share(progress);
    } catch (...) {
      if (!has_failed_.exchange(true)) failed_ = std::current_exception();
    }
  }

  /// Walks through all trials and takes those that no other thread has taken.
  void read_share(output::ProgressLine* progress) {
    data::Store store = data::Store::open(request_.database, data::Store::Mode::read_only);
    std::size_t index = 0;
    bool mine = false;
    const auto is_row = [&](const data::StoredTrial& trial) {
      return !trial.record.practice &&
             analysis::is_protocol(request_.protocol, trial.protocol_name, trial.protocol_sha256);
    };
    const auto take = [&](const data::StoredTrial& trial) {
      if (!is_row(trial) || has_failed_) return mine = false;
      if (index >= taken_.size()) {
        throw UsageError(request_.database + ": trials were added while they were read; try again");
      }
      return mine = !taken_[index].exchange(true);
    };
    const auto visit = [&](const data::StoredTrial& trial) {
      if (!is_row(trial)) return;
      const std::size_t at = index++;
      if (!mine) return;
      const data::TrialRecord& record = trial.record;
      rows_[at] = {key_of(trial),
                   trial.participant.code,
                   record.renderer,
                   record.shape,
                   record.session,
                   record.block,
                   record.trial,
                   record.correct,
                   trial.participant.simulated,
                   movement::measure_trial(*stimuli_.of(store, trial), trial, request_.settings,
                                           request_.pictures)};
      const std::size_t done = ++done_;
      if (progress) progress->show(static_cast<double>(done) / static_cast<double>(rows_.size()));
    };
    store.for_each_trial(visit, take);
    if (index < rows_.size() && !has_failed_)
      throw UsageError(request_.database + ": trials went away while they were read; try again");
  }

  const MovementRequest& request_;
  movement::StudyStimuli& stimuli_;
  std::vector<std::atomic<bool>> taken_;
  std::vector<TrialRow> rows_;
  std::atomic<std::size_t> done_{0};
  std::exception_ptr failed_;
  std::atomic<bool> has_failed_{false};
};

std::vector<std::string> columns() {
  std::vector<std::string> names = {"participant_id", "session", "block",   "trial",
                                    "renderer",       "shape",   "correct", "simulated",
                                    "cutoff_hz",      "samples"};
  for (const auto& one : analysis::measure_definitions()) names.emplace_back(one.name);
  names.emplace_back("missing");
  return names;
}

/// A CSV field by RFC 4180: in quotes if it has a comma.
std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char letter : text) quoted += letter == '"' ? "\"\"" : std::string(1, letter);
  return quoted + "\"";
}

void put_row(output::CsvText& csv, const TrialRow& one,
             const analysis::MovementSettings& settings) {
  csv << one.participant << one.session << one.block << one.trial << one.renderer << one.shape
      << one.correct << one.simulated << settings.cutoff << one.measured.ticks;
  for (const auto& value : one.measured.values) {
    if (value)
      csv << *value;
    else
      csv << "";
  }
  csv << csv_field(one.measured.missing);
  csv.end_row();
}

/// Reads the typical trials again, and the surfaces of their objects.
void add_pictures(const MovementRequest& request, movement::StudyStimuli& stimuli,
                  const std::vector<TrialRow>& rows, MovementStudy& study) {
  analysis::MovementPictures& pictures = study.pictures;
  pictures.outlines.resize(study.table.trials.shapes.size());
  data::Store store = data::Store::open(request.database, data::Store::Mode::read_only);
  for (const std::size_t at : analysis::typical_rows(study.table)) {
    const data::TrialName name{rows[at].participant, rows[at].session, rows[at].trial};
    for (const data::StoredTrial& stored : store.attempts(name)) {
      if (!stored.cut_off_reason.empty() || key_of(stored) != rows[at].key) continue;
      const std::shared_ptr<const movement::TouchedStimuli> touched = stimuli.of(store, stored);
      analysis::TypicalTrial typical{at, session::to_string(name), {}};
      if (!movement::read_movement(*touched, stored, typical.trial).empty()) continue;
      pictures.typical.push_back(std::move(typical));
      analysis::ShapeOutline& outline = pictures.outlines[study.table.trials.rows[at].shape];
      const int stimulus = touched->stimulus(stored.record.shape);
      const analysis::TouchedSurface* surface = touched->surface(stimulus);
      if (!outline.places.empty() || surface == nullptr) continue;
      outline.places = surface->places();
      outline.edges = touched->library().edges(stimulus).lines();
    }
  }
  std::vector<analysis::TrialTally> tallies;
  tallies.reserve(rows.size());
  for (const TrialRow& one : rows) tallies.push_back(one.measured.tally);
  analysis::add_up(study.table, tallies, pictures);
}

}  // namespace

MovementStudy::TrialKey key_of(const data::StoredTrial& trial) {
  return {trial.participant.id, trial.record.session, trial.record.trial};
}

void require_samples(const MovementStudy& study, const std::string& database) {
  const auto without = study.table.missing.find("no samples");
  if (without == study.table.missing.end() || without->second < study.table.values.size()) return;
  throw UsageError(printable(database) +
                   ": has no servo samples; a protocol with \"samples\": true keeps them");
}

MovementStudy measure_study(const MovementRequest& request) {
  MovementStudy study;
  data::Store store = study::open_study(request.database);
  study.table.trials = analysis::read_trials_store(store, request.protocol);
  study.table.settings = request.settings;
  output::CsvText csv(columns(), "\n");
  movement::StudyStimuli stimuli(request.mesh_folder);
  StudyReader reader(request, stimuli, study.table.trials.rows.size());
  const std::vector<TrialRow>& rows = reader.read();
  for (const TrialRow& one : rows) {
    put_row(csv, one, request.settings);
    study.rows[one.key] = study.table.values.size();
    study.missing.push_back(one.measured.missing);
    study.table.values.push_back(one.measured.values);
    if (!one.measured.missing.empty()) ++study.table.missing[one.measured.missing];
  }
  study.csv = csv.text();
  if (request.pictures) add_pictures(request, stimuli, rows, study);
  return study;
}

}  // namespace palpate::runner::movement
