#include "analysis/statistics/task_analysis.h"

#include <algorithm>
#include <array>
#include <boost/math/distributions/students_t.hpp>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <tuple>
#include <utility>
#include <variant>

#include "analysis/statistics/describe.h"
#include "analysis/statistics/normal_tail.h"
#include "data/base/cell_name.h"

namespace palpate::analysis {
namespace {

/// 95 % interval of a mean by t; none below two values.
std::optional<Interval> mean_interval(const std::vector<double>& values) {
  const auto sd = standard_deviation(values);
  if (values.size() < 2 || !sd) return std::nullopt;
  const auto n = static_cast<double>(values.size());
  const double half = quantile(boost::math::students_t(n - 1), 0.975) * *sd / std::sqrt(n);
  return Interval{mean(values) - half, mean(values) + half};
}

using LogsByLevel = std::map<double, std::vector<double>>;

StevensLine line_of(std::size_t participant, const LogsByLevel& logs) {
  StevensLine line;
  line.participant = participant;
  line.levels = logs.size();
  double mean_x = 0, mean_y = 0, xx = 0, xy = 0, yy = 0;
  const auto n = static_cast<double>(logs.size());
  for (const auto& [level, values] : logs) {
    line.trials += values.size();
    mean_x += std::log10(level) / n;
    mean_y += mean(values) / n;
    line.points.push_back({level, std::pow(10, mean(values))});
  }
  if (logs.size() < 2) {
    line.undefined = "fewer than two levels";
    return line;
  }
  for (const auto& [level, values] : logs) {
    const double x = std::log10(level) - mean_x, y = mean(values) - mean_y;
    xx += x * x;
    xy += x * y;
    yy += y * y;
  }
  line.exponent = xy / xx;
  line.log10_scale = mean_y - *line.exponent * mean_x;
  if (yy > 0) line.r_squared = xy * xy / (xx * yy);
  if (logs.size() > 2)
    line.exponent_se = std::sqrt(std::max(0.0, yy - xy * xy / xx) / (n - 2) / xx);
  return line;
}

using CountTable = std::vector<std::vector<std::size_t>>;

struct Margins {
  std::vector<double> rows, columns;
  double total = 0;
  std::size_t cells = 0;  // with trials
};

Margins margins_of(const CountTable& counts) {
  Margins sums;
  for (const auto& row : counts) {
    double trials = 0;
    if (row.size() > sums.columns.size()) sums.columns.resize(row.size(), 0);
    for (std::size_t answer = 0; answer < row.size(); ++answer) {
      const auto n = static_cast<double>(row[answer]);
      trials += n;
      sums.columns[answer] += n;
      sums.cells += row[answer] > 0 ? 1 : 0;
    }
    sums.rows.push_back(trials);
    sums.total += trials;
  }
  return sums;
}

/// n log2 n
double nlogn(double n) { return n > 0 ? n * std::log2(n) : 0; }

double sum_nlogn(const std::vector<double>& counts) {
  double sum = 0;
  for (const double n : counts) sum += nlogn(n);
  return sum;
}

/// T of N trials: (sum n log n - sum rows - sum columns + N log N) / N.
double transfer(double cells, double rows, double columns, double total) {
  return (cells - rows - columns + nlogn(total)) / total;
}

std::size_t filled(const std::vector<double>& counts) {
  std::size_t number = 0;
  for (const double n : counts) number += n > 0 ? 1 : 0;
  return number;
}

/// Jackknife: every trial left out once; trials of a cell are alike.
double jackknife_error(const CountTable& counts, const Margins& sums, double cells, double rows,
                       double columns) {
  double mean_left = 0, squares = 0;
  for (std::size_t s = 0; s < counts.size(); ++s) {
    for (std::size_t a = 0; a < counts[s].size(); ++a) {
      if (counts[s][a] == 0) continue;
      const auto n = static_cast<double>(counts[s][a]);
      const double left = transfer(
          cells - nlogn(n) + nlogn(n - 1), rows - nlogn(sums.rows[s]) + nlogn(sums.rows[s] - 1),
          columns - nlogn(sums.columns[a]) + nlogn(sums.columns[a] - 1), sums.total - 1);
      mean_left += n * left / sums.total;
      squares += n * left * left;
    }
  }
  const double deviation = std::max(0.0, squares - sums.total * mean_left * mean_left);
  return std::sqrt((sums.total - 1) / sums.total * deviation);
}

/// A staircase moves one way after a success, if at all, and the other way after a failure; any
/// other track is not a staircase.
std::vector<std::size_t> reversals_of(const Track& track) {
  std::vector<std::size_t> turns;
  int after_success = 0, last = 0, alike = 0;
  // The smallest numbers of equal answers that moved it, failures and successes. 0: none yet.
  std::array<int, 2> moves_after{0, 0};
  for (std::size_t i = 1; i < track.levels.size(); ++i) {
    const bool success = track.successes[i - 1];
    const bool continues = i > 1 && alike > 0 && track.successes[i - 2] == success;
    alike = continues ? alike + 1 : 1;
    const double change = track.levels[i] - track.levels[i - 1];
    if (change == 0) continue;
    const int way = change > 0 ? 1 : -1;
    const int meaning = success ? way : -way;
    if (after_success == 0) after_success = meaning;
    if (meaning != after_success) return {};
    if (last != 0 && way != last) turns.push_back(i - 1);
    last = way;
    int& fewest = moves_after[success ? 1 : 0];
    if (fewest == 0 || alike < fewest) fewest = alike;
    alike = 0;
  }
  if (last == 0) return turns;
  // No level follows the last answer.
  const std::size_t end = track.levels.size() - 1;
  const bool success = track.successes[end];
  alike = alike > 0 && track.successes[end - 1] == success ? alike + 1 : 1;
  const int way = success ? after_success : -after_success;
  if (alike == moves_after[success ? 1 : 0] && way != last) turns.push_back(end);
  return turns;
}

/// The spec of a track; nullptr: the source has no protocol, or not its number.
const protocols::ProcedureSpec* spec_of(const Track& track, const StudyTrial& trial,
                                        const StudyTable& table, int& number) {
  const protocols::BlockProcedures* const block = block_of(trial, table);
  if (block == nullptr || block->specs.empty()) return nullptr;
  number = 0;
  std::from_chars(track.name.data(), track.name.data() + track.name.size(), number);
  return number < 1 ? nullptr : &block->spec_of(number);
}

/// Sets procedure and reversals of a track with a known spec.
void replay(Track& track, const StudyTrial& trial, const StudyTable& table,
            const protocols::ProcedureSpec& spec, int number) {
  if (std::holds_alternative<protocols::ConstantStimuli>(spec) ||
      std::holds_alternative<protocols::Asked>(spec))
    return;  // they estimate nothing
  const auto* const staircase = std::get_if<protocols::Staircase>(&spec);
  TrackProcedure result;
  result.spec = spec;
  protocols::Procedure procedure = block_of(trial, table)->begin(trial.participant_number, number);
  int reversals = 0;
  for (std::size_t i = 0; i < track.levels.size(); ++i) {
    procedure.record({track.levels[i], track.successes[i]});
    if (staircase == nullptr) continue;
    const int so_far = procedure.estimate().reversals;
    if (so_far > reversals) track.reversals.push_back(i);
    reversals = so_far;
  }
  result.estimate = procedure.estimate();
  if (staircase != nullptr) result.target = protocols::convergence_point(*staircase);
  track.procedure = std::move(result);
}

using protocols::LevelScale;
using Trials = std::vector<const StudyTrial*>;
using CellKey = std::tuple<std::string, std::string, std::string, std::string>;

struct Context {
  const FunctionSettings& settings;
  const StudyTable& table;
};

/// Groups in the order of their first trial.
template <class Key, class KeyOf>
std::vector<std::pair<Key, Trials>> grouped(const Trials& trials, KeyOf key_of) {
  std::vector<std::pair<Key, Trials>> groups;
  std::map<Key, std::size_t> places;
  for (const StudyTrial* trial : trials) {
    const auto [place, is_new] = places.emplace(key_of(*trial), groups.size());
    if (is_new) groups.push_back({place->first, {}});
    groups[place->second].second.push_back(trial);
  }
  return groups;
}

std::vector<std::pair<std::string, Trials>> by_participant(const Trials& trials) {
  return grouped<std::string>(trials, [](const StudyTrial& trial) { return trial.participant; });
}

std::vector<LevelCount> counts_of_levels(const Trials& trials) {
  std::vector<LevelCount> counts;
  for (const StudyTrial* trial : trials) {
    if (trial->answered && trial->level && !trial->catch_trial)
      counts.push_back({*trial->level, 1, trial->success ? 1 : 0});
  }
  return sum_by_level(std::move(counts));
}

/// Which levels have more successes: the sign of their covariance.
protocols::Easier easier_of(const std::vector<LevelCount>& counts) {
  double n = 0, x = 0, y = 0, xy = 0;
  for (const LevelCount& count : counts) {
    n += count.trials;
    x += count.trials * count.level;
    y += count.successes;
    xy += count.successes * count.level;
  }
  return n > 0 && xy / n < x / n * y / n ? protocols::Easier::lower : protocols::Easier::higher;
}

/// False alarms: successes in catch trials.
DetectionCounts detections_of(const Trials& trials) {
  DetectionCounts counts;
  for (const StudyTrial* trial : trials) {
    if (!trial->answered) continue;
    (trial->catch_trial ? counts.noise_trials : counts.signal_trials) += 1;
    if (trial->success) (trial->catch_trial ? counts.false_alarms : counts.hits) += 1;
  }
  return counts;
}

/// Catch trials determine the guess rate: they count as infinitely far on the hard side.
std::vector<LevelCount> with_catch_trials(std::vector<LevelCount> counts,
                                          const DetectionCounts& detections,
                                          const protocols::PsychometricFunction& function) {
  if (detections.noise_trials == 0) return counts;
  const double infinity = std::numeric_limits<double>::infinity();
  const double least = function.scale == LevelScale::linear ? -infinity : 0;
  counts.push_back({function.easier == protocols::Easier::higher ? least : infinity,
                    detections.noise_trials, detections.false_alarms});
  return counts;
}

/// Forced choice: the level half-way from guessing to certainty, for any function. For a Weibull
/// function it differs from the threshold; the slope is held over its interval.
LevelFigures distance_from_standard(const PsychometricFit& fit, const PsychometricModel& model,
                                    std::optional<double> standard) {
  LevelFigures figures;
  if (!standard) return figures;
  const auto half_way = [&](double threshold) {
    if (model.function.shape != protocols::PsychometricShape::weibull) return threshold;
    return psychometric_level(model.function, {threshold, fit.parameters.slope}, 0.5);
  };
  const double away = half_way(fit.parameters.threshold) - *standard;
  const Interval ends{half_way(fit.threshold_ci95.low), half_way(fit.threshold_ci95.high)};
  const Interval distance = away >= 0 ? Interval{ends.low - *standard, ends.high - *standard}
                                      : Interval{*standard - ends.high, *standard - ends.low};
  figures.jnd = std::abs(away);
  figures.jnd_ci95 = {std::max(0.0, distance.low), distance.high};
  if (!(*standard > 0)) return figures;
  figures.weber_fraction = *figures.jnd / *standard;
  figures.weber_fraction_ci95 = {figures.jnd_ci95->low / *standard,
                                 figures.jnd_ci95->high / *standard};
  return figures;
}

LevelFigures fitted_figures(const PsychometricFit& fit, const PsychometricModel& model,
                            const TaskCell& cell) {
  if (cell.task == "detect" || cell.same_different) return {};
  if (cell.forced_choice) return distance_from_standard(fit, model, cell.standard_level);
  const Discrimination found = discrimination(fit, model.function, cell.standard_level);
  return {found.pse,      found.jnd,      found.weber_fraction,
          found.pse_ci95, found.jnd_ci95, found.weber_fraction_ci95};
}

/// The procedures of a trial's block; empty: none, or the source has no protocol.
const std::vector<protocols::ProcedureSpec>& specs_of(const StudyTrial& trial,
                                                      const StudyTable& table) {
  static const std::vector<protocols::ProcedureSpec> kNone;
  const protocols::BlockProcedures* const block = block_of(trial, table);
  return block == nullptr ? kNone : block->specs;
}

/// The levels expected to be easier in a cell; none: unknown.
std::optional<protocols::Easier> expected_easier(const TaskCell& cell, const Trials& trials,
                                                 bool above, bool below, const Context& context) {
  using protocols::Easier;
  if (cell.task == "compare" && above != below) return above ? Easier::higher : Easier::lower;
  for (const StudyTrial* trial : trials) {
    for (const protocols::ProcedureSpec& spec : specs_of(*trial, context.table)) {
      if (const auto easier = protocols::easier_of(spec)) return easier;
    }
    const protocols::BlockProcedures* const block = block_of(*trial, context.table);
    if (cell.task == "compare" && !cell.same_different && block != nullptr)
      return block->asks_smaller ? Easier::lower : Easier::higher;
  }
  return std::nullopt;
}

/// The counts for the fit of a function, including catch trials.
std::vector<LevelCount> counts_to_fit(const ParticipantFunction& one,
                                      const DetectionCounts& detections, bool catches) {
  return catches ? with_catch_trials(one.counts, detections, one.model.function) : one.counts;
}

/// Sets the model's direction to the expected one, or to the other if that fits clearly better.
void set_direction(ParticipantFunction& one, const DetectionCounts& detections, bool catches,
                   protocols::Easier expected) {
  using protocols::Easier;
  one.model.function.easier = expected;
  if (easier_of(one.counts) == expected) return;
  const auto log_likelihood = [&] {
    const PsychometricFit fit = quick_fit(counts_to_fit(one, detections, catches), one.model);
    return fit.undefined.empty() ? fit.log_likelihood : 0;
  };
  const double as_expected = log_likelihood();
  one.model.function.easier = expected == Easier::higher ? Easier::lower : Easier::higher;
  one.reversed = log_likelihood() > as_expected + kHalfChiSquared95;
  if (!one.reversed) one.model.function.easier = expected;
}

/// Sets fitted_level of staircases. \param fit  of the same trials
void add_fitted_levels(std::vector<Track>& tracks, const PsychometricModel& model,
                       const PsychometricFit& fit) {
  const auto& [threshold, slope, guess, lapse] = fit.parameters;
  for (Track& track : tracks) {
    if (!track.procedure || !track.procedure->target) continue;
    const double share = (*track.procedure->target - guess) / (1 - guess - lapse);
    if (share > 0 && share < 1)
      track.procedure->fitted_level = psychometric_level(model.function, fit.parameters, share);
  }
}

ParticipantFunction function_of(const std::string& participant, const Trials& trials,
                                const TaskCell& cell, protocols::Easier expected,
                                const Context& context) {
  ParticipantFunction result;
  result.participant = participant;
  result.tracks = tracks_of(trials, context.table);
  const bool catches = cell.task == "detect" || cell.same_different;
  const DetectionCounts detections = detections_of(trials);
  if (catches) result.catches = detections;
  const DetectionTask asked =
      cell.same_different ? DetectionTask::same_different : DetectionTask::yes_no;
  if (catches) result.detectability = detectability(detections, asked);
  if (!catches) result.detectability.undefined = "nothing is detected";
  result.counts = counts_of_levels(trials);
  result.fit.undefined = cell.no_function;
  result.posterior.undefined = cell.no_function;
  if (!cell.no_function.empty()) return result;
  result.model.function = {context.settings.shape, cell.scale, expected};
  if (cell.forced_choice) result.model.guess.value = 1.0 / cell.intervals;
  if (catches) result.model.guess = {0, true, 0.5};
  result.model.lapse = {0, true, kMostLapse};
  result.model.guess_is_lapse = !catches && !cell.forced_choice;
  set_direction(result, detections, catches, expected);
  const std::vector<LevelCount> counts = counts_to_fit(result, detections, catches);
  result.fit = fit_psychometric(counts, result.model);
  result.posterior = psychometric_posterior(counts, result.model);
  if (result.fit.undefined.empty()) {
    result.goodness = goodness_of_fit(counts, result.model, result.fit,
                                      context.settings.simulations, context.settings.seed);
    result.figures = fitted_figures(result.fit, result.model, cell);
    add_fitted_levels(result.tracks, result.model, result.fit);
    const double threshold = result.fit.parameters.threshold;
    const Interval& ends = result.fit.threshold_ci95;
    result.determined = !result.reversed && threshold >= result.counts.front().level &&
                        threshold <= result.counts.back().level && std::isfinite(ends.low) &&
                        std::isfinite(ends.high) &&
                        (ends.low > 0 || result.counts.front().level <= 0);
  }
  return result;
}

/// At least three levels above 0 with equal ratios.
bool equal_ratios(const std::vector<LevelCount>& counts) {
  constexpr double kRounded = 1e-3;  // of a step: levels are written with few digits
  if (counts.size() < 3 || counts.front().level <= 0) return false;
  const auto step = [&](std::size_t i) { return std::log(counts[i].level / counts[i - 1].level); };
  for (std::size_t i = 2; i < counts.size(); ++i) {
    if (std::abs(step(i) - step(1)) > kRounded * step(1)) return false;
  }
  return true;
}

/// Scale of the functions of a cell's trials.
LevelScale scale_of(const Trials& trials, const Context& context) {
  if (context.settings.scale) return *context.settings.scale;
  if (context.settings.shape == protocols::PsychometricShape::weibull) return LevelScale::log10;
  bool adaptive = false;
  for (const StudyTrial* trial : trials) {
    for (const protocols::ProcedureSpec& spec : specs_of(*trial, context.table)) {
      const std::optional<LevelScale> scale = protocols::scale_of(spec);
      if (scale == LevelScale::linear) return LevelScale::linear;
      adaptive |= scale.has_value();
    }
  }
  return adaptive || equal_ratios(counts_of_levels(trials)) ? LevelScale::log10
                                                            : LevelScale::linear;
}

void add_functions(TaskCell& cell, const Trials& trials, const Context& context) {
  bool above = false, below = false;
  for (const StudyTrial* trial : trials) {
    if (trial->standard_level) cell.standard_level = trial->standard_level;
    if (trial->intervals > 0) cell.intervals = trial->intervals;
    cell.same_different |= trial->response == "same" || trial->response == "different";
    if (!trial->level || !trial->standard_level || trial->catch_trial) continue;
    above |= *trial->level > *trial->standard_level;
    below |= *trial->level < *trial->standard_level;
  }
  const bool compares = cell.task == "compare";
  cell.forced_choice = compares && above != below && !cell.same_different;
  if (compares && above && below && (cell.same_different || cell.intervals > 2))
    cell.no_function =
        "levels lie on both sides of the standard: successes are not a monotonic function of them";
  cell.scale = scale_of(trials, context);
  if (cell.no_function.empty() && cell.scale != LevelScale::linear &&
      std::any_of(trials.begin(), trials.end(),
                  [](const StudyTrial* trial) { return trial->level && *trial->level < 0; }))
    cell.no_function = "levels below 0 have no place on a logarithmic scale";
  cell.expected_easier = expected_easier(cell, trials, above, below, context);
  const protocols::Easier usual =
      cell.expected_easier.value_or(easier_of(counts_of_levels(trials)));
  for (const auto& [participant, own] : by_participant(trials))
    cell.functions.push_back(function_of(participant, own, cell, usual, context));
}

/// The labelled steps of a cell's ratings, from the protocol or, without one, from labels that are
/// the answers; empty: numbers were typed, or nothing says.
std::vector<RatingStep> rating_steps(const Trials& trials, const StudyTable& table) {
  std::vector<RatingStep> steps;
  if (const auto* block = block_of(*trials.front(), table)) {
    for (const auto& step : block->rating_steps) steps.push_back({step.number, step.label, 0, 0});
    return steps;
  }
  std::map<double, std::string> labels;
  for (const StudyTrial* trial : trials) {
    if (!trial->answered || !trial->number) continue;
    const bool label = trial->response.find_first_not_of("0123456789.,+-eE ") != std::string::npos;
    std::string& known = labels[*trial->number];
    if (label) known = trial->response;
  }
  const bool labelled =
      std::ranges::any_of(labels, [](const auto& l) { return !l.second.empty(); });
  for (const auto& [number, label] : labels) {
    if (labelled) steps.push_back({number, label, 0, 0});
  }
  return steps;
}

/// \return false: numbers of any size were given to levels, so magnitude estimation describes them
bool add_ratings(TaskCell& cell, const Trials& trials, const StudyTable& table) {
  std::vector<RatingStep> steps = rating_steps(trials, table);
  const bool levels =
      std::ranges::any_of(trials, [](const StudyTrial* trial) { return trial->level.has_value(); });
  if (steps.empty() && levels) return false;
  std::vector<Rating> ratings;
  std::size_t number = 0;
  for (const auto& [participant, own] : by_participant(trials)) {
    for (const StudyTrial* trial : own) {
      if (trial->answered && trial->number)
        ratings.push_back({number, *trial->number, trial->level});
    }
    ++number;
  }
  cell.ratings = ratings_of(ratings, std::move(steps));
  return true;
}

void add_magnitude(TaskCell& cell, const Trials& trials) {
  std::vector<MagnitudeTrial> judged;
  std::size_t number = 0;
  for (const auto& [participant, own] : by_participant(trials)) {
    for (const StudyTrial* trial : own) {
      if (trial->answered && trial->level && trial->number)
        judged.push_back({number, *trial->level, *trial->number});
    }
    ++number;
  }
  cell.magnitude = magnitude_estimation(judged, false);
}

void add_adjustments(TaskCell& cell, const Trials& trials) {
  std::vector<AdjustmentTrial> settings;
  std::size_t number = 0;
  for (const auto& [participant, own] : by_participant(trials)) {
    for (const StudyTrial* trial : own) {
      if (trial->answered && trial->level && trial->number && trial->standard_level)
        settings.push_back({number, *trial->standard_level, *trial->number,
                            *trial->level > *trial->standard_level});
    }
    ++number;
  }
  cell.adjustments = adjustments(settings);
}

std::optional<double> mean_of(const std::vector<double>& values) {
  return values.empty() ? std::nullopt : std::optional(mean(values));
}

std::optional<double> mean_of(const std::vector<ReachPoint>& points) {
  std::vector<double> values;
  values.reserve(points.size());
  for (const ReachPoint& one : points) values.push_back(one.value);
  return mean_of(values);
}

Reaches reaches_of(std::size_t participant, Trials trials) {
  std::ranges::stable_sort(trials, {}, [](const StudyTrial* one) {
    return std::tuple(one->session, one->block, one->trial);
  });
  Reaches out;
  out.participant = participant;
  std::vector<double> durations, ratios, errors;
  double before = 0;
  for (const StudyTrial* trial : trials) {
    const double place = before++;
    if (!trial->answered || !trial->reach) continue;
    ++out.trials;
    out.in_time += trial->success ? 1 : 0;
    const data::ReachRecord& reach = *trial->reach;
    if (reach.kind == "clamp" && reach.adaptation)
      out.adaptations.push_back({place, *reach.adaptation});
    if (reach.kind == "catch" && reach.deviation) out.catches.push_back({place, *reach.deviation});
    if (reach.kind != "field") continue;
    if (reach.deviation) out.deviations.push_back({place, *reach.deviation});
    if (reach.duration) durations.push_back(*reach.duration);
    if (reach.path_ratio) ratios.push_back(*reach.path_ratio);
    if (reach.endpoint_error) errors.push_back(*reach.endpoint_error);
  }
  std::vector<const StudyTrial*> drawn;
  for (const StudyTrial* trial : trials) {
    if (trial->answered && trial->reach && trial->reach->kind == "field" && trial->path.size() > 1)
      drawn.push_back(trial);
  }
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    if (i < kDrawnPaths) out.first_paths.push_back(drawn[i]->path);
    if (i >= kDrawnPaths && i + kDrawnPaths >= drawn.size())
      out.last_paths.push_back(drawn[i]->path);
  }
  out.deviation = mean_of(out.deviations);
  out.catch_deviation = mean_of(out.catches);
  out.adaptation = mean_of(out.adaptations);
  out.duration = mean_of(durations);
  out.path_ratio = mean_of(ratios);
  out.endpoint_error = mean_of(errors);
  out.learning = fit_learning(out.deviations);
  return out;
}

void add_reaches(TaskCell& cell, const Trials& trials) {
  for (const auto& [participant, own] : by_participant(trials))
    cell.reaches.push_back(reaches_of(cell.reaches.size(), own));
}

InformationTransfer transfer_of(const Trials& trials) {
  std::map<std::string, std::size_t> stimuli, answers;
  for (const StudyTrial* trial : trials) {
    if (!trial->answered) continue;
    stimuli.emplace(base_name(trial->shape), stimuli.size());
    answers.emplace(trial->response, answers.size());
  }
  std::vector<std::vector<std::size_t>> counts(stimuli.size(),
                                               std::vector<std::size_t>(answers.size(), 0));
  for (const StudyTrial* trial : trials) {
    if (trial->answered) ++counts[stimuli[base_name(trial->shape)]][answers[trial->response]];
  }
  return information_transfer(counts);
}

/// Miller's bias, and the mapping of stimuli to answers, apply to each participant.
void add_information(TaskCell& cell, const Trials& trials) {
  cell.information = transfer_of(trials);
  std::vector<double> bits;
  for (const auto& [participant, own] : by_participant(trials)) {
    cell.informations.push_back(transfer_of(own));
    if (cell.informations.back().corrected) bits.push_back(*cell.informations.back().corrected);
  }
  std::set<std::string> stimuli, answers;
  for (const StudyTrial* trial : trials) {
    if (!trial->answered) continue;
    stimuli.insert(base_name(trial->shape));
    answers.insert(trial->response);
  }
  const std::size_t fewest = std::min(stimuli.size(), answers.size());
  if (fewest < 2) return;
  cell.information_most = std::log2(static_cast<double>(fewest));
  cell.information_mean = mean_information(bits, cell.information_most);
}

std::vector<ConfidenceTrial> confident_answers(const Trials& trials) {
  std::vector<ConfidenceTrial> sure;
  for (const StudyTrial* trial : trials) {
    if (trial->answered && trial->confidence && trial->correct)
      sure.push_back({*trial->correct, *trial->confidence});
  }
  return sure;
}

void add_confidence(TaskCell& cell, const Trials& trials) {
  const std::vector<ConfidenceTrial> all = confident_answers(trials);
  cell.confidence = type2_roc(all);
  if (all.empty()) {
    cell.confidence.undefined = "nobody was asked";
    return;
  }
  std::vector<Type2Roc> curves;
  for (const auto& [participant, own] : by_participant(trials)) {
    const std::vector<ConfidenceTrial> answers = confident_answers(own);
    if (!answers.empty()) curves.push_back(type2_roc(answers));
  }
  cell.confidence_mean = mean_type2_area(curves);
}

TaskCell cell_of(const CellKey& key, const Trials& trials, const Context& context) {
  TaskCell cell;
  std::tie(cell.task, cell.block_name, cell.shape, cell.renderer) = key;
  cell.trials = trials.size();
  for (const StudyTrial* trial : trials) {
    cell.answered += trial->answered ? 1 : 0;
    cell.judged += trial->correct ? 1 : 0;
    cell.correct += trial->correct.value_or(false) ? 1 : 0;
  }
  for (const auto& [participant, own] : by_participant(trials))
    cell.participants.push_back(participant);
  if (const auto* known = block_of(*trials.front(), context.table)) {
    if (known->level_unit != "1") cell.level_unit = known->level_unit;
  }
  const auto* const block = block_of(*trials.front(), context.table);
  const bool several = block != nullptr && !block->dimensions.empty();
  if (several && cell.task != "rate") cell.field = analyze_field(trials, *block);
  if (!several && (cell.task == "compare" || cell.task == "detect"))
    add_functions(cell, trials, context);
  if (cell.task == "rate" && !add_ratings(cell, trials, context.table)) add_magnitude(cell, trials);
  if (cell.task == "adjust") add_adjustments(cell, trials);
  if (cell.task == "reach") add_reaches(cell, trials);
  if (cell.task == "identify") add_information(cell, trials);
  add_confidence(cell, trials);
  return cell;
}

}  // namespace

