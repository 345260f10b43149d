#include "protocols/procedures/procedure.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "data/base/random.h"
#include "protocols/procedures/portable_math.h"
#include "protocols/procedures/procedure_spec.h"

namespace palpate::protocols {

ConstantStimuliRun::ConstantStimuliRun(const ConstantStimuli& spec, std::uint64_t seed) {
  Random random(seed, {0xc0});
  for (int round = 0; round < spec.repetitions; ++round) {
    std::vector<double> levels = spec.levels;
    random.shuffle(levels);
    order_.insert(order_.end(), levels.begin(), levels.end());
    if (spec.points.empty()) continue;
    std::vector<LevelPoint> points = spec.points;
    random.shuffle(points);
    points_.insert(points_.end(), points.begin(), points.end());
  }
}

std::optional<LevelPoint> ConstantStimuliRun::next_point() const {
  if (trials_ >= points_.size()) return std::nullopt;
  return points_[trials_];
}

std::optional<double> ConstantStimuliRun::next_level() const {
  if (trials_ >= order_.size()) return std::nullopt;
  return order_[trials_];
}

void ConstantStimuliRun::record(const Response& /*response*/) { ++trials_; }

Estimate ConstantStimuliRun::estimate() const {
  Estimate result;
  result.trials = static_cast<int>(trials_);
  return result;
}

std::vector<double> series_levels(const Limits& spec, bool ascending, int inside) {
  const double low = scale_position(spec.scale, spec.low);
  const double high = scale_position(spec.scale, spec.high);
  const double tolerance = 1e-9 * spec.step;  // 0.1 three times is not 0.3
  std::vector<double> levels;
  for (int i = inside;; ++i) {
    const double position = ascending ? low + i * spec.step : high - i * spec.step;
    if (position > high + tolerance || position < low - tolerance) return levels;
    levels.push_back(level_at(spec.scale, position));
  }
}

LimitsRun::LimitsRun(const Limits& spec, std::uint64_t seed) : spec_(spec) {
  Random random(seed, {0x71});
  for (int i = 0; i < spec.series; ++i) {
    const bool ascending = spec.ascending_first == (i % 2 == 0);
    const auto choices = static_cast<std::uint64_t>(spec.jitter_steps) + 1;
    const int inside = static_cast<int>(random.below(choices));
    series_.push_back({ascending, series_levels(spec, ascending, inside)});
  }
}

std::optional<double> LimitsRun::next_level() const {
  if (current_ >= series_.size()) return std::nullopt;
  return series_[current_].levels[place_];
}

void LimitsRun::record(const Response& response) {
  if (current_ >= series_.size()) return;
  ++trials_;
  const Series& series = series_[current_];
  const bool success_at_start = series.ascending == (spec_.easier == Easier::lower);
  ++place_;
  if (response.success != success_at_start) {
    const double half = series.ascending ? -0.5 * spec_.step : 0.5 * spec_.step;
    changes_.push_back(scale_position(spec_.scale, response.level) + half);
  } else if (place_ < series.levels.size()) {
    return;
  } else {
    ++unchanged_;
  }
  ++current_;
  place_ = 0;
}

Estimate LimitsRun::estimate() const {
  Estimate result;
  result.trials = trials_;
  result.at_limit = unchanged_;
  if (changes_.empty()) return result;
  double sum = 0;
  for (const double change : changes_) sum += change;
  result.threshold = level_at(spec_.scale, sum / static_cast<double>(changes_.size()));
  return result;
}

StaircaseRun::StaircaseRun(Staircase spec)
    : spec_(std::move(spec)),
      position_(scale_position(spec_.scale, spec_.start)),
      low_(scale_position(spec_.scale, spec_.min)),
      high_(scale_position(spec_.scale, spec_.max)) {}

std::optional<double> StaircaseRun::next_level() const {
  const int reversals = static_cast<int>(reversals_.size());
  if (trials_ >= spec_.stop_trials ||
      (spec_.stop_reversals.has_value() && reversals >= *spec_.stop_reversals)) {
    return std::nullopt;
  }
  // Return the ends as written: their places on the scale are rounded.
  if (position_ <= low_) return spec_.min;
  if (position_ >= high_) return spec_.max;
  return level_at(spec_.scale, position_);
}

void StaircaseRun::record(const Response& response) {
  if (const auto asked = next_level(); !asked || *asked != response.level)
    position_ = std::clamp(scale_position(spec_.scale, response.level), low_, high_);
  if (position_ <= low_ || position_ >= high_) ++at_limit_;
  ++trials_;
  successes_ = response.success ? successes_ + 1 : 0;
  failures_ = response.success ? 0 : failures_ + 1;
  if (successes_ >= spec_.down) move(true);
  if (failures_ >= spec_.up) move(false);
}

void StaircaseRun::move(bool harder) {
  successes_ = failures_ = 0;
  const int direction = harder ? 1 : -1;
  if (direction_ == -direction) reversals_.push_back(position_);
  direction_ = direction;
  const std::size_t size = std::min(reversals_.size(), spec_.steps.size() - 1);
  const double step = spec_.steps[size] * (harder ? 1 : spec_.step_ratio);
  const bool upwards = harder == (spec_.easier == Easier::lower);
  position_ = std::clamp(position_ + (upwards ? step : -step), low_, high_);
}

std::vector<double> StaircaseRun::reversal_levels() const {
  std::vector<double> levels;
  levels.reserve(reversals_.size());
  for (const double position : reversals_) levels.push_back(level_at(spec_.scale, position));
  return levels;
}

Estimate StaircaseRun::estimate() const {
  Estimate result;
  result.trials = trials_;
  result.reversals = static_cast<int>(reversals_.size());
  result.at_limit = at_limit_;
  auto first = static_cast<std::size_t>(spec_.discard_reversals);
  if (first < reversals_.size() && (reversals_.size() - first) % 2 == 1) ++first;
  if (first >= reversals_.size()) return result;
  double sum = 0;
  for (std::size_t i = first; i < reversals_.size(); ++i) sum += reversals_[i];
  result.threshold = level_at(spec_.scale, sum / static_cast<double>(reversals_.size() - first));
  return result;
}

AskedRun::AskedRun(const Asked& spec, std::uint64_t seed)
    : spec_(spec), start_(Random(seed, {0xa5}).unit()) {}

std::optional<double> AskedRun::next_level() const {
  if (trials_ >= spec_.stop_trials) return std::nullopt;
  double share = start_, digit = 0.5;
  for (int n = trials_; n > 0; n /= 2, digit /= 2) share += n % 2 == 1 ? digit : 0;
  if (share >= 1) share -= 1;
  const double low = scale_position(spec_.scale, spec_.min);
  const double high = scale_position(spec_.scale, spec_.max);
  return std::clamp(level_at(spec_.scale, low + share * (high - low)), spec_.min, spec_.max);
}

void AskedRun::record(const Response& /*response*/) { ++trials_; }

Estimate AskedRun::estimate() const {
  Estimate result;
  result.trials = trials_;
  return result;
}

/// Tables that are constant over the trials.
struct QuestPlusTables {
  QuestPlus spec;
  /// F at each level: [level][threshold, slope].
  std::vector<double> core;
  /// Entropy of an answer, nat: [level][threshold, slope, guess, lapse].
  std::vector<double> noise;

