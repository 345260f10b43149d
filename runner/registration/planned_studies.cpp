#include "runner/registration/planned_studies.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <utility>

#include "analysis/input/study_table.h"
#include "analysis/input/trials.h"
#include "analysis/report/report.h"
#include "analysis/report/study_report.h"
#include "analysis/statistics/analysis.h"
#include "analysis/statistics/jobs.h"
#include "analysis/statistics/power.h"
#include "analysis/statistics/task_analysis.h"
#include "data/base/cell_name.h"
#include "data/base/random.h"
#include "data/export/csv.h"
#include "data/store/store.h"
#include "protocols/groups.h"
#include "protocols/schedule.h"
#include "protocols/tasks/levels.h"
#include "runner/build_info.h"
#include "runner/registration/planned_conditions.h"
#include "runner/session/run_record.h"
#include "runner/session/simulated_study.h"
#include "runner/study/export_settings.h"
#include "runner/study/simulation_limits.h"
#include "runner/usage_error.h"

namespace palpate::runner::registration {
namespace {

using analysis::PlannedMeasure;
using analysis::ThresholdStudy;

constexpr std::int64_t kSecond_ns = 1'000'000'000, kDay_ns = 86'400 * kSecond_ns;
constexpr std::int64_t kFirstMorning_ns = 946'717'200 * kSecond_ns;  // 2000-01-01T09:00:00Z
constexpr double kBetweenTrials = 5;                                 // s
constexpr double kTimeSd = 0.5;  // of log times where the plan is of another measure

/// The measure's study with the effect, and the one to compare it with: without the effect; where
/// equivalence is planned, with a difference as large as the bound.
ThresholdStudy study_of(const ThresholdStudy& planned, bool with_effect) {
  ThresholdStudy out = planned;
  if (!with_effect) out.effect = planned.bound.value_or(0);
  return out;
}

/// Log odds of the second minus the first condition.
double odds_effect(const ThresholdStudy& study) {
  return study.effect == 0 ? 0 : analysis::log_odds_effect(study);
}

double logistic(double log_odds) { return 1 / (1 + std::exp(-log_odds)); }

double log_odds(double share) { return std::log(share / (1 - share)); }

// Shapes are identified, in the order of version 1: answers and times are drawn from the model of
// the plan.

class PlannedTimes final : public PlannedStudies {
 public:
  /// The shapes of a model of times are those of the protocol, which has two renderers.
  explicit PlannedTimes(const Registration& made);

  void write(const std::string& folder, const std::string& csv, const std::string& codebook,
             bool with_effect) const override;
  std::string analyzed(const std::string& csv, const std::string& name) override;
  std::string analyzed(std::size_t study, bool with_effect) const override;
  std::size_t usual_studies() const override { return 200; }

 private:
  struct Outcome {
    bool correct = false, timed_out = false;
    std::size_t answer = 0;  ///< shape of the model
    double time = 0;         ///< s
  };
  std::vector<analysis::ModelAnswer> answers(std::size_t participant, std::size_t study,
                                             bool with_effect) const;
  /// Of all trials of a participant, practice included.
  std::vector<Outcome> outcomes(std::size_t participant, std::size_t study, bool with_effect) const;
  analysis::TrialTable table(std::size_t study, bool with_effect) const;
  std::string analyzed(analysis::TrialTable table) const;

