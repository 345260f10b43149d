#include "runner/devices/falcon/weighing.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <optional>
#include <sstream>

#include "runner/devices/falcon/parameters.h"

namespace palpate::runner::devices::falcon {
namespace {

constexpr double kTick = 1e-3;  // s
constexpr std::int64_t kWeighingTickNs = 1'000'000;
constexpr double kNearCentre = 0.01;  // m, at the start
constexpr int kLastTicks = 20;
constexpr int kMaxAttempts = 5;
constexpr long kMaxInterrupted = 20;  // ticks of a measurement
constexpr double kMaxDrift = 0.035;   // m, from the target; beyond it the motors are too weak
constexpr double kRamp = 0.5;         // s, from zero to full force
// In the nominal scale. The loop must stay stable with motors 4 times as strong.
constexpr double kStiffness = 250, kDamping = 5, kIntegral = 250;  // N/m, N s/m, N/(m s)
constexpr double kVelocityTime = 2.5e-3;                           // s, of the filter
constexpr double kMostResidualShare = 0.1;                         // share of the heaviest weight

/// PID control of the grip's position.
class PositionController {
 public:
  PositionController(const Vec3& position, double max_force)
      : last_(position), max_force_(max_force) {}

  Vec3 force(const Vec3& position, const Vec3& target) {
    const double blend = kTick / (kVelocityTime + kTick);
    velocity_ += blend * ((position - last_) / kTick - velocity_);
    last_ = position;
    const Vec3 error = target - position;
    sum_ += kTick * error;
    const double strength = kIntegral * glm::length(sum_);
    if (strength > max_force_) sum_ *= max_force_ / strength;
    ramp_ = std::min(1.0, ramp_ + kTick / kRamp);
    const Vec3 wanted = kStiffness * error + kIntegral * sum_ - kDamping * velocity_;
    const double size = glm::length(wanted);
    if (ramp_ == 1 && size > max_force_) ++saturated_;
    return ramp_ * std::min(1.0, max_force_ / std::max(size, max_force_)) * wanted;
  }
  long saturated() const { return saturated_; }  ///< ticks

 private:
  Vec3 last_, velocity_, sum_;
  double max_force_;  // N, nominal
  double ramp_ = 0;
  long saturated_ = 0;
};

class WeighingProcedure {
 public:
  WeighingProcedure(servo::Device& device, servo::Clock& clock, Guide& guide)
      : device_(device), clock_(clock), guide_(guide), due_ns_(clock.now_ns()) {}
  ~WeighingProcedure() {
    // Send several: a single zero command could be skipped while a reply is pending.
    for (int i = 0; i < kLastTicks; ++i) {
      next_reading();
      device_.write(Vec3(0), Vec3(0));
    }
  }
  WeighingProcedure(const WeighingProcedure&) = delete;
  WeighingProcedure& operator=(const WeighingProcedure&) = delete;

  void start_at_centre() {
    guide_.ask("Move the grip to the centre of its workspace, hold it there, and press ENTER.");
    for (;;) {
      const Vec3 position = tick_free();
      if (!answered()) continue;
      if (glm::length(position) <= kNearCentre) break;
      std::ostringstream where;
      where << "That is not the centre yet: move it " << centimetres(-position.x) << " cm right, "
            << centimetres(-position.y) << " cm away from you, " << centimetres(-position.z)
            << " cm up (to within 1 cm), and press ENTER.";
      guide_.ask(where.str());
    }
    controller_.emplace(device_.read().stylus.tip, device_.capabilities().max_force);
  }

  Weighing measure(double weight, const std::string& question, const WeighingSettings& settings) {
    guide_.ask(question);
    do {
      tick_held(Vec3(0));
    } while (!answered());
    guide_.say("  measuring; do not touch it");
    for (int attempt = 0; attempt < kMaxAttempts; ++attempt) {
      const long interrupted = interrupted_, saturated = controller_->saturated();
      Weighing weighing{weight, mean_force(settings)};
      if (controller_->saturated() > saturated) {
        throw GuideError("the motors were at their limit: take lighter weights");
      }
      if (interrupted_ - interrupted <= kMaxInterrupted) return weighing;
    }
    throw GuideError(
        "this computer does not keep time: close other programs, or see palpate devices --timing");
  }

