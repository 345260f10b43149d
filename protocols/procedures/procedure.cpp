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

}  // namespace palpate::protocols