  const Registration& made_;
  const protocols::Protocol& protocol_;
  std::vector<std::string> shapes_;                       ///< of the model, or of the protocol
  std::vector<std::vector<protocols::Trial>> schedules_;  ///< by participant
  std::vector<std::size_t> shape_of_stimulus_;            ///< index into shapes_
  analysis::TrialTable like_;                             ///< names of the first study's table
};

PlannedTimes::PlannedTimes(const Registration& made) : made_(made), protocol_(made.protocol) {
  if (const analysis::StudyModel* const model = made.plan.times()) {
    shapes_ = model->shapes;
  } else {
    for (const protocols::StimulusSpec& stimulus : protocol_.stimuli)
      shapes_.push_back(stimulus.name);
  }
  for (std::size_t p = 0; p < made.participants; ++p)
    schedules_.push_back(protocols::schedule(protocol_, static_cast<int>(p) + 1));
  for (const protocols::StimulusSpec& stimulus : protocol_.stimuli)
    shape_of_stimulus_.push_back(
        static_cast<std::size_t>(std::ranges::find(shapes_, stimulus.name) - shapes_.begin()));
}

std::vector<analysis::ModelAnswer> PlannedTimes::answers(std::size_t participant, std::size_t study,
                                                         bool with_effect) const {
  std::vector<analysis::ModelTrial> trials;
  for (const protocols::Trial& trial : schedules_[participant])
    trials.push_back({shape_of_stimulus_[static_cast<std::size_t>(trial.stimulus)],
                      trial.renderer == protocols::RendererKind::ray});
  Random random(made_.seed, {with_effect ? 1U : 0U, study, participant});
  if (const analysis::StudyModel* const model = made_.plan.times())
    return analysis::draw_answers(with_effect ? *model : analysis::without_effect(*model),
                                  made_.typical_time, trials, random);
  const ThresholdStudy accuracy = study_of(*made_.plan.measure(), with_effect);
  const double level = log_odds(accuracy.accuracy) + accuracy.participant_sd * random.normal();
  const double own = accuracy.effect_sd * random.normal();
  const double shift = odds_effect(accuracy);
  std::vector<analysis::ModelAnswer> out;
  for (const analysis::ModelTrial& trial : trials) {
    analysis::ModelAnswer& one = out.emplace_back();
    one.usable =
        random.unit() < logistic(level + (trial.with_renderer ? shift + own / 2 : -own / 2));
    if (!one.usable && shapes_.size() > 1) one.other = 1 + random.below(shapes_.size() - 1);
    one.time = made_.typical_time * std::exp(kTimeSd * random.normal());
  }
  return out;
}

std::vector<PlannedTimes::Outcome> PlannedTimes::outcomes(std::size_t participant,
                                                          std::size_t study,
                                                          bool with_effect) const {
  const std::vector<analysis::ModelAnswer> drawn = answers(participant, study, with_effect);
  std::vector<Outcome> out;
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    const std::size_t shape =
        shape_of_stimulus_[static_cast<std::size_t>(schedules_[participant][i].stimulus)];
    Outcome& one = out.emplace_back();
    one.time = drawn[i].time;
    one.answer = (shape + drawn[i].other) % shapes_.size();
    one.timed_out =
        one.time >= protocol_.blocks.front().time_out || (!drawn[i].usable && one.answer == shape);
    one.correct = !one.timed_out && one.answer == shape;
    if (one.timed_out) one.time = protocol_.blocks.front().time_out;
  }
  return out;
}

void PlannedTimes::write(const std::string& folder, const std::string& csv,
                         const std::string& codebook, bool with_effect) const {
  namespace fs = std::filesystem;
  fs::create_directory(folder);
  data::Store store = data::Store::open((fs::path(folder) / "study.db").string(),
                                        data::Store::Mode::write_or_create);
  const data::ProtocolInfo info = session::info_of(protocol_);
  for (std::size_t p = 0; p < schedules_.size(); ++p) {
    const int number = static_cast<int>(p) + 1;
    const data::Participant participant =
        store.enrol(info, session::simulated_code(number), number, true, made_.seed);
    const std::vector<Outcome> all = outcomes(p, 0, with_effect);
    for (int session = 1; session <= protocol_.sessions.count; ++session) {
      data::RunInfo run_info;
      run_info.session = session;
      run_info.clock = {
          kFirstMorning_ns +
              (static_cast<std::int64_t>(p) * protocol_.sessions.count + session - 1) * kDay_ns,
          0};
      run_info.program_version = PALPATE_VERSION;
      run_info.build = build_description();
      run_info.device = run_info.response_device = "none: drawn from the model of a plan";
      std::vector<data::TrialRecord> records;
      double now = 0;
      for (std::size_t i = 0; i < all.size(); ++i) {
        const protocols::Trial& trial = schedules_[p][i];
        if (trial.session != session) continue;
        data::TrialRecord& record = records.emplace_back();
        record.session = session;
        record.block = trial.block;
        record.trial = trial.trial;
        record.renderer = protocols::to_string(trial.renderer);
        record.shape = protocol_.stimuli[static_cast<std::size_t>(trial.stimulus)].name;
        if (!all[i].timed_out) record.response = shapes_[all[i].answer];
        record.correct = all[i].correct;
        record.timed_out = all[i].timed_out;
        record.practice = trial.practice;
        record.orientation_wxyz = {trial.orientation.w, trial.orientation.x, trial.orientation.y,
                                   trial.orientation.z};
        record.response_time = all[i].time;
        record.onset_ns = std::llround(1e9 * now);
        record.response_ns = std::llround(1e9 * (now + all[i].time));
        now += all[i].time + kBetweenTrials;
      }
      if (records.empty()) continue;
      const data::Run run = store.begin_run(participant, run_info);
      store.record_simulated(run, records);
      store.end_run(run, data::RunEnd::done, records.back().response_ns);
    }
  }
  data::ExportSettings settings = study::export_settings();
  settings.codebook = codebook;
  data::export_csv(store, csv, settings);
}

std::string PlannedTimes::analyzed(analysis::TrialTable table) const {
  analysis::AnalysisSettings settings;
  settings.too_fast = made_.too_fast;
  return analysis::report_json(analysis::analyze(std::move(table), settings, PALPATE_VERSION));
}

std::string PlannedTimes::analyzed(const std::string& csv, const std::string& name) {
  like_ = analysis::read_trials_csv(csv);
  like_.provenance.source = name;
  return analyzed(like_);
}

std::string PlannedTimes::analyzed(std::size_t study, bool with_effect) const {
  return analyzed(table(study, with_effect));
}

analysis::TrialTable PlannedTimes::table(std::size_t study, bool with_effect) const {
  analysis::TrialTable out = like_;
  out.rows.clear();
  out.rows.reserve(like_.rows.size());
  const auto at = [](const std::vector<std::string>& names, const std::string& name) {
    return static_cast<std::size_t>(std::ranges::find(names, name) - names.begin());
  };
  const std::array<std::size_t, 2> renderer = {at(like_.renderers, "point"),
                                               at(like_.renderers, "ray")};
  std::vector<std::size_t> shapes, answers;
  for (const std::string& shape : shapes_) {
    shapes.push_back(at(like_.shapes, shape));
    answers.push_back(at(like_.answers, shape));
  }
  for (std::size_t p = 0; p < schedules_.size(); ++p) {
    const std::vector<Outcome> all = outcomes(p, study, with_effect);
    std::uint32_t position = 0;
    std::array<std::uint32_t, 2> exposure{};
    for (std::size_t i = 0; i < all.size(); ++i) {
      const protocols::Trial& trial = schedules_[p][i];
      if (trial.practice) continue;
      const std::size_t r = trial.renderer == protocols::RendererKind::ray ? 1 : 0;
      analysis::TrialRow row;
      row.participant = static_cast<std::uint32_t>(p);
      row.renderer = static_cast<std::uint16_t>(renderer[r]);
      row.shape = static_cast<std::uint16_t>(
          shapes[shape_of_stimulus_[static_cast<std::size_t>(trial.stimulus)]]);
      row.answer = all[i].timed_out ? -1 : static_cast<std::int32_t>(answers[all[i].answer]);
      row.correct = all[i].correct;
      row.timed_out = all[i].timed_out;
      row.response_time = all[i].time;
      row.position = ++position;
      row.exposure = ++exposure[r];
      out.rows.push_back(row);
    }
  }
  return out;
}

// Tasks: simulated participants in the trial loop of 'palpate simulate', who judge as the plan
// says.

class PlannedTasks final : public PlannedStudies {
 public:
  explicit PlannedTasks(const Registration& made);

