#pragma once
// The observer's formulas written out again, in double precision and without optimisation.

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <vector>

#include "runner/participants/shape_observer.h"
#include "stimuli/primitives.h"
#include "stimuli/signed_distance.h"

namespace palpate::runner::participants::test {

inline std::vector<stimuli::ObjectSpec> four_shapes() {
  std::vector<stimuli::ObjectSpec> stimuli(4);
  stimuli[0].shape = stimuli::ShapeKind::sphere;
  stimuli[1].shape = stimuli::ShapeKind::cone;
  stimuli[2].shape = stimuli::ShapeKind::cylinder;
  stimuli[3].shape = stimuli::ShapeKind::cube;
  return stimuli;
}

/// Settings of an observer with evidence by movement and without forgetting.
inline ObserverSettings by_movement() {
  ObserverSettings settings;
  settings.evidence = Evidence::movement;
  settings.forgetting = false;
  return settings;
}

struct DeepestReference {
  double distance;  // m
  double along;     // m from the tip
  Vec3 normal;      // unit
};

/// Surface of a turned object centred at the origin.
inline stimuli::SurfaceDistance turned_distance(const stimuli::ObjectSpec& object,
                                                const Mat3& world_from_local, const Vec3& point) {
  stimuli::SurfaceDistance found =
      stimuli::signed_distance(object, glm::transpose(world_from_local) * point);
  found.normal = world_from_local * found.normal;
  return found;
}

/// By ternary search to a nanometre: the distance to a convex object is convex along a line. Where
/// the slope jumps, the normal is the mixture of both sides' that is perpendicular to the line.
inline DeepestReference deepest_on_segment(const stimuli::ObjectSpec& object,
                                           const Mat3& world_from_local, const Vec3& tip,
                                           const Vec3& tail) {
  const double length = glm::length(tail - tip);
  const Vec3 along = (tail - tip) / length;
  const auto at = [&](double s) {
    return turned_distance(object, world_from_local, tip + s * along);
  };
  double low = 0;
  double high = length;
  while (high - low > 1e-9) {
    const double a = low + (high - low) / 3;
    const double b = high - (high - low) / 3;
    (at(a).distance < at(b).distance ? high : low) = at(a).distance < at(b).distance ? b : a;
  }
  constexpr double kStep = 1e-7;
  const stimuli::SurfaceDistance before = at(std::max(0.0, low - kStep));
  const stimuli::SurfaceDistance after = at(std::min(length, high + kStep));
  const double falling = glm::dot(before.normal, along);
  const double rising = glm::dot(after.normal, along);
  Vec3 normal = rising <= 0 ? after.normal : before.normal;
  if (falling < 0 && rising > 0) {
    normal = glm::normalize(rising * before.normal - falling * after.normal);
  }
  return {std::min({at(low).distance, before.distance, after.distance}), low, normal};
}

class ReferenceObserver {
 public:
  ReferenceObserver(const std::vector<stimuli::ObjectSpec>& objects,
                    const ShapeHypotheses& hypotheses, const ObserverSettings& settings)
      : objects_(objects), hypotheses_(hypotheses), settings_(settings) {
    for (const auto& shape : hypotheses.shapes()) {
      prior_.push_back(-std::log(static_cast<double>(objects.size()) * shape.count));
      log_posterior_.emplace_back(static_cast<std::size_t>(shape.count), prior_.back());
    }
  }

  double log_likelihood(const stimuli::ObjectSpec& object, const Mat3& r, const Percept& p) const {
    const ObserverSettings& o = settings_;
    const double v = o.contact_sd * o.contact_sd + o.model_contact_sd * o.model_contact_sd;
    const double kappa =
        1 / (o.direction_sd * o.direction_sd + o.model_direction_sd * o.model_direction_sd);
    const stimuli::SurfaceDistance tip = turned_distance(object, r, p.tip);
    const DeepestReference deepest = p.ray ? deepest_on_segment(object, r, p.tip, p.tail)
                                           : DeepestReference{tip.distance, 0, tip.normal};
    const double d = deepest.distance;
    if (!p.contact) {
      return o.free_space_weight * std::log(std::erfc(-d / std::sqrt(2 * v)) / 2);
    }
    double l = -d * d / (2 * v) + kappa * (glm::dot(deepest.normal, p.direction) - 1);
    if (p.ray && p.along) {
      double weights = 0;
      double fits = 0;
      for (int k = 0; k < o.places_along; ++k) {
        const double share = static_cast<double>(k) / (o.places_along - 1);
        const Vec3 place = p.tip + share * (p.tail - p.tip);
        const double off = share * glm::length(p.tail - p.tip) - *p.along;
        const double w =
            std::exp(-(turned_distance(object, r, place).distance - d) / o.soft_min_scale);
        weights += w;
        fits += w * std::exp(-off * off / (2 * o.along_sd * o.along_sd));
      }
      l += std::log(fits / weights + o.torque_floor);
    }
    return l;
  }

  void update(const Percept& percept) {
    const double lambda = std::exp(-1 / (settings_.percept_rate * settings_.memory));
    for (std::size_t s = 0; s < objects_.size(); ++s) {
      for (std::size_t i = 0; i < log_posterior_[s].size(); ++i) {
        const Mat3 r = hypotheses_.rotation(hypotheses_.shapes()[s].first + static_cast<int>(i));
        const double l = std::max(log_likelihood(objects_[s], r, percept), settings_.floor);
        double& value = log_posterior_[s][i];
        value = lambda * value + (1 - lambda) * prior_[s] + settings_.beta * l;
      }
    }
  }

  std::vector<double> probabilities() const {
    std::vector<double> found;
    double total = 0;
    for (const auto& shape : log_posterior_) {
      double sum = 0;
      for (const double l : shape) sum += std::exp(l);
      found.push_back(sum);
      total += sum;
    }
    for (double& p : found) p /= total;
    return found;
  }

 private:
  std::vector<stimuli::ObjectSpec> objects_;
  const ShapeHypotheses& hypotheses_;
  ObserverSettings settings_;
  std::vector<double> prior_;
  std::vector<std::vector<double>> log_posterior_;
};

}  // namespace palpate::runner::participants::test
