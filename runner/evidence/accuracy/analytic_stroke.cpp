#include "runner/evidence/accuracy/analytic_stroke.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "data/base/random.h"
#include "runner/evidence/accuracy/local_depths.h"
#include "stimuli/orientation.h"

namespace palpate::runner::evidence {
namespace {

/// Deformation of a bonded layer under a wave of pressure, as a share of a half-space's.
/// \param a  wave number times thickness, above 0
double share_of_half_space(double a, double poisson) {
  constexpr double kThick = 40;
  if (a > kThick) return 1;
  const double kappa = 3 - 4 * poisson;
  return (2 * kappa * std::sinh(2 * a) - 4 * a) /
         (2 * kappa * std::cosh(2 * a) + 4 * a * a + 1 + kappa * kappa);
}

constexpr double kStrokeTick = 1e-3;  // s
constexpr double kStroked = 0.03;     // m from the middle, where the speed applies
constexpr double kTurnSd = 0.02;      // rad a tick
constexpr double kOutside = 0.3;      // m; farther out than any contact
constexpr double kApproach = 3e-3;    // m
constexpr double kPlaced = 1e-9;      // m; accuracy of the depth

class StrokingHand {
 public:
  StrokingHand(const stimuli::ObjectSpec& shape, const AnalyticStrokeSettings& settings)
      : shape_(shape), settings_(settings), random_(settings.seed) {
    const Quat turn = stimuli::uniform_rotation(random_);
    out_ = turn * Vec3(0, 0, 1);
    heading_ = level_ = turn * Vec3(1, 0, 0);
    for (double& phase : phase_) phase = 2 * std::numbers::pi * random_.unit();
  }

  void move() {
    const double turn = kTurnSd * random_.normal();
    heading_ = std::cos(turn) * heading_ + std::sin(turn) * glm::cross(out_, heading_);
    out_ = glm::normalize(out_ + settings_.speed * kStrokeTick / kStroked * heading_);
    heading_ = glm::normalize(heading_ - glm::dot(heading_, out_) * out_);
    level_ = glm::normalize(level_ - glm::dot(level_, out_) * out_);
    time_ += kStrokeTick;
  }

  /// The stylus with the stroked point at this distance from the middle.
  rendering::LineProbe at(double distance) const {
    if (settings_.length == 0) return {distance * out_, distance * out_};
    const double spin = wave(0, 2.9), tilt = 0.8 * std::sin(wave(1, 3.1));
    const double stroked = std::min(settings_.length, 0.02 + 0.02 * std::sin(wave(2, 1.9)));
    const Vec3 level = std::cos(spin) * level_ + std::sin(spin) * glm::cross(out_, level_);
    const Vec3 axis = std::cos(tilt) * level + std::sin(tilt) * out_;
    const Vec3 tip = distance * out_ - stroked * axis;
    return {tip, tip + settings_.length * axis};
  }

  double wanted_depth() const {
    const double middle = (settings_.shallow + settings_.deep) / 2;
    return middle + (settings_.deep - middle) * std::sin(wave(3, 0.7));
  }

  /// The distance at which the stylus has this depth. The depth rises from outside inwards.
  double distance_for(double depth) const {
    double in = 0, beyond = kOutside;
    if (last_ > 0 && deeper(last_ - 1e-3, depth) && !deeper(last_ + 1e-3, depth)) {
      in = last_ - 1e-3;
      beyond = last_ + 1e-3;
    }
    while (beyond - in > kPlaced) {
      const double middle = (in + beyond) / 2;
      (deeper(middle, depth) ? in : beyond) = middle;
    }
    last_ = in;
    return in;
  }

 private:
  double wave(int which, double period) const {
    return phase_[which] + 2 * std::numbers::pi * time_ / period;
  }
  bool deeper(double distance, double depth) const {
    const auto depths = local_depths(shape_, at(distance));
    return !depths.empty() && depths.front().depth > depth;
  }

  const stimuli::ObjectSpec& shape_;
  const AnalyticStrokeSettings& settings_;
  Random random_;
  Vec3 out_, heading_;
  Vec3 level_;  // carried along without turning about out_
  double phase_[4] = {};
  double time_ = 0;
  mutable double last_ = 0;  // result of the last search; the next begins near it
};

}  // namespace

double line_depth(const LineContact& contact, double half_width) {
  // Integrate over wave numbers times a by Simpson's rule; the rest beyond kLast is 1e-6 of it.
  constexpr int kPoints = 4000;
  constexpr double kLast = 100;
  const double h = kLast / kPoints, thick = contact.thickness / half_width;
  const double kappa = 3 - 4 * contact.poisson;
  double sum = 4 * thick * (kappa - 1) / ((kappa + 1) * (kappa + 1));  // at 0
  for (int i = 1; i <= kPoints; ++i) {
    const double k = h * i;
    const double weight = i == kPoints ? 1 : (i % 2 == 1 ? 4 : 2);
    sum += weight * share_of_half_space(k * thick, contact.poisson) / k * 2 *
           std::cyl_bessel_j(1, k) / k;
  }
  return half_width * half_width / (2 * contact.radius) * sum * h / 3;
}

double line_force(const LineContact& contact, double depth) {
  double low = 0, high = contact.radius;
  constexpr int kHalvings = 40;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (line_depth(contact, middle) < depth ? low : high) = middle;
  }
  const double modulus = contact.young / (1 - contact.poisson * contact.poisson);
  return std::numbers::pi * modulus * low * low / (4 * contact.radius);
}

AnalyticStroke analytic_stroke(const stimuli::ObjectSpec& primitive,
                               const AnalyticStrokeSettings& settings) {
  AnalyticStroke stroke;
  StrokingHand hand(primitive, settings);
  const double distance = hand.distance_for(hand.wanted_depth());
  const double step = settings.speed * kStrokeTick;
  for (double back = settings.deep + kApproach; back > step / 2; back -= step) {
    stroke.poses.push_back(hand.at(distance + back));
  }
  stroke.approach = stroke.poses.size();
  for (int i = 0; i < settings.contact_ticks; ++i) {
    stroke.poses.push_back(hand.at(hand.distance_for(hand.wanted_depth())));
    hand.move();
  }
  return stroke;
}

}  // namespace palpate::runner::evidence