  std::size_t cores() const { return spec.threshold.values.size() * spec.slope.values.size(); }
  std::size_t rates() const { return spec.guess.values.size() * spec.lapse.values.size(); }
  std::size_t size() const { return cores() * rates(); }
};

namespace {

std::vector<double> cores_at(const QuestPlus& spec, double level) {
  std::vector<double> core;
  core.reserve(spec.threshold.values.size() * spec.slope.values.size());
  for (const double threshold : spec.threshold.values) {
    for (const double slope : spec.slope.values)
      core.push_back(psychometric_core(spec.function, level, threshold, slope));
  }
  return core;
}

/// Calls visit(guess, 1 - guess - lapse) for each pair in the order of the posterior.
template <class Visit>
void for_each_rate(const QuestPlus& spec, Visit visit) {
  for (const double guess : spec.guess.values) {
    for (const double lapse : spec.lapse.values) visit(guess, 1 - guess - lapse);
  }
}

std::shared_ptr<const QuestPlusTables> tables_of(const QuestPlus& spec) {
  auto tables = std::make_shared<QuestPlusTables>();
  tables->spec = spec;
  tables->noise.reserve(spec.levels.size() * tables->size());
  for (const double level : spec.levels) {
    for (const double core : cores_at(spec, level)) {
      tables->core.push_back(core);
      for_each_rate(spec, [&](double guess, double range) {
        tables->noise.push_back(answer_entropy(guess + range * core));
      });
    }
  }
  return tables;
}

std::vector<double> weights_of(const ParameterGrid& grid) {
  return grid.weights.empty() ? std::vector<double>(grid.values.size(), 1) : grid.weights;
}

void normalize(std::vector<double>& weights) {
  double sum = 0;
  for (const double weight : weights) sum += weight;
  for (double& weight : weights) weight /= sum;
}

/// In four sums, in a fixed order: fast, and the same everywhere.
double dot(const double* a, const double* b, std::size_t n) {
  double s0 = 0, s1 = 0, s2 = 0, s3 = 0;
  std::size_t i = 0;
  for (; i + 4 <= n; i += 4) {
    s0 += a[i] * b[i];
    s1 += a[i + 1] * b[i + 1];
    s2 += a[i + 2] * b[i + 2];
    s3 += a[i + 3] * b[i + 3];
  }
  for (; i < n; ++i) s0 += a[i] * b[i];
  return (s0 + s1) + (s2 + s3);
}

double mean_of(const std::vector<double>& weights, const std::vector<double>& values) {
  return dot(weights.data(), values.data(), values.size());
}

}  // namespace

QuestPlusRun::QuestPlusRun(const QuestPlus& spec) : tables_(tables_of(spec)) {
  posterior_.reserve(tables_->size());
  for (const double t : weights_of(spec.threshold)) {
    for (const double s : weights_of(spec.slope)) {
      for (const double g : weights_of(spec.guess)) {
        for (const double l : weights_of(spec.lapse)) posterior_.push_back(t * s * g * l);
      }
    }
  }
  normalize(posterior_);
}

std::vector<double> QuestPlusRun::expected_information() const {
  const std::size_t rates = tables_->rates(), cores = tables_->cores();
  // p = guess + range * core: summed over guess and lapse once, not at every level.
  double guesses = 0;
  std::vector<double> ranges(cores, 0);
  for (std::size_t c = 0; c < cores; ++c) {
    std::size_t i = c * rates;
    for_each_rate(tables_->spec, [&](double guess, double range) {
      guesses += posterior_[i] * guess;
      ranges[c] += posterior_[i] * range;
      ++i;
    });
  }
  std::vector<double> information;
  for (std::size_t x = 0; x < tables_->spec.levels.size(); ++x) {
    const double p = guesses + dot(ranges.data(), &tables_->core[x * cores], cores);
    const double noise =
        dot(posterior_.data(), &tables_->noise[x * posterior_.size()], posterior_.size());
    information.push_back((answer_entropy(std::clamp(p, 0.0, 1.0)) - noise) / kLn2);
  }
  return information;
}

double QuestPlusRun::entropy_bits() const {
  double sum = 0;
  for (const double p : posterior_) sum -= portable_plogp(p);
  return sum / kLn2;
}

std::optional<double> QuestPlusRun::next_level() const {
  const QuestPlus& spec = tables_->spec;
  if (trials_ >= spec.stop_trials) return std::nullopt;
  if (spec.stop_entropy_bits.has_value() && entropy_bits() <= *spec.stop_entropy_bits)
    return std::nullopt;
  const std::vector<double> information = expected_information();
  const double best = *std::max_element(information.begin(), information.end());
  std::size_t chosen = 0;
  while (information[chosen] < best - kTieBits) ++chosen;
  return spec.levels[chosen];
}

void QuestPlusRun::record(const Response& response) {
  const QuestPlus& spec = tables_->spec;
  const auto place = std::find(spec.levels.begin(), spec.levels.end(), response.level);
  const auto x = static_cast<std::size_t>(place - spec.levels.begin());
  const std::vector<double> beside =
      place == spec.levels.end() ? cores_at(spec, response.level) : std::vector<double>();
  const double* const core = beside.empty() ? &tables_->core[x * tables_->cores()] : beside.data();
  std::vector<double> updated = posterior_;
  std::size_t i = 0;
  double sum = 0;
  for (std::size_t c = 0; c < tables_->cores(); ++c) {
    for_each_rate(spec, [&](double guess, double range) {
      const double p = guess + range * core[c];
      updated[i] *= response.success ? p : 1 - p;
      sum += updated[i++];
    });
  }
  ++trials_;
  // An answer that is impossible for all parameters of the grid is ignored.
  if (!(sum > 0)) return;
  for (double& weight : updated) weight /= sum;
  posterior_ = std::move(updated);
}

std::vector<double> QuestPlusRun::marginal(std::size_t parameter) const {
  const QuestPlus& spec = tables_->spec;
  const std::array<std::size_t, 4> sizes{spec.threshold.values.size(), spec.slope.values.size(),
                                         spec.guess.values.size(), spec.lapse.values.size()};
  std::size_t inner = 1;
  for (std::size_t k = parameter + 1; k < sizes.size(); ++k) inner *= sizes[k];
  std::vector<double> sums(sizes[parameter], 0);
  for (std::size_t i = 0; i < posterior_.size(); ++i)
    sums[i / inner % sizes[parameter]] += posterior_[i];
  return sums;
}

Estimate QuestPlusRun::estimate() const {
  const QuestPlus& spec = tables_->spec;
  Estimate result;
  result.trials = trials_;
  const std::vector<double> weights = marginal(0);
  std::vector<double> places;
  for (const double threshold : spec.threshold.values)
    places.push_back(scale_position(spec.function.scale, threshold));
  const double mean = mean_of(weights, places);
  double variance = 0;
  for (std::size_t i = 0; i < places.size(); ++i)
    variance += weights[i] * (places[i] - mean) * (places[i] - mean);
  result.threshold = level_at(spec.function.scale, mean);
  result.threshold_scale_sd = std::sqrt(variance);
  result.slope = mean_of(marginal(1), spec.slope.values);
  result.guess = mean_of(marginal(2), spec.guess.values);
  result.lapse = mean_of(marginal(3), spec.lapse.values);
  return result;
}

namespace {

using Run = std::variant<ConstantStimuliRun, StaircaseRun, QuestPlusRun, LimitsRun, AskedRun,
                         SobolRun, FieldQuestPlusRun>;

Run begin_run(const ProcedureSpec& spec, std::uint64_t seed) {
  if (const auto* constant = std::get_if<ConstantStimuli>(&spec))
    return ConstantStimuliRun(*constant, seed);
  if (const auto* staircase = std::get_if<Staircase>(&spec)) return StaircaseRun(*staircase);
  if (const auto* quest = std::get_if<QuestPlus>(&spec)) return QuestPlusRun(*quest);
  if (const auto* limits = std::get_if<Limits>(&spec)) return LimitsRun(*limits, seed);
  if (const auto* asked = std::get_if<Asked>(&spec)) return AskedRun(*asked, seed);
  if (const auto* sobol = std::get_if<SobolPoints>(&spec)) return SobolRun(*sobol, seed);
  if (const auto* points = std::get_if<AskedPoints>(&spec)) return SobolRun(points->own, seed);
  return FieldQuestPlusRun(std::get<FieldQuestPlus>(spec));
}

bool is_same_quest_plus(const ProcedureSpec& one, const ProcedureSpec& other) {
  if (const auto* field = std::get_if<FieldQuestPlus>(&one)) {
    const auto* same = std::get_if<FieldQuestPlus>(&other);
    return same != nullptr && *field == *same;
  }
  const auto *a = std::get_if<QuestPlus>(&one), *b = std::get_if<QuestPlus>(&other);
  if (a == nullptr || b == nullptr) return false;
  return a->function.shape == b->function.shape && a->function.scale == b->function.scale &&
         a->function.easier == b->function.easier && a->levels == b->levels &&
         a->threshold == b->threshold && a->slope == b->slope && a->guess == b->guess &&
         a->lapse == b->lapse && a->stop_trials == b->stop_trials &&
         a->stop_entropy_bits == b->stop_entropy_bits;
}

}  // namespace

Procedure::Procedure(const ProcedureSpec& spec, std::uint64_t seed) : run_(begin_run(spec, seed)) {}

std::optional<double> Procedure::next_level() const {
  return std::visit(
      [](const auto& run) -> std::optional<double> {
        if constexpr (requires { run.next_level(); }) return run.next_level();
        return std::nullopt;
      },
      run_);
}

std::optional<LevelPoint> Procedure::next_point() const {
  return std::visit(
      [](const auto& run) -> std::optional<LevelPoint> {
        if constexpr (requires { run.next_point(); }) return run.next_point();
        return std::nullopt;
      },
      run_);
}

void Procedure::record(const Response& response) {
  std::visit([&](auto& run) { run.record(response); }, run_);
  history_.push_back(response);
}

Estimate Procedure::estimate() const {
  return std::visit([](const auto& run) { return run.estimate(); }, run_);
}

InterleavedTracks::InterleavedTracks(const std::vector<ProcedureSpec>& specs, std::uint64_t seed)
    : seed_(seed) {
  for (std::size_t i = 0; i < specs.size(); ++i) {
    // A copy shares its large tables with the one before; it needs no seed.
    const auto same = std::find_if(
        specs.begin(), specs.begin() + static_cast<std::ptrdiff_t>(i),
        [&](const ProcedureSpec& other) { return is_same_quest_plus(other, specs[i]); });
    const auto at = static_cast<std::size_t>(same - specs.begin());
    if (at < i) {
      tracks_.push_back(tracks_[at]);
    } else {
      tracks_.emplace_back(specs[i], track_seed(seed, i));
    }
  }
  begin_round();
}

std::vector<std::size_t> round_of_tracks(std::uint64_t seed, std::uint64_t round,
                                         std::vector<std::size_t> unfinished) {
  Random(seed, {0x18, round}).shuffle(unfinished);
  std::ranges::reverse(unfinished);
  return unfinished;
}

void InterleavedTracks::begin_round() {
  std::vector<std::size_t> unfinished;
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    if (!tracks_[i].ended()) unfinished.push_back(i);
  }
  round_ = round_of_tracks(seed_, rounds_++, std::move(unfinished));
  std::ranges::reverse(round_);
}