  void write(const std::string& folder, const std::string& csv, const std::string& codebook,
             bool with_effect) const override;
  std::string analyzed(const std::string& csv, const std::string& name) override;
  std::string analyzed(std::size_t study, bool with_effect) const override;
  std::size_t usual_studies() const override { return 20; }  // run trial by trial

 private:
  participants::JudgementOf judgement(std::size_t study, bool with_effect) const;
  participants::JudgementSettings of_measure(const ThresholdStudy& study,
                                             const protocols::Trial& trial, Random& person,
                                             Random& trials) const;
  participants::JudgementSettings of_times(const analysis::StudyModel& model,
                                           const protocols::Trial& trial, Random& person) const;
  using Visit = std::function<void(int participant, const data::TrialRecord&)>;
  /// Simulates without storing. Movements keep their paths; the planned measure of their records is
  /// the plan's.
  void simulate(std::size_t study, bool with_effect, const Visit& visit) const;
  void put_movement(const ThresholdStudy& study, std::size_t number, bool with_effect,
                    int participant, const protocols::Trial& trial, data::ReachRecord& reach) const;
  void write_movements(data::Store& store, bool with_effect) const;
  bool of_reaching() const {
    return made_.plan.measure() != nullptr &&
           analysis::is_of_reaching(made_.plan.measure()->measure);
  }
  std::string analyzed(analysis::StudyTable table, int simulations) const;

