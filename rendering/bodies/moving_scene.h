#pragma once
// A scene with moving objects: each moving object is rendered in its own frame, where it stands
// still, so the contact law and the ideal tool go with it; what the hand is pushed with, it is
// pushed back with.

#include <cstddef>
#include <optional>
#include <vector>

#include "rendering/scene.h"
#include "stimuli/shapes.h"

namespace palpate::rendering {

/// An object that moves.
struct MovingObject {
  int object = 0;  ///< index; of SceneObject::object
  stimuli::Body body;
  Pose pose;  ///< of the object's frame
};

/// Bodies of a scene at most: a step's cost grows with the square of those that are near.
inline constexpr std::size_t kMostBodies = 64;

/// \param parts    of all objects, where they are at first
/// \param gravity  m/s^2
/// \param sleeps   bodies at rest are not moved until something comes near
/// \param surfaces  of objects without convex parts of their own surface, where they are at first;
/// one for each of them
/// \param solids   the convex parts of objects with surfaces, for collisions alone: the
/// hand feels the surface. Without them such an object meets nothing but the hand
/// \throws std::invalid_argument naming the object and the limit that is passed
Scene moving_scene(std::vector<SceneObject> parts, const std::vector<MovingObject>& moving,
                   const Vec3& gravity, bool side_contact = true, const Tool& tool = {},
                   bool sleeps = true, std::vector<SceneSurface> surfaces = {},
                   std::vector<SceneObject> solids = {});

/// What of a scene moves, in numbers.
struct MovingSummary {
  std::size_t bodies = 0, obstacles = 0;
  std::size_t part_pairs = 0;         ///< of convex parts that may meet
  double lightest = 0, heaviest = 0;  ///< kg
};
/// Empty where nothing moves as a rigid body, or something gives besides.
std::optional<MovingSummary> moving_summary(const Scene& scene);

}  // namespace palpate::rendering