 private:
  /// Mean commanded force over whole cycles of slow motion up and down.
  Vec3 mean_force(const WeighingSettings& settings) {
    const auto ticks = [](double seconds) { return std::lround(seconds / kTick); };
    for (long i = 0; i < ticks(settings.settle); ++i) tick_held(Vec3(0));
    Vec3 mean(0);
    const long count = ticks(settings.cycle * settings.cycles);
    for (long i = 0; i < count; ++i) {
      const double phase = static_cast<double>(i) * kTick / settings.cycle;
      const double fraction = phase - std::floor(phase);
      const double triangle = fraction < 0.25   ? 4 * fraction
                              : fraction < 0.75 ? 2 - 4 * fraction
                                                : 4 * fraction - 4;
      mean += tick_held({0, 0, settings.sweep * triangle}) / static_cast<double>(count);
    }
    return mean;
  }

  static double centimetres(double metres) { return std::round(metres * 1000) / 10; }

  servo::DeviceReading next_reading() {
    // Do not make up for missed ticks.
    due_ns_ = std::max(due_ns_ + kWeighingTickNs, clock_.now_ns());
    clock_.wait_until(due_ns_);
    return device_.read();
  }

  /// nullopt: a guard process has just cut off forces; a zero command re-enables them.
  std::optional<Vec3> position() {
    const servo::DeviceReading reading = next_reading();
    if (reading.trouble == servo::DeviceTrouble::guarded) {
      ++interrupted_;
      device_.write(Vec3(0), Vec3(0));
      return std::nullopt;
    }
    if (reading.lost) throw GuideError(servo::advice(reading.trouble));
    return reading.stylus.tip;
  }

  Vec3 tick_free() {
    for (;;) {
      const auto at = position();
      if (!at) continue;
      device_.write(Vec3(0), Vec3(0));
      return *at;
    }
  }

  /// \return the force commanded
  Vec3 tick_held(const Vec3& target) {
    const auto at = position();
    if (!at) return commanded_;
    if (glm::length(*at - target) > kMaxDrift) {
      throw GuideError(
          "the grip drifted away from the centre: take lighter weights, and lower them slowly");
    }
    commanded_ = controller_->force(*at, target);
    device_.write(commanded_, Vec3(0));
    return commanded_;
  }

  bool answered() {
    const Guide::Answer answer = guide_.answer();
    if (answer == Guide::Answer::stop) throw GuideError("stopped; nothing was stored");
    return answer == Guide::Answer::go_on;
  }

  servo::Device& device_;
  servo::Clock& clock_;
  Guide& guide_;
  std::int64_t due_ns_;
  std::optional<PositionController> controller_;
  Vec3 commanded_;
  long interrupted_ = 0;  // ticks
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
    text << "the commanded force rose by " << slope.z
         << " N for each N of weight, which is impossible: "
         << "did every weight hang freely from the grip?";
    throw GuideError(text.str());
  }
  double square = 0;
  for (const Weighing& w : weighings) {
    const double deviation = w.force.z - mean_force.z - slope.z * (w.weight - mean_weight);
    square += deviation * deviation / n;
  }
  ForceCalibration force;
  // A slope above 1 means motors weaker than nominal, so a newton metre takes more counts.
  force.counts_per_torque = kCountsPerTorque * slope.z;
  force.residual = std::sqrt(square) / slope.z;
  force.sideways = std::hypot(slope.x, slope.y) / slope.z;
  force.arm_weight = (mean_force.z - slope.z * mean_weight) / slope.z;
  if (force.residual > kMostResidualShare * heaviest) {
    std::ostringstream text;
    text << "the weights lie " << force.residual << " N off a straight line ("
         << kMostResidualShare * heaviest << " N are allowed): was a weight wrong or touched?";
    throw GuideError(text.str());
  }
  return force;
}

ForceCalibration weigh(servo::Device& device, servo::Clock& clock, Guide& guide,
                       const WeighingSettings& settings) {
  WeighingProcedure procedure(device, clock, guide);
  procedure.start_at_centre();
  std::vector<Weighing> weighings = {
      procedure.measure(0, "Let go of the grip: the motors hold it. Press ENTER.", settings)};
  for (const double mass : settings.weights) {
    std::ostringstream question;
    question << "Hang " << mass
             << " kg from the grip, lower it slowly, stop it from swinging, and press ENTER.";
    weighings.push_back(procedure.measure(mass * settings.gravity, question.str(), settings));
  }
  ForceCalibration force = fit_scale(weighings);
  force.serial = device.capabilities().serial;
  force.weights = settings.weights;
  return force;
}

}  // namespace palpate::runner::devices::falcon
