#pragma once
// Where the unit cylinder, cone and sphere go to be rods, arrows and balls.

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "runner/display/scene/camera.h"
#include "runner/display/scene/picture.h"

namespace palpate::runner {

/// Takes the unit z axis from `from` to `to`, x and y to `radius`.
glm::mat4 rod_place(const glm::vec3& from, const glm::vec3& to, float radius);
/// The radius with which the rod is drawn.
float radius_seen(const DrawnRod& rod, const Camera& camera);
glm::mat4 ball_place(const glm::vec3& centre, float radius);

struct ArrowPlaces {
  glm::mat4 shaft, head;
};
/// The head ends at `to`; of a short arrow it is half.
ArrowPlaces arrow_places(const glm::vec3& from, const glm::vec3& to, float radius);

/// Points along the arc; the last three steps are its head.
std::vector<glm::vec3> points_of(const DrawnTurn& turn);

}  // namespace palpate::runner
