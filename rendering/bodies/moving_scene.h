#pragma once
// A scene with moving objects.

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "rendering/scene.h"
#include "rendering/tool.h"
#include "stimuli/shapes.h"

namespace palpate::rendering {

/// An object that moves.
struct MovingObject {
  int object = 0;  ///< index; of SceneObject::object
  stimuli::Body body;
  Pose pose;  ///< of the object's frame
  /// The whole object, in its frame, for its mass; null: use its felt surface, or its convex parts.
  std::shared_ptr<const stimuli::Surface> solid = nullptr;
};

/// Bodies of a scene at most: a step's cost grows with the square of the number of near bodies.
inline constexpr std::size_t kMostBodies = 64;

/// \param parts    of all objects, at their first places
/// \param gravity  m/s^2
/// \param sleeps   bodies at rest are not moved until something comes near
/// \param surfaces  of objects whose surface has no convex parts, at their first places; one each
/// \param solids   whole surfaces of such objects, for collisions: without one, it touches only the
/// hand
/// \throws std::invalid_argument naming the object and the exceeded limit
Scene moving_scene(std::vector<SceneObject> parts, const std::vector<MovingObject>& moving,
                   const Vec3& gravity, bool side_contact = true, const Tool& tool = {},
                   bool sleeps = true, std::vector<SceneSurface> surfaces = {},
                   std::vector<SceneSurface> solids = {});

/// Numbers of a scene's moving objects.
struct MovingSummary {
  std::size_t bodies = 0, obstacles = 0;
  std::size_t part_pairs = 0;         ///< of convex parts or surfaces that may meet
  double lightest = 0, heaviest = 0;  ///< kg
};
/// Empty if nothing moves as a rigid body, or if the scene has soft objects.
std::optional<MovingSummary> moving_summary(const Scene& scene);

}  // namespace palpate::rendering
