#include "runner/session/force_direction_check.h"

#include <algorithm>
#include <cstdio>
#include <glm/geometric.hpp>

namespace palpate::runner {
namespace {

constexpr double kRounding = 1e-9;  // N
constexpr double kEnough = 1e-3;    // N, that may be missing at the end

std::string newtons(const char* before, double a, const char* between, double b) {
  char text[160];
  std::snprintf(text, sizeof text, "%s%.2f N%s%.2f N", before, a, between, b);
  return text;
}

/// Holds what was commanded, tick by tick, against what may be.
class CommandCheck {
 public:
  explicit CommandCheck(const ForceDirectionCheck& settings) : settings_(settings) {}

  /// \return what is wrong with the tick; empty: nothing
  std::string check(const Sample& sample) {
    if (sample.faults & servo_fault::kTripped) {
      const std::string why = advice(sample.trouble);
      return "the forces went off" + (why.empty() ? why : ": " + why);
    }
    if (sample.phase != Phase::feeling) return "";
    if (sample.tick == 0) began_ns_ = sample.time_ns;
    elapsed_ = static_cast<double>(sample.time_ns - began_ns_) * 1e-9;
    size_ = std::max(glm::length(sample.device1), glm::length(sample.device2));
    const double change =
        std::max(glm::length(sample.device1 - last1_), glm::length(sample.device2 - last2_));
    last1_ = sample.device1;
    last2_ = sample.device2;
    const ForceLimits& limits = settings_.limits();
    if (size_ > limits.max_force + kRounding)
      return newtons("", size_, " were commanded, above the limit of ", limits.max_force);
    if (size_ > settings_.force() + kRounding)
      return newtons("", size_, " were commanded for a push of ", settings_.force());
    const bool gap = (sample.faults & servo_fault::kSamplesLost) != 0;
    if (change > limits.max_change + kRounding && !gap)
      return newtons("the force changed by ", change, " in a tick, above the limit of ",
                     limits.max_change);
    return "";
  }
  bool over() const { return elapsed_ >= ForceDirectionCheck::kSeconds; }
  std::string verdict() const {
    if (size_ >= settings_.force() - kEnough) return "";
    return newtons("no more than ", size_, " were commanded for a push of ", settings_.force());
  }

 private:
  const ForceDirectionCheck& settings_;
  std::int64_t began_ns_ = 0;
  double elapsed_ = 0, size_ = 0;
  Vec3 last1_, last2_;
};

}  // namespace

ForceDirectionCheck::ForceDirectionCheck(const ForceLimits& limits, int driven)
    : limits_(limits), force_(std::min(1.0, 0.5 * limits.max_force)), both_ends_(driven >= 5) {}

rendering::Rendering ForceDirectionCheck::tick(const rendering::Scene&, rendering::RenderState&,
                                               const rendering::LineProbe& probe,
                                               double) const noexcept {
  rendering::Rendering out;
  out.device1 = Vec3(force_, 0, 0);
  if (both_ends_) out.device2 = out.device1;
  out.force = out.device1 + out.device2;
  out.ideal = probe;
  return out;
}

std::string ForceDirectionCheck::push(TickSource& servo, const std::function<bool()>& stop) const {
  const rendering::Scene nothing({}, false);
  constexpr HomeZone kAnywhere{0, 0};
  CommandCheck check(*this);
  std::string fault;
  servo.prepare(nothing, *this, kAnywhere);
  while (fault.empty() && !check.over()) {
    fault = stop() ? "it was stopped" : check.check(servo.next());
  }
  servo.stop();
  return fault.empty() ? check.verdict() : fault;
}

}  // namespace palpate::runner
