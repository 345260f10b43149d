#include "runner/participants/reacher.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "runner/scene_builder.h"

namespace palpate::runner::participants {
namespace {

constexpr std::uint64_t kReach = 11;  // random stream; others have 1 to 10
constexpr double kFastest = 0.1;      // s, of a plan

}  // namespace

Vec3 side_of(const Vec3& along) {
  const Vec3 left(-along.y, along.x, 0);
  constexpr double kAlongZ = 1e-6;
  if (glm::length(left) > kAlongZ) return glm::normalize(left);
  return {0, 1, 0};
}

void MotorMemory::learn(double error, const ReacherSettings& settings) {
  fast = settings.fast_retention * fast + settings.fast_learning * error;
  slow = settings.slow_retention * slow + settings.slow_learning * error;
}

Reacher::Reacher(const ReacherSettings& settings, const devices::HandImpedance& hand,
                 devices::SimulatedStylus& stylus, const protocols::Protocol& protocol,
                 std::uint64_t seed, int number)
    : settings_(settings),
      stylus_(stylus),
      protocol_(protocol),
      seed_(seed),
      number_(number),
      workspace_(workspace_of(protocol)),
      period_(1 / protocol.servo_rate),
      grip_(grip_from_virtual_tip(protocol)) {
  const double lever = grip_ / workspace_.scale;
  compliance_ = workspace_.scale * (1 / hand.stiffness + lever * lever / hand.turn_stiffness);
}

void Reacher::begin(const protocols::Trial& trial) {
  const protocols::ReachingSpec& reaching = *protocols::block_of(protocol_, trial).reaching;
  Random random(seed_,
                {static_cast<std::uint64_t>(number_), static_cast<std::uint64_t>(trial.session),
                 static_cast<std::uint64_t>(trial.trial), kReach});
  home_ = reaching.home;
  const Vec3 target = reaching.targets.at(static_cast<std::size_t>(*trial.level) - 1);
  const Vec3 along = glm::normalize(target - home_);
  side_ = side_of(along);
  duration_ = std::max(kFastest, settings_.duration + settings_.duration_sd * random.normal());
  const Vec3 noise(random.normal(), random.normal(), random.normal());
  aim_ = target + settings_.aim_sd * noise;
  stylus_.reset(target_at(0));
}

Reacher::Planned Reacher::planned(double time) const {
  const double s = std::clamp((time - settings_.reaction) / duration_, 0.0, 1.0);
  const Vec3 way = aim_ - home_;
  return {home_ + s * s * s * (10 + s * (6 * s - 15)) * way,
          30 * s * s * (1 - s) * (1 - s) / duration_ * way};
}

/// The plan, shifted against the expected force by what the hand gives way to it.
devices::HandTarget Reacher::target_at(double time) const {
  const auto shifted = [&](double at) {
    const Planned plan = planned(at);
    return plan.place - compliance_ * memory_.expected() * glm::length(plan.velocity) * side_;
  };
  devices::HandTarget target;
  target.axis = Vec3(0, 0, 1);
  target.grip = workspace_.to_device(shifted(time) + grip_ * target.axis);
  target.velocity = (shifted(time + period_) - shifted(time)) / (period_ * workspace_.shift_gain());
  return target;
}

void Reacher::step(const servo::Sample& sample) {
  if (sample.phase != servo::Phase::feeling) return;
  stylus_.set_target(target_at(sample.tick * period_));
}

void Reacher::learn(const data::TrialRecord& record) {
  const auto& reach = record.task.reach;
  if (!reach) return;
  const bool error = reach->kind != to_string(protocols::ReachTrial::clamp) && reach->deviation &&
                     reach->peak_speed && *reach->peak_speed > 0;
  memory_.learn(error ? *reach->deviation / (compliance_ * *reach->peak_speed) : 0, settings_);
}

}  // namespace palpate::runner::participants
