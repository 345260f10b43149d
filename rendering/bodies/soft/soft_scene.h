#pragma once
// A scene with soft objects. Rigid objects are rendered as usual, in a scene of their own inside
// it; the wrenches add up. World frame, SI units.

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "rendering/bodies/soft/soft_object.h"
#include "rendering/scene.h"
#include "rendering/tool.h"
#include "stimuli/vec.h"

namespace palpate::rendering {

/// The present state of a soft object, for drawing.
struct SoftShape {
  int object = 0;                                           ///< index in the scene
  std::span<const Vec3> rest, now;                          ///< m, of the nodes of the surface
  std::span<const std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise from outside
};

/// \param others  the scene of all rigid objects, with the same tool
/// \param shown   the parts of all objects at rest, for queries of where objects are
/// \param soft    at least one
Scene soft_scene(Scene others, std::vector<SceneObject> shown,
                 std::vector<std::shared_ptr<const SoftObject>> soft, bool side_contact,
                 const Tool& tool);

/// Empty if nothing is soft. Valid until the state's next tick, which changes them in place.
std::vector<SoftShape> soft_shapes(const Scene& scene, const RenderState& state);

/// Every contact with force between tool and soft object in the last tick: place on the ideal
/// tool's axis, m, and force on the tool, N. No allocation.
using SoftContactVisit = void (*)(void* whom, const Vec3& place, const Vec3& force);
void visit_soft_contacts(const RenderState& state, SoftContactVisit visit, void* whom) noexcept;
template <class Visit>
void for_each_soft_contact(const RenderState& state, Visit visit) noexcept {
  visit_soft_contacts(
      state,
      [](void* whom, const Vec3& place, const Vec3& force) {
        (*static_cast<Visit*>(whom))(place, force);
      },
      &visit);
}

/// Uses results of steps as a servo does, tick by tick: a step requested in one tick arrives in a
/// later one. All due steps arrive together, or none if one is not ready (fault kSoftLate).
void pace_by_tick(RenderState& state);

/// Makes due steps wait in the next tick of a state paced by tick. A replay that holds the ticks
/// with the fault kSoftLate gives the recorded result. No allocation.
void hold_steps(RenderState& state, bool held) noexcept;

/// The same as pace_by_tick, with steps made elsewhere. Call right after initial_state().
/// \param steppers  of soft_objects(scene), in order; they must outlive the state's use
void step_elsewhere(RenderState& state, std::span<SoftStepper* const> steppers);

/// The soft objects of a scene.
std::span<const std::shared_ptr<const SoftObject>> soft_objects(const Scene& scene);

}  // namespace palpate::rendering
