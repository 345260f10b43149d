#include "runner/devices/falcon/stylus_from_ends.h"

#include <Eigen/Core>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

namespace palpate::runner::devices::falcon {
namespace {

constexpr std::int64_t kTickNs = 1'000'000;
constexpr double kStillness = 0.001;     // m
constexpr double kApart = 0.015;         // m, from every earlier point
constexpr double kMostResidual = 0.003;  // m; above it a point was wrong

class Procedure {
 public:
  Procedure(servo::Device& tip, servo::Device& tail, servo::Clock& clock, Guide& guide)
      : tip_(tip), tail_(tail), clock_(clock), guide_(guide), due_ns_(clock.now_ns()) {}

  /// Repeats the request until a valid point was taken.
  PairedPoint take(const std::string& question, const std::vector<PairedPoint>& earlier,
                   const RegistrationSettings& settings) {
    for (;;) {
      guide_.ask(question);
      while (!answered()) tick();
      const auto point = rest(settings.still);
      if (!point) {
        guide_.say("  it moved; once more");
        continue;
      }
      const bool apart = std::all_of(earlier.begin(), earlier.end(), [&](const PairedPoint& old) {
        return glm::length(old.tip_frame - settings.offset - point->tip_frame) >= kApart;
      });
      if (apart) return {point->tip_frame + settings.offset, point->tail_frame};
      guide_.say("  that is too near to an earlier point; move farther away");
    }
  }

 private:
  PairedPoint tick() {
    // Do not make up for missed ticks.
    due_ns_ = std::max(due_ns_ + kTickNs, clock_.now_ns());
    clock_.wait_until(due_ns_);
    return {free_position(tip_), free_position(tail_)};
  }

  static Vec3 free_position(servo::Device& device) {
    const servo::DeviceReading reading = device.read();
    device.write(Vec3(0), Vec3(0));
    // The guard has commanded zero force: harmless, as no force is used here.
    if (reading.lost && reading.trouble != servo::DeviceTrouble::guarded) {
      throw GuideError(device.capabilities().serial + ": " + servo::advice(reading.trouble));
    }
    return reading.stylus.tip;
  }

  /// The mean position during a rest; nullopt: a grip moved.
  std::optional<PairedPoint> rest(double seconds) {
    const PairedPoint first = tick();
    PairedPoint mean;
    const long ticks = std::lround(seconds * 1e9 / static_cast<double>(kTickNs));
    for (long i = 0; i < ticks; ++i) {
      const PairedPoint now = tick();
      if (glm::length(now.tip_frame - first.tip_frame) > kStillness ||
          glm::length(now.tail_frame - first.tail_frame) > kStillness) {
        return std::nullopt;
      }
      mean.tip_frame += now.tip_frame / static_cast<double>(ticks);
      mean.tail_frame += now.tail_frame / static_cast<double>(ticks);
    }
    return mean;
  }

  bool answered() {
    const Guide::Answer answer = guide_.answer();
    if (answer == Guide::Answer::stop) throw GuideError("stopped; nothing was stored");
    return answer == Guide::Answer::proceed;
  }

  servo::Device &tip_, &tail_;
  servo::Clock& clock_;
  Guide& guide_;
  std::int64_t due_ns_;
};

}  // namespace

PairRegistration register_pair(servo::Device& tip, servo::Device& tail, servo::Clock& clock,
                               Guide& guide, const RegistrationSettings& settings) {
  Procedure procedure(tip, tail, clock, guide);
  guide.say(glm::length(settings.offset) == 0
                ? "Pin the two grips together, centre on centre."
                : "Put the stylus with both grips into its jig; its direction must not change.");
  std::vector<PairedPoint> points;
  points.reserve(static_cast<std::size_t>(settings.points));
  for (int i = 1; i <= settings.points; ++i) {
    std::ostringstream question;
    question
        << "Point " << i << " of " << settings.points
        << ": move both to a new position (right, left, near, far, up, down), hold them still, "
           "and press ENTER.";
    points.push_back(procedure.take(question.str(), points, settings));
  }
  const RigidFit fit = fit_rigid(points);
  if (fit.residual > kMostResidual) {
    std::ostringstream text;
    text << "the points fit only within " << std::round(fit.residual * 1e4) / 10 << " mm ("
         << kMostResidual * 1e3 << " mm are allowed; the worst is "
         << std::round(fit.worst * 1e4) / 10
         << " mm off): are the grips firmly together, and both devices homed?";
    throw GuideError(text.str());
  }
  PairRegistration pair;
  pair.tip_serial = tip.capabilities().serial;
  pair.tail_serial = tail.capabilities().serial;
  pair.tail_in_tip = fit.tail_in_tip;
  pair.stylus_length = settings.stylus_length;
  pair.residual = fit.residual;
  pair.points = settings.points;
  return pair;
}

}  // namespace palpate::runner::devices::falcon

