#pragma once
// One interface for the two ways of rendering the stylus. Pure: state is an argument, so a path can
// be replayed and compared bit by bit. A tick never throws, allocates, locks or does I/O.

#include <cstdint>

#include "rendering/contact.h"
#include "rendering/scene.h"

namespace palpate {

/// Bits of Rendering::faults.
namespace render_fault {
inline constexpr std::uint32_t kNonFinite = 1;  ///< pose or force was not finite: zero force
inline constexpr std::uint32_t kStartedInside =
    2;                                           ///< an object gives no force until it is left once
inline constexpr std::uint32_t kWalkCapped = 4;  ///< a walk met its limit of steps
inline constexpr std::uint32_t kContactsDropped = 8;  ///< more contacts than kMaxContacts
}  // namespace render_fault

/// What a tick renders. World frame.
struct Rendering {
  Vec3 force;       ///< N, on the hand
  Vec3 torque;      ///< N m, about the virtual tip: sum over contacts of (contact - tip) x force
  Vec3 device1;     ///< N, for the device at the tip
  Vec3 device2;     ///< N, for the device at the tail
  Contact deepest;  ///< type none in free space
  LineProbe ideal;  ///< of the deepest contact; the virtual probe itself in free space
  int contacts = 0;
  int object = -1;  ///< of the deepest contact
  std::uint32_t faults = 0;
};

class Renderer {
 public:
  virtual ~Renderer() = default;
  virtual const char* name() const = 0;
  /// Whether the side of the probe is felt: needs a device that senses 5 degrees of freedom, and a
  /// scene compiled with side contact.
  virtual bool side_contact() const = 0;
  /// \param dt  s since the last tick; only damping needs it
  virtual Rendering tick(const Scene& scene, RenderState& state, const LineProbe& probe,
                         double dt) const noexcept = 0;
};

const Renderer& point_renderer();  ///< only the tip is felt
const Renderer& ray_renderer();    ///< tip and side are felt

}  // namespace palpate
