#pragma once
// Percepts of an object that is really present.

#include <cmath>
#include <glm/geometric.hpp>

#include "data/base/random.h"
#include "runner/participants/shape_observer.h"
#include "tests/runner/participants/observer_reference.h"

namespace palpate::runner::participants::test {

inline Vec3 random_direction(Random& random) {
  return glm::normalize(Vec3(random.normal(), random.normal(), random.normal()));
}

/// The point where a straight line leaves the object.
inline Percept touch_with_tip(const stimuli::ObjectSpec& object, const Mat3& r, Random& random) {
  const Vec3 start = 0.01 * random.unit() * random_direction(random);
  const Vec3 out = random_direction(random);
  double low = 0;
  double high = 0.2;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (turned_distance(object, r, start + middle * out).distance < 0 ? low : high) = middle;
  }
  Percept percept;
  percept.contact = true;
  percept.tip = start + low * out;
  percept.direction = turned_distance(object, r, percept.tip + 1e-7 * out).normal;
  return percept;
}

/// A stylus of 12 cm that moves sideways until it touches. Newton's steps do not overshoot, because
/// the distance is convex along the path.
inline Percept touch_with_stylus(const stimuli::ObjectSpec& object, const Mat3& r, Random& random) {
  const Vec3 along = random_direction(random);
  const Vec3 in = glm::normalize(glm::cross(along, random_direction(random)));
  Percept percept;
  percept.contact = true;
  percept.ray = true;
  percept.tip = -0.1 * in + 0.01 * random.unit() * random_direction(random) -
                (0.02 + 0.08 * random.unit()) * along;
  percept.tail = percept.tip + 0.12 * along;
  for (int i = 0; i < 10; ++i) {
    const auto found = deepest_on_segment(object, r, percept.tip, percept.tail);
    const double steepness = -glm::dot(found.normal, in);
    if (std::abs(found.distance) < 1e-7 || steepness < 1e-3) break;
    percept.tip += found.distance / steepness * in;
    percept.tail += found.distance / steepness * in;
  }
  const auto found = deepest_on_segment(object, r, percept.tip, percept.tail);
  percept.direction = found.normal;
  percept.along = found.along;
  return percept;
}

/// A percept of a rotated object with the given noise, m and rad.
inline Percept touch(const stimuli::ObjectSpec& object, const Mat3& r, bool ray, double place_noise,
                     double direction_noise, Random& random) {
  Percept percept = ray ? touch_with_stylus(object, r, random) : touch_with_tip(object, r, random);
  const auto noise = [&random](double sd) {
    return sd * Vec3(random.normal(), random.normal(), random.normal());
  };
  const Vec3 shift = noise(place_noise);
  percept.tip += shift;
  percept.tail += shift;
  percept.direction = glm::normalize(percept.direction + noise(direction_noise));
  return percept;
}

}  // namespace palpate::runner::participants::test