  const Registration& made_;
  protocols::Protocol protocol_;  ///< fit for the simulated device, without samples
  participants::SimulatedSettings settings_;
  PlannedConditions conditions_;
};

PlannedTasks::PlannedTasks(const Registration& made)
    : made_(made),
      protocol_(made.protocol),
      settings_(participants::load_simulated_settings("")),
      conditions_(conditions_of(made.protocol, made.plan)) {
  // Measures of movements come from the samples.
  protocol_.samples = std::ranges::any_of(protocol_.blocks, [](const protocols::TaskBlock& block) {
    return block.reaching.has_value();
  });
  study::fit_to_simulation(protocol_, settings_);
}

participants::JudgementSettings PlannedTasks::of_measure(const ThresholdStudy& study,
                                                         const protocols::Trial& trial,
                                                         Random& person, Random& trials) const {
  constexpr double kQuartile = 0.6744897501960817;  // of the normal distribution
  const protocols::TaskBlock& block = protocols::block_of(protocol_, trial);
  // The same draws in every trial of a participant.
  const double level = study.participant_sd * person.normal();
  const double own = study.effect_sd * person.normal();
  const double place = study.pse_sd * person.normal();
  const double whole =
      study.measure == PlannedMeasure::accuracy ? odds_effect(study) : study.effect;
  const double half = conditions_.is_second(trial, 0) ? 0.5 : -0.5;
  // Shares are planned from the first condition, other measures from the middle of both.
  const double difference = !conditions_.differ ? 0
                            : study.measure == PlannedMeasure::accuracy
                                ? (half > 0 ? whole : 0) + half * own
                                : half * (whole + own);
  participants::JudgementSettings out;
  out.weber = study.weber_fraction / kQuartile;
  out.lapse = 2 * study.lapse;  // a random answer is right half of the time
  double jnds = protocols::side_of_levels(protocol_, block) == 0 ? place : 0;
  double log_weber = 0;
  switch (study.measure) {
    case PlannedMeasure::jnd:
      log_weber = level + difference;
      break;
    case PlannedMeasure::pse:
      log_weber = level;
      jnds += difference;
      break;
    case PlannedMeasure::threshold:
      if (block.task == protocols::TaskKind::compare) log_weber = level;
      out.threshold_log_ratio =
          difference + (block.task == protocols::TaskKind::compare ? 0 : level);
      out.lapse = block.task == protocols::TaskKind::detect ? study.lapse : out.lapse;
      jnds = 0;
      break;
    case PlannedMeasure::accuracy:
      out.share_correct = logistic(log_odds(study.accuracy) + level + difference);
      out.lapse = 0;
      out.time = made_.typical_time * std::exp(kTimeSd * trials.normal());
      break;
    case PlannedMeasure::rating:
      out.rating = level + difference;
      out.rating_sd = study.rating_sd;
      out.lapse = 0;
      break;
    case PlannedMeasure::exponent:
      out.exponent = analysis::kTypicalExponent * std::exp(level + difference);
      out.number_sd = study.number_sd;
      out.lapse = 0;
      break;
    case PlannedMeasure::deviation:
    case PlannedMeasure::aftereffect:
    case PlannedMeasure::adaptation:
      break;  // of movements, which are not judged
  }
  out.weber *= std::exp(log_weber);
  out.turn_sd *= std::exp(log_weber);
  out.shift = kQuartile * jnds * std::exp(-log_weber);  // JNDs of the median participant
  return out;
}

participants::JudgementSettings PlannedTasks::of_times(const analysis::StudyModel& model,
                                                       const protocols::Trial& trial,
                                                       Random& person) const {
  const std::string name =
      base_name(protocol_.stimuli[static_cast<std::size_t>(trial.stimulus)].name);
  const auto shape =
      static_cast<std::size_t>(std::ranges::find(model.shapes, name) - model.shapes.begin());
  // The participant's gains are drawn first; the last trial of the list is this one.
  constexpr std::size_t kMostTrials = 2'000;  // of a session
  const std::size_t count = (static_cast<std::size_t>(trial.session) - 1) * kMostTrials +
                            static_cast<std::size_t>(trial.trial);
  const std::vector<analysis::ModelTrial> same(count, {shape, conditions_.is_second(trial, 0)});
  const analysis::ModelAnswer drawn =
      analysis::draw_answers(model, made_.typical_time, same, person).back();
  participants::JudgementSettings out;
  out.share_correct = drawn.usable ? 1 : 0;
  out.lapse = 0;
  out.time = drawn.time;
  return out;
}

participants::JudgementOf PlannedTasks::judgement(std::size_t study, bool with_effect) const {
  return [this, study, with_effect](int participant, const protocols::Trial& trial) {
    const auto number = static_cast<std::uint64_t>(participant - 1);
    const bool measured =
        std::ranges::find(conditions_.blocks, trial.task_block) != conditions_.blocks.end();
    if (!measured) return participants::JudgementSettings{};
    Random person(made_.seed, {with_effect ? 1U : 0U, study, number});
    if (const ThresholdStudy* const planned = made_.plan.measure()) {
      Random trials(made_.seed, {with_effect ? 1U : 0U, study, number,
                                 static_cast<std::uint64_t>(trial.session),
                                 static_cast<std::uint64_t>(trial.trial)});
      return of_measure(study_of(*planned, with_effect), trial, person, trials);
    }
    const analysis::StudyModel& model = *made_.plan.times();
    return of_times(with_effect ? model : analysis::without_effect(model), trial, person);
  };
}

void PlannedTasks::put_movement(const ThresholdStudy& study, std::size_t number, bool with_effect,
                                int participant, const protocols::Trial& trial,
                                data::ReachRecord& reach) const {
  using protocols::ReachTrial;
  const bool of_adaptation = study.measure == PlannedMeasure::adaptation;
  const ReachTrial kind = of_adaptation                                  ? ReachTrial::clamp
                          : study.measure == PlannedMeasure::aftereffect ? ReachTrial::none
                                                                         : ReachTrial::field;
  std::optional<double>& value = of_adaptation ? reach.adaptation : reach.deviation;
  const bool measured =
      std::ranges::find(conditions_.blocks, trial.task_block) != conditions_.blocks.end();
  if (!measured || trial.reach != kind || !value) return;
  const auto who = static_cast<std::uint64_t>(participant - 1);
  // The same draws in every trial of a participant.
  Random person(made_.seed, {with_effect ? 1U : 0U, number, who});
  const double level = study.participant_sd * person.normal();
  const double own = study.effect_sd * person.normal();
  Random movement(made_.seed,
                  {with_effect ? 1U : 0U, number, who, static_cast<std::uint64_t>(trial.session),
                   static_cast<std::uint64_t>(trial.trial)});
  const bool second = conditions_.is_second(trial, made_.protocol.groups.group(participant));
  const bool typical = of_adaptation && conditions_.contrast != analysis::PlannedContrast::zero;
  value = (typical ? analysis::kTypicalAdaptation : 0) + level + (second ? study.effect : 0) +
          study.movement_sd * movement.normal();
  if (conditions_.contrast == analysis::PlannedContrast::conditions)
    *value += second ? own / 2 : -own / 2;
}

void PlannedTasks::simulate(std::size_t study, bool with_effect, const Visit& visit) const {
  protocols::Trial shown;
  const participants::JudgementOf judged = judgement(study, with_effect);
  session::simulate_in_memory(
      protocol_, settings_, planned_numbers(made_), made_.seed + study, {},
      [&](int participant, const data::TrialRecord& record, std::uint64_t) {
        if (!record.task.reach) return visit(participant, record);
        data::TrialRecord planned = record;
        planned.samples.clear();
        planned.bodies.clear();
        if (of_reaching())
          put_movement(study_of(*made_.plan.measure(), with_effect), study, with_effect,
                       participant, shown, *planned.task.reach);
        visit(participant, planned);
      },
      [&](int participant, const protocols::Trial& trial) {
        shown = trial;
        return judged(participant, trial);
      });
}

/// As session::simulate_study, without answers to pages.
void PlannedTasks::write_movements(data::Store& store, bool with_effect) const {
  std::map<std::pair<int, int>, std::vector<data::TrialRecord>> sessions;  // participant, session
  simulate(0, with_effect, [&](int participant, const data::TrialRecord& record) {
    sessions[{participant, record.session}].push_back(record);
  });
  const data::ProtocolInfo info = session::info_of(protocol_);
  for (const auto& [of, records] : sessions) {
    const auto [number, session] = of;
    const data::Participant participant =
        store.enrol(info, session::simulated_code(number), number, true, made_.seed);
    const data::Run run = store.begin_run(
        participant, session::simulated_run(protocols::protocol_of(protocol_, number), settings_,
                                            number, session));
    store.record_simulated(run, records);
    store.end_run(run, data::RunEnd::done, records.back().response_ns);
  }
}

void PlannedTasks::write(const std::string& folder, const std::string& csv,
                         const std::string& codebook, bool with_effect) const {
  namespace fs = std::filesystem;
  fs::create_directory(folder);
  data::Store store = data::Store::open((fs::path(folder) / "study.db").string(),
                                        data::Store::Mode::write_or_create);
  if (of_reaching()) {
    write_movements(store, with_effect);
  } else {
    session::StudyPlan plan;
    plan.numbers = planned_numbers(made_);
    plan.seed = made_.seed;
    plan.planned = judgement(0, with_effect);
    session::simulate_study(protocol_, store, settings_, plan, {}, {});
  }
  data::ExportSettings settings = study::export_settings();
  settings.codebook = codebook;
  data::export_csv(store, csv, settings);
}

std::string PlannedTasks::analyzed(analysis::StudyTable table, int simulations) const {
  analysis::FunctionSettings functions;
  functions.simulations = simulations;
  analysis::AnalysisSettings settings;
  settings.too_fast = made_.too_fast;
  return analysis::study_json(
      analysis::analyze_study(std::move(table), functions, settings, PALPATE_VERSION));
}

std::string PlannedTasks::analyzed(const std::string& csv, const std::string& name) {
  const protocols::Protocol& protocol = made_.protocol;
  analysis::StudyTable table = analysis::read_study_csv(
      csv, {}, {{protocol.name, protocol.sha256, protocol.source_text, "", ""}});
  table.source = table.provenance.source = name;
  return analyzed(std::move(table), analysis::FunctionSettings{}.simulations);
}

std::string PlannedTasks::analyzed(std::size_t study, bool with_effect) const {
  analysis::StudyTable table;
  table.simulated = true;
  table.protocols = {{made_.protocol.name, made_.protocol.sha256}};
  const GroupAssignment groups = made_.protocol.groups.unmasked();
  // No figure with a name depends on simulated goodness of fit, which takes most of the time.
  simulate(study, with_effect, [&](int number, const data::TrialRecord& record) {
    if (record.practice) return;
    analysis::StudyTrial& trial = table.trials.emplace_back(
        analysis::study_trial_of(session::simulated_code(number), record));
    trial.protocol_sha256 = made_.protocol.sha256;
    trial.participant_number = number;
    trial.group = groups.name(number);
    trial.simulated = true;
  });
  const protocols::Protocol& own = made_.protocol;
  analysis::put_protocols({{own.name, own.sha256, own.source_text, "", ""}}, "protocol.json",
                          table);
  return analyzed(std::move(table), 0);
}

}  // namespace