std::optional<TrackLevel> InterleavedTracks::next() const {
  if (round_.empty()) return std::nullopt;
  const Procedure& track = tracks_[round_.back()];
  if (auto point = track.next_point()) return TrackLevel{round_.back(), 0, std::move(*point)};
  return TrackLevel{round_.back(), *track.next_level()};
}

void InterleavedTracks::record(const Response& response) {
  if (round_.empty()) return;
  tracks_[round_.back()].record(response);
  round_.pop_back();
  if (round_.empty()) begin_round();
}

namespace {

double level_of_success(const PsychometricParticipant& participant, double share) {
  const auto& parameters = participant.parameters;
  const double core = (share - parameters.guess) / (1 - parameters.guess - parameters.lapse);
  return psychometric_level(participant.function, parameters, core);
}

double place_of(const ProcedureSpec& spec, double level) {
  return scale_position(scale_of(spec).value_or(LevelScale::linear), level);
}

}  // namespace

double true_threshold(const ProcedureSpec& spec, const PsychometricParticipant& participant) {
  if (const auto* staircase = std::get_if<Staircase>(&spec))
    return level_of_success(participant, convergence_point(*staircase));
  if (std::holds_alternative<QuestPlus>(spec)) return participant.parameters.threshold;
  if (std::holds_alternative<Limits>(spec)) return level_of_success(participant, 0.5);
  return 0;
}

