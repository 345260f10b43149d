#pragma once
// The two renderers, point-based and ray-based (Ho, Basdogan & Srinivasan 2000), behind one
// interface: from the pose of the virtual probe to the wrench on the hand, by a god-object (the
// ideal probe) for each object. Pure: state is an argument, so a path can be replayed and compared
// bit by bit. A tick never throws, allocates, locks or does I/O, so it may run in the servo loop.

#include <cstdint>

#include "rendering/contact.h"
#include "rendering/render_fault.h"
#include "rendering/scene.h"

namespace palpate::rendering {

/// The result of a tick. World frame.
struct Rendering {
  Vec3 force;       ///< N, on the hand
  Vec3 torque;      ///< N m, about the virtual tip: sum over contacts of (contact - tip) x force
  Vec3 device1;     ///< N, for the device at the tip
  Vec3 device2;     ///< N, for the device at the tail
  Contact deepest;  ///< the contact of largest depth; type none in free space
  /// Ideal probe of the deepest contact; in free space the virtual one, or one that lags in
  /// turning.
  LineProbe ideal;
  int contacts = 0;          ///< contact points with force
  int object = -1;           ///< of the deepest contact; -1 in free space
  std::uint32_t faults = 0;  ///< render_fault
  int segment = -1;          ///< of the tool, where the deepest contact is; -1 in free space
  Vec3 ideal_side{0, 0, 0};  ///< unit, +x of the ideal tool; zero without a tool
};

class Renderer {
 public:
  virtual ~Renderer() = default;
  virtual const char* name() const = 0;
  /// Whether the side of the probe touches as well as the tip: needs a device that senses 5 degrees
  /// of freedom, and a scene compiled with side contact.
  virtual bool side_contact() const = 0;
  /// \param dt  s since the last tick; only damping needs it
  virtual Rendering tick(const Scene& scene, RenderState& state, const LineProbe& probe,
                         double dt) const noexcept = 0;
};

const Renderer& point_renderer();  ///< only the tip touches
const Renderer& ray_renderer();    ///< tip and side touch

}  // namespace palpate::rendering
