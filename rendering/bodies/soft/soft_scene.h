#pragma once
// A scene of which some objects give. Objects that do not are rendered as ever, in a scene of their
// own within; the wrenches add up. World frame, SI units.

#include <memory>
#include <span>
#include <vector>

#include "rendering/bodies/soft/soft_coupling.h"
#include "rendering/scene.h"

namespace palpate::rendering {

/// A soft object as it is now, to be drawn.
struct SoftShape {
  int object = 0;                                           ///< index in the scene
  std::span<const Vec3> rest, now;                          ///< m, of the nodes of the surface
  std::span<const std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise from outside
};

/// \param others  the scene of all objects that do not give, with the same tool
/// \param shown   the parts of all objects, at rest: for what only asks where objects are
/// \param soft    at least one
Scene soft_scene(Scene others, std::vector<SceneObject> shown,
                 std::vector<std::shared_ptr<const SoftObject>> soft, bool side_contact,
                 const Tool& tool);

/// Empty where nothing is soft. Valid until the state's next tick, which changes them in place.
std::vector<SoftShape> soft_shapes(const Scene& scene, const RenderState& state);

/// The soft objects of a scene; empty where there are none.
std::span<const std::shared_ptr<const SoftObject>> soft_objects(const Scene& scene);

}  // namespace palpate::rendering