namespace {

constexpr int kCourses = 20;
/// Standard deviation of a simulated participant's threshold in a course, in steps.
constexpr double kBlurInSteps = 2;

/// A participant for a course: the share of successes at `threshold` is `share`.
struct CourseParticipant {
  double threshold, sd, share;  // threshold and sd on the scale
  bool higher_is_easier;

  bool succeeds(double position, Random& random) const {
    const double easier = (higher_is_easier ? position - threshold : threshold - position) / sd;
    // Logistic, shifted so that it passes through `share`.
    const double odds = share / (1 - share) * portable_exp(1.7 * easier);
    return random.unit() < odds / (1 + odds);
  }
};

std::optional<CourseParticipant> course_participant(const ProcedureSpec& spec,
                                                    const Procedure& so_far) {
  const auto place = [&](double level) { return place_of(spec, level); };
  const std::optional<double> known = so_far.estimate().threshold;
  if (const auto* const stairs = std::get_if<Staircase>(&spec)) {
    if (!stairs->stop_reversals) return std::nullopt;
    const bool higher = stairs->easier == Easier::higher;
    const double middle = (place(stairs->start) + place(higher ? stairs->min : stairs->max)) / 2;
    return CourseParticipant{known ? place(*known) : middle, kBlurInSteps * stairs->steps.back(),
                             convergence_point(*stairs), higher};
  }
  if (const auto* const limits = std::get_if<Limits>(&spec)) {
    const double middle = (place(limits->low) + place(limits->high)) / 2;
    return CourseParticipant{known ? place(*known) : middle, kBlurInSteps * limits->step, 0.5,
                             limits->easier == Easier::higher};
  }
  return std::nullopt;
}

}  // namespace