MagnitudeEstimation magnitude_estimation(const std::vector<MagnitudeTrial>& trials, bool modulus) {
  MagnitudeEstimation result;
  std::map<std::size_t, LogsByLevel> by_participant;
  for (const MagnitudeTrial& trial : trials) {
    if (trial.level > 0 && trial.magnitude > 0) {
      by_participant[trial.participant][trial.level].push_back(std::log10(trial.magnitude));
    } else {
      ++result.without_logarithm;
    }
  }
  std::vector<double> exponents, centres;
  for (const auto& [participant, logs] : by_participant) {
    result.lines.push_back(line_of(participant, logs));
    if (result.lines.back().exponent) exponents.push_back(*result.lines.back().exponent);
    std::vector<double> means;
    for (const auto& [level, values] : logs) means.push_back(mean(values));
    centres.push_back(mean(means));
  }
  if (!exponents.empty()) result.exponent = mean(exponents);
  result.exponent_ci95 = mean_interval(exponents);

  std::map<double, std::vector<double>> by_level;
  std::size_t i = 0;
  for (const auto& [participant, logs] : by_participant) {
    const double shift = modulus ? 0 : mean(centres) - centres[i];
    ++i;
    for (const auto& [level, values] : logs) by_level[level].push_back(mean(values) + shift);
  }
  for (const auto& [level, values] : by_level) {
    MagnitudeMean one{level, std::pow(10, mean(values)), std::nullopt, values.size()};
    if (const auto ends = mean_interval(values))
      one.ci95 = Interval{std::pow(10, ends->low), std::pow(10, ends->high)};
    result.means.push_back(one);
  }
  return result;
}