std::unique_ptr<PlannedStudies> planned_identification(const Registration& made) {
  return std::make_unique<PlannedTimes>(made);
}

std::unique_ptr<PlannedStudies> planned_tasks(const Registration& made) {
  return std::make_unique<PlannedTasks>(made);
}

double typical_time(const protocols::Protocol& protocol, double too_fast) {
  for (const protocols::TaskBlock& block : protocol.blocks) {
    if (block.task == protocols::TaskKind::identify && !block.practice)
      return std::sqrt(too_fast * block.time_out);
  }
  return 0;
}

std::vector<Rehearsal> rehearse(const PlannedStudies& planned, const Registration& made,
                                std::size_t studies, std::size_t jobs,
                                const std::function<void(double)>& progress) {
  const std::vector<analysis::Hypothesis>& hypotheses = made.hypotheses;
  std::vector<Rehearsal> out(hypotheses.size());
  std::mutex mutex;
  const auto one_study = [&](std::size_t i) {
    const bool with_effect = i < studies;
    const analysis::NamedResults results = analysis::named_results(
        planned.analyzed(i % studies, with_effect), alpha_at(made, made.participants));
    std::vector<analysis::Verdict> verdicts;
    verdicts.reserve(hypotheses.size());
    for (const analysis::Hypothesis& one : hypotheses)
      verdicts.push_back(analysis::judge(one, results).verdict);
    const std::lock_guard lock(mutex);
    for (std::size_t h = 0; h < out.size(); ++h)
      (with_effect ? out[h].with_effect : out[h].without_effect).add(verdicts[h]);
  };
  analysis::do_jobs(2 * studies, jobs, one_study, progress);
  return out;
}

}  // namespace palpate::runner::registration