double expected_trials(const ProcedureSpec& spec, const Procedure& so_far) {
  if (so_far.ended()) return 0;
  const double done = so_far.estimate().trials;
  const auto participant = course_participant(spec, so_far);
  if (!participant) return static_cast<double>(most_trials(spec)) - done;
  double trials = 0;
  for (int i = 0; i < kCourses; ++i) {
    Random random(1, {static_cast<std::uint64_t>(i)});
    Procedure course = so_far;
    while (const auto level = course.next_level()) {
      const double position = place_of(spec, *level);
      course.record({*level, participant->succeeds(position, random)});
      ++trials;
    }
  }
  return trials / kCourses;
}

Recovery simulate_recovery(const ProcedureSpec& spec, const PsychometricParticipant& participant,
                           int participants, std::uint64_t seed) {
  Recovery result;
  result.participants = participants;
  const double truth = place_of(spec, true_threshold(spec, participant));
  std::vector<double> errors;
  double trials = 0;
  for (int i = 0; i < participants; ++i) {
    Random random(seed, {0x4e, static_cast<std::uint64_t>(i)});
    Procedure procedure(spec, random.next());
    while (const auto level = procedure.next_level())
      procedure.record({*level, participant.succeeds(*level, random)});
    const Estimate estimate = procedure.estimate();
    trials += estimate.trials;
    if (!estimate.threshold) {
      ++result.without_estimate;
      continue;
    }
    errors.push_back(place_of(spec, *estimate.threshold) - truth);
  }
  const auto n = static_cast<double>(errors.size());
  result.mean_trials = trials / participants;
  if (errors.size() < 2) return result;
  for (const double error : errors) result.bias += error / n;
  for (const double error : errors)
    result.spread += (error - result.bias) * (error - result.bias) / (n - 1);
  result.spread = std::sqrt(result.spread);
  result.bias_se = result.spread / std::sqrt(n);
  return result;
}

}  // namespace palpate::protocols