std::vector<Adjustment> adjustments(const std::vector<AdjustmentTrial>& trials) {
  std::map<std::size_t, std::vector<AdjustmentTrial>> by_participant;
  for (const AdjustmentTrial& trial : trials) by_participant[trial.participant].push_back(trial);
  std::vector<Adjustment> results;
  for (const auto& [participant, own] : by_participant) {
    std::vector<double> all, above, below;
    for (const AdjustmentTrial& trial : own) {
      all.push_back(trial.setting);
      (trial.from_above ? above : below).push_back(trial.setting);
    }
    Adjustment result;
    result.participant = participant;
    result.settings = all.size();
    result.pse = mean(all);
    result.pse_ci95 = mean_interval(all);
    const bool all_above_zero = std::all_of(own.begin(), own.end(), [](const auto& trial) {
      return trial.setting > 0 && trial.standard > 0;
    });
    if (result.pse_ci95 && all_above_zero)
      result.pse_ci95->low = std::max(0.0, result.pse_ci95->low);
    result.constant_error = result.pse - own.front().standard;
    if (!above.empty() && !below.empty()) result.start_effect = mean(above) - mean(below);
    double squares = 0, df = 0;
    for (const auto* group : {&above, &below}) {
      if (group->empty()) continue;
      for (const double setting : *group) squares += std::pow(setting - mean(*group), 2);
      df += static_cast<double>(group->size()) - 1;
    }
    if (df > 0) {
      result.sd = std::sqrt(squares / df);
      result.jnd = kNormal75 * *result.sd;
    }
    results.push_back(result);
  }
  return results;
}

