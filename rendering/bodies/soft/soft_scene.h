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

/// Every contact with force of the last tick with what gives: place on the ideal tool's axis, m,
/// and force on the tool, N. No allocation.
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

/// Steps come in as they do at a servo, tick by tick: one that was asked for in a tick in a later
/// one, all that are due, or none of them where one is not ready (fault kSoftLate).
void pace_by_tick(RenderState& state);

/// Before a tick, of a state that is paced: steps that are due in it wait. Held in the ticks that
/// have the fault kSoftLate, a recorded path comes out the same. No allocation.
void hold_steps(RenderState& state, bool held) noexcept;

/// The same, with the steps made elsewhere. Right after initial_state().
/// \param steppers  of soft_objects(scene), in order; they must outlive the state's use
void step_elsewhere(RenderState& state, std::span<SoftStepper* const> steppers);

/// The soft objects of a scene; empty where there are none.
std::span<const std::shared_ptr<const SoftObject>> soft_objects(const Scene& scene);

}  // namespace palpate::rendering
