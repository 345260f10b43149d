#include "runner/session/reach_measures.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <string>

#include "runner/participants/reacher.h"

namespace palpate::runner::session {
namespace {

using protocols::ReachingSpec;

constexpr double kLeastForce2 = 1e-6;  // N^2, mean square of a field; less is none

Vec3 vector(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

/// Ticks in half of kSpeedSpan.
std::size_t half_span(double period) {
  return static_cast<std::size_t>(std::max(1L, std::lround(kSpeedSpan / 2 / period)));
}

/// A recorded movement.
class Movement {
 public:
  Movement(std::span<const data::SampleRecord> samples, double period)
      : samples_(samples), period_(period), half_(half_span(period)) {
    if (samples.size() <= 2 * half_) return;
    for (std::size_t i = half_; i + half_ < samples.size(); ++i) {
      if (speed(i) > speed(peak_)) peak_ = i;
    }
    if (speed(peak_) < ReachingSpec::kStopSpeed) return;
    moved_ = true;
    begin_ = peak_;
    while (begin_ > half_ && speed(begin_ - 1) >= ReachingSpec::kStopSpeed) --begin_;
  }

  bool moved() const { return moved_; }
  std::size_t begin() const { return begin_; }
  std::size_t peak() const { return peak_; }
  std::size_t end() const { return samples_.size() - 1; }
  Vec3 tip(std::size_t i) const { return vector(samples_[i].tip); }
  Vec3 force(std::size_t i) const { return vector(samples_[i].force); }
  const data::SampleRecord& sample(std::size_t i) const { return samples_[i]; }
  /// Over kSpeedSpan about the tick; 0 within half of it from either end of the record.
  Vec3 velocity(std::size_t i) const {
    if (i < half_ || i + half_ >= samples_.size()) return Vec3(0);
    return (tip(i + half_) - tip(i - half_)) / (2 * static_cast<double>(half_) * period_);
  }
  double speed(std::size_t i) const { return glm::length(velocity(i)); }
  /// m. In steps of half of kSpeedSpan: the noise of every tick would make it longer.
  double path() const {
    double length = 0;
    std::size_t last = begin_;
    for (std::size_t i = begin_ + half_; i < end(); i += half_) {
      length += glm::length(tip(i) - tip(last));
      last = i;
    }
    return length + glm::length(tip(end()) - tip(last));
  }

 private:
  std::span<const data::SampleRecord> samples_;
  double period_;
  std::size_t half_, peak_ = 0, begin_ = 0;
  bool moved_ = false;
};

/// Slope through 0, by least squares, of the sideways force on that of the field.
std::optional<double> adaptation_of(const Movement& movement, const Vec3& side,
                                    const FieldOfReach& field) {
  double products = 0, squares = 0;
  for (std::size_t i = movement.begin(); i <= movement.end(); ++i) {
    const double wanted = glm::dot(field(movement.sample(i), movement.velocity(i)), side);
    products += wanted * glm::dot(movement.force(i), side);
    squares += wanted * wanted;
  }
  const auto ticks = static_cast<double>(movement.end() - movement.begin() + 1);
  if (squares < kLeastForce2 * ticks) return std::nullopt;
  return products / squares;
}

int answer_named(const protocols::TaskBlock& block, const char* name) {
  const auto found = std::ranges::find(block.answers, name, &protocols::TaskAnswer::name);
  return static_cast<int>(found - block.answers.begin());
}

}  // namespace

RestInTarget::RestInTarget(const Vec3& target, double radius, double period)
    : target_(target),
      radius_(radius),
      most_(ReachingSpec::kStopSpeed * 2 * static_cast<double>(half_span(period)) * period),
      last_(2 * half_span(period)) {}

bool RestInTarget::rests(const Vec3& tip) {
  Vec3& oldest = last_[ticks_ % last_.size()];
  const bool slow = ticks_ >= last_.size() && glm::length(tip - oldest) < most_;
  oldest = tip;
  ++ticks_;
  return slow && glm::length(tip - target_) <= radius_;
}

data::ReachRecord reach_measures(std::span<const data::SampleRecord> samples,
                                 protocols::ReachTrial kind, const Vec3& target, double period,
                                 const FieldOfReach& field) {
  data::ReachRecord out;
  out.kind = to_string(kind);
  const Movement movement(samples, period);
  if (!movement.moved()) return out;
  const Vec3 from = movement.tip(movement.begin());
  if (!(glm::length(target - from) > 0)) return out;
  const Vec3 side = participants::side_of(glm::normalize(target - from));
  const auto sideways = [&](std::size_t i) { return glm::dot(movement.tip(i) - from, side); };
  out.duration = static_cast<double>(movement.end() - movement.begin()) * period;
  out.peak_speed = movement.speed(movement.peak());
  out.deviation = sideways(movement.peak());
  double largest = 0;
  for (std::size_t i = movement.begin(); i <= movement.end(); ++i) {
    if (std::abs(sideways(i)) > std::abs(largest)) largest = sideways(i);
  }
  out.largest_deviation = largest;
  const double chord = glm::length(movement.tip(movement.end()) - from);
  if (chord > 0) out.path_ratio = movement.path() / chord;
  out.endpoint_error = glm::length(movement.tip(movement.end()) - target);
  out.side_force = glm::dot(movement.force(movement.peak()), side);
  if (kind == protocols::ReachTrial::clamp) out.adaptation = adaptation_of(movement, side, field);
  return out;
}

int timing_of(const protocols::TaskBlock& block, const data::ReachRecord& reach) {
  const ReachingSpec& asked = *block.reaching;
  const bool slow = !reach.duration || (asked.most_time && *reach.duration > *asked.most_time);
  if (slow) return answer_named(block, "slow");
  const bool fast = asked.least_time && *reach.duration < *asked.least_time;
  return answer_named(block, fast ? "fast" : "in_time");
}

}  // namespace palpate::runner::session
