#include "runner/display/scene/rod_places.h"

#include <algorithm>
#include <cmath>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>

namespace palpate::runner {
namespace {

constexpr int kArcSteps = 42;
constexpr float kHeadLength = 4.6F, kHeadRadius = 2.1F;  // of the shaft's radius

/// Unit, at right angles to z.
glm::vec3 aside_of(const glm::vec3& z) {
  const glm::vec3 other = std::abs(z.x) < 0.7F ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0);
  return glm::normalize(glm::cross(other, z));
}

}  // namespace

glm::mat4 rod_place(const glm::vec3& from, const glm::vec3& to, float radius) {
  const glm::vec3 axis = to - from;
  const float length = glm::length(axis);
  const glm::vec3 z = length > 0 ? axis / length : glm::vec3(0, 0, 1);
  const glm::vec3 x = aside_of(z), y = glm::cross(z, x);
  return {glm::vec4(radius * x, 0), glm::vec4(radius * y, 0),
          glm::vec4(std::max(length, 1e-3F * radius) * z, 0), glm::vec4(from, 1)};
}

float radius_seen(const DrawnRod& rod, const Camera& camera) {
  if (rod.thickest == 0) return rod.radius;
  const float height = std::min(camera.height_at(rod.from), camera.height_at(rod.to));
  return std::min(rod.radius, 0.5F * rod.thickest * height);
}

glm::mat4 ball_place(const glm::vec3& centre, float radius) {
  return glm::scale(glm::translate(glm::mat4(1), centre), glm::vec3(radius));
}

ArrowPlaces arrow_places(const glm::vec3& from, const glm::vec3& to, float radius) {
  const float length = glm::distance(from, to);
  const float head = std::min(kHeadLength * radius, 0.5F * length);
  const glm::vec3 neck = length > 0 ? to - head / length * (to - from) : to;
  return {rod_place(from, neck, radius), rod_place(neck, to, kHeadRadius / kHeadLength * head)};
}

std::vector<glm::vec3> points_of(const DrawnTurn& turn) {
  const glm::vec3 x = aside_of(turn.axis), y = glm::cross(turn.axis, x);
  std::vector<glm::vec3> out;
  for (int i = 0; i <= kArcSteps; ++i) {
    const float angle = turn.sweep * static_cast<float>(i) / static_cast<float>(kArcSteps);
    out.push_back(turn.centre + turn.radius * (std::cos(angle) * x + std::sin(angle) * y));
  }
  return out;
}

}  // namespace palpate::runner
