#include "runner/devices/falcon_weighing.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <optional>
#include <sstream>

namespace palpate::falcon {
namespace {

constexpr double kTick = 1e-3;  // s
constexpr std::int64_t kTickNs = 1'000'000;
constexpr double kNearCentre = 0.01;  // m, to begin with
constexpr double kMaxDrift = 0.035;   // m; beyond, the weight has won
constexpr double kMaxForce = 8;       // N, nominal
constexpr double kRamp = 0.5;         // s, from nothing to full force
// By the nominal scale; the true one may be 4 times stronger, and the loop must bear that.
constexpr double kStiffness = 250, kDamping = 5, kIntegral = 250;  // N/m, N s/m, N/(m s)
constexpr double kVelocityTime = 2.5e-3;                           // s, of the filter
constexpr double kLeastSlope = 0.05, kMostSlope = 20;              // nominal N for each N
constexpr double kMostResidual = 0.1;                              // of the heaviest weight

/// Holds the grip at a target.
class Holder {
 public:
  explicit Holder(const Vec3& position) : last_(position) {}

  Vec3 force(const Vec3& position, const Vec3& target) {
    const double blend = kTick / (kVelocityTime + kTick);
    velocity_ += blend * ((position - last_) / kTick - velocity_);
    last_ = position;
    const Vec3 error = target - position;
    sum_ += kTick * error;
    const double strength = kIntegral * glm::length(sum_);
    if (strength > kMaxForce) sum_ *= kMaxForce / strength;
    ramp_ = std::min(1.0, ramp_ + kTick / kRamp);
    const Vec3 wanted = kStiffness * error + kIntegral * sum_ - kDamping * velocity_;
    const double size = glm::length(wanted);
    return ramp_ * std::min(1.0, kMaxForce / std::max(size, kMaxForce)) * wanted;
  }

 private:
  Vec3 last_, velocity_, sum_;
  double ramp_ = 0;
};

class Procedure {
 public:
  Procedure(FalconArm& arm, Clock& clock, Guide& guide)
      : arm_(arm), clock_(clock), guide_(guide), due_ns_(clock.now_ns()) {}
  ~Procedure() { arm_.halt(); }
  Procedure(const Procedure&) = delete;
  Procedure& operator=(const Procedure&) = delete;

  void find_centre() {
    guide_.ask("Take the grip to the middle of its space, hold it there, and press ENTER.");
    for (;;) {
      const Vec3& position = tick_free();
      if (!answered()) continue;
      if (glm::length(position) <= kNearCentre) break;
      std::ostringstream where;
      where << "That is not the middle yet: move it " << centimetres(-position.x) << " cm right, "
            << centimetres(-position.y) << " cm away from you, " << centimetres(-position.z)
            << " cm up (less than 1 cm off is enough), and press ENTER.";
      guide_.ask(where.str());
    }
    holder_.emplace(arm_.reading().position);
  }

  Weighing measure(double weight, const std::string& question, const WeighingSettings& settings) {
    guide_.ask(question);
    do {
      tick_held(Vec3(0));
    } while (!answered());
    guide_.say("  measuring; do not touch it");
    const auto ticks = [](double seconds) { return std::lround(seconds / kTick); };
    for (long i = 0; i < ticks(settings.settle); ++i) tick_held(Vec3(0));
    Weighing weighing{weight, Vec3(0)};
    const std::uint64_t saturated = arm_.counts().saturated;
    const long count = ticks(settings.cycle * settings.cycles);
    for (long i = 0; i < count; ++i) {
      const double phase = static_cast<double>(i) * kTick / settings.cycle;
      const double part = phase - std::floor(phase);
      const double triangle = part < 0.25 ? 4 * part : part < 0.75 ? 2 - 4 * part : 4 * part - 4;
      tick_held({0, 0, settings.sweep * triangle});
      weighing.force += arm_.shown_force() / static_cast<double>(count);
    }
    if (arm_.counts().saturated > saturated) {
      throw GuideError("the motors were at their limit: take lighter weights");
    }
    return weighing;
  }