namespace palpate::runner::devices {
namespace {

constexpr std::size_t kLeastPoints = 4;
constexpr double kLeastSpread = 0.01;  // m, root mean square, in the second widest direction

Eigen::Vector3d eigen(const Vec3& v) { return {v.x, v.y, v.z}; }

}  // namespace

RigidFit fit_rigid(std::span<const PairedPoint> points) {
  if (points.size() < kLeastPoints) {
    throw RegistrationError("at least " + std::to_string(kLeastPoints) +
                            " points are needed; there are " + std::to_string(points.size()));
  }
  const auto n = static_cast<double>(points.size());
  Eigen::Vector3d tip_mean = Eigen::Vector3d::Zero(), tail_mean = Eigen::Vector3d::Zero();
  for (const PairedPoint& point : points) {
    tip_mean += eigen(point.tip_frame) / n;
    tail_mean += eigen(point.tail_frame) / n;
  }
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const PairedPoint& point : points) {
    covariance +=
        (eigen(point.tip_frame) - tip_mean) * (eigen(point.tail_frame) - tail_mean).transpose() / n;
  }
  if (!covariance.allFinite()) throw RegistrationError("a point is not a number");
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance,
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double spread = std::sqrt(svd.singularValues()[1]);
  if (!(spread >= kLeastSpread)) {
    throw RegistrationError("the points lie too nearly on a line (" +
                            std::to_string(std::lround(1e3 * spread)) +
                            " mm across): spread them over the workspace");
  }
  Eigen::Vector3d sign(1, 1, 1);
  // The best orthogonal matrix may be a reflection if points are coplanar or noisy: take the best
  // rotation.
  sign[2] = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  const Eigen::Matrix3d rotation = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  const Eigen::Vector3d shift = tip_mean - rotation * tail_mean;

  RigidFit fit;
  Mat3 columns;
  for (int c = 0; c < 3; ++c) {
    for (int r = 0; r < 3; ++r) columns[c][r] = rotation(r, c);
  }
  fit.tail_in_tip = {{shift.x(), shift.y(), shift.z()}, glm::normalize(glm::quat_cast(columns))};
  double sum = 0;
  for (const PairedPoint& point : points) {
    const double off = (eigen(point.tip_frame) - rotation * eigen(point.tail_frame) - shift).norm();
    sum += off * off / n;
    fit.worst = std::max(fit.worst, off);
  }
  fit.residual = std::sqrt(sum);
  return fit;
}

bool StylusFromEnds::update(const Vec3& tip, const Vec3& tail) noexcept {
  const rendering::LineProbe seen{tip, tail_in_tip_.orientation * tail + tail_in_tip_.position};
  stretch_ = glm::length(seen.tail - seen.tip) - length_;
  if (std::abs(stretch_) <= tolerance_) {  // false for NaN
    stylus_ = seen;
    wrong_ = 0;
    return true;
  }
  wrong_ = std::min(wrong_ + 1, kMaxWrong);
  return wrong_ < kMaxWrong;
}

Vec3 StylusFromEnds::to_tail_frame(const Vec3& force) const {
  return glm::conjugate(tail_in_tip_.orientation) * force;
}

}  // namespace palpate::runner::devices