InformationTransfer information_transfer(const CountTable& counts) {
  InformationTransfer result;
  const Margins sums = margins_of(counts);
  result.trials = static_cast<std::size_t>(sums.total);
  if (sums.total == 0) {
    result.undefined = "no answers";
    return result;
  }
  double cells = 0;
  for (const auto& row : counts) {
    for (const std::size_t n : row) cells += nlogn(static_cast<double>(n));
  }
  const double rows = sum_nlogn(sums.rows), columns = sum_nlogn(sums.columns);
  result.stimulus_entropy = (nlogn(sums.total) - rows) / sums.total;
  result.plain = std::max(0.0, transfer(cells, rows, columns, sums.total));
  const double extra = static_cast<double>(sums.cells) - static_cast<double>(filled(sums.rows)) -
                       static_cast<double>(filled(sums.columns)) + 1;
  // With few errors few cells beyond the diagonal are filled and `extra` is below 0, but counts of
  // a sample never transmit too little on average.
  result.corrected = *result.plain - std::max(0.0, extra) / (2 * sums.total * std::log(2.0));
  result.categories = std::exp2(std::max(0.0, *result.corrected));
  if (sums.total > 1) result.se = jackknife_error(counts, sums, cells, rows, columns);
  return result;
}

std::vector<Track> tracks_of(const std::vector<const StudyTrial*>& trials,
                             const StudyTable& table) {
  std::map<std::string, std::vector<const StudyTrial*>> named;
  for (const StudyTrial* trial : trials) {
    if (trial->level && !trial->catch_trial && trial->answered)
      named[trial->track].push_back(trial);
  }
  std::vector<Track> tracks;
  for (const auto& [name, own] : named) {
    if (own.size() < 2) continue;
    Track track;
    track.name = name;
    for (const StudyTrial* trial : own) {
      track.levels.push_back(*trial->level);
      track.successes.push_back(trial->success);
    }
    int number = 0;
    if (const auto* spec = spec_of(track, *own.front(), table, number)) {
      replay(track, *own.front(), table, *spec, number);
    } else {
      track.reversals = reversals_of(track);
    }
    tracks.push_back(std::move(track));
  }
  std::sort(tracks.begin(), tracks.end(), [](const Track& a, const Track& b) {
    return std::pair(a.name.size(), a.name) < std::pair(b.name.size(), b.name);  // as numbers
  });
  return tracks;
}