 private:
  static double centimetres(double metres) { return std::round(metres * 1000) / 10; }

  const ArmReading& next_reading() {
    due_ns_ += kTickNs;
    clock_.wait_until(due_ns_);
    const ArmReading& reading = arm_.update();
    if (!reading.usable()) throw GuideError(advice(reading.trouble));
    return reading;
  }

  const Vec3& tick_free() {
    const Vec3& position = next_reading().position;
    arm_.push(Vec3(0));
    return position;
  }

  void tick_held(const Vec3& target) {
    const Vec3& position = next_reading().position;
    if (glm::length(position - target) > kMaxDrift) {
      throw GuideError(
          "the grip got away from the middle: take lighter weights, and let them down "
          "slowly");
    }
    arm_.push(holder_->force(position, target));
  }

  bool answered() {
    const Guide::Answer answer = guide_.answer();
    if (answer == Guide::Answer::stop) throw GuideError("stopped; nothing was stored");
    return answer == Guide::Answer::go_on;
  }

  FalconArm& arm_;
  Clock& clock_;
  Guide& guide_;
  std::int64_t due_ns_;
  std::optional<Holder> holder_;
};

}  // namespace

ForceCalibration fit_scale(const std::vector<Weighing>& weighings) {
  const auto n = static_cast<double>(weighings.size());
  double mean_weight = 0;
  Vec3 mean_force(0);
  for (const Weighing& w : weighings) {
    mean_weight += w.weight / n;
    mean_force += w.force / n;
  }
  double spread = 0, heaviest = 0;
  Vec3 slope(0);  // nominal N for each N of weight
  for (const Weighing& w : weighings) {
    spread += (w.weight - mean_weight) * (w.weight - mean_weight);
    slope += (w.weight - mean_weight) * (w.force - mean_force);
    heaviest = std::max(heaviest, w.weight);
  }
  if (!(spread > 0)) throw GuideError("at least two different weights are needed");
  slope /= spread;
  if (!(slope.z > kLeastSlope && slope.z < kMostSlope)) {
    std::ostringstream text;
    text << "the motors were told " << slope.z << " N more for each N of weight, which cannot be: "
         << "did every weight hang at the grip, and hang freely?";
    throw GuideError(text.str());
  }
  double square = 0;
  for (const Weighing& w : weighings) {
    const double off = w.force.z - mean_force.z - slope.z * (w.weight - mean_weight);
    square += off * off / n;
  }
  ForceCalibration force;
  // More told than weighed: a count is weaker than thought, so more of them make a newton metre.
  force.counts_per_torque = kCountsPerTorque * slope.z;
  force.residual = std::sqrt(square) / slope.z;
  force.sideways = std::hypot(slope.x, slope.y) / slope.z;
  force.arm_weight = (mean_force.z - slope.z * mean_weight) / slope.z;
  if (force.residual > kMostResidual * heaviest) {
    std::ostringstream text;
    text << "the weights lie " << force.residual << " N off a line (" << kMostResidual * heaviest
         << " N are borne): was a weight wrong or touched?";
    throw GuideError(text.str());
  }
  return force;
}

ForceCalibration weigh(FalconArm& arm, Clock& clock, Guide& guide,
                       const WeighingSettings& settings) {
  arm.set_counts_per_torque(kCountsPerTorque);
  Procedure procedure(arm, clock, guide);
  procedure.find_centre();
  std::vector<Weighing> weighings = {
      procedure.measure(0, "Let go of the grip: it holds itself. Press ENTER.", settings)};
  for (const double mass : settings.weights) {
    std::ostringstream question;
    question << "Hang " << mass
             << " kg at the grip, let it down slowly, still it, and press ENTER.";
    weighings.push_back(procedure.measure(mass * settings.gravity, question.str(), settings));
  }
  ForceCalibration force = fit_scale(weighings);
  force.serial = arm.serial();
  force.weights = settings.weights;
  return force;
}

}  // namespace palpate::falcon