StudyAnalysis analyze_study(StudyTable table, const FunctionSettings& functions,
                            const AnalysisSettings& settings, const std::string& program_version) {
  StudyAnalysis result;
  result.program_version = program_version;
  result.table = std::move(table);
  result.functions = functions;
  const Context context{functions, result.table};
  Trials all;
  for (const StudyTrial& trial : result.table.trials) all.push_back(&trial);
  const auto key_of = [](const StudyTrial& trial) {
    // Identification takes all stimuli of a block together.
    return CellKey{trial.task, trial.block_name, trial.task == "identify" ? "" : trial.shape,
                   trial.renderer};
  };
  for (const auto& [key, trials] : grouped<CellKey>(all, key_of))
    result.cells.push_back(cell_of(key, trials, context));
  result.groups = group_results(result.cells);
  result.renderers = compare_renderers(result.cells);
  result.conditions = compare_conditions(result.cells);
  result.group_models = group_models(result.cells, result.renderers);
  name_left_out(result.cells, result.groups, result.group_models);
  put_model_values(result.group_models.models, result.groups);
  identify_times(result.table);
  if (auto times = std::exchange(result.table.times, std::nullopt))
    result.identification = analyze(std::move(*times), settings, program_version);
  result.by_design = measures_by_design(result);
  if (functions.answer_model) result.answer_models = answer_models(result, *functions.answer_model);
  return result;
}

}  // namespace palpate::analysis
