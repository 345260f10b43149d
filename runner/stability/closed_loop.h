#pragma once
// Simulation of the sampled closed loop of hand, two devices at the ends of a stylus and renderer:
// does a contact come to rest or oscillate? For studies, not for the servo.

#include <string>

#include "protocols/protocol.h"
#include "rendering/renderer.h"
#include "rendering/scene.h"

namespace palpate::runner {

/// The hand's impedance at each end of the stylus.
struct EndImpedance {
  double stiffness = 0;  ///< N/m
  double damping = 0;    ///< N s/m
  double mass = 0;       ///< kg
};

struct LoopSettings {
  double rate = 1000;     ///< Hz
  double mass = 0.1;      ///< kg, of each end
  double damping = 0.25;  ///< N s/m, viscous, of each end
  double friction = 0;    ///< N, Coulomb, of each end
  double resolution = 0;  ///< m, of each end's reading; 0: exact
  int delay = 0;          ///< ticks from a reading to its force; 0: within the same tick
  EndImpedance hand;
  bool passivity_controller = false;
};

/// The contact that is pressed along -z; each end of the stylus moves along z only.
enum class ContactCase {
  wall,         ///< a plane, met by the tip
  edge,         ///< a cube's edge: the ray lies across it, the point touches a face near it
  sphere,       ///< met by the tip (point), by the side (ray)
  two_objects,  ///< the ray lies across two edges; the point is in a groove between two walls
};
inline constexpr ContactCase kContactCases[] = {ContactCase::wall, ContactCase::edge,
                                                ContactCase::sphere, ContactCase::two_objects};
const char* to_string(ContactCase contact_case);

/// A scene and the equilibrium of the stylus in it.
class LoopScene {
 public:
  LoopScene(ContactCase contact_case, protocols::RendererKind renderer,
            const stimuli::Material& material);

  const rendering::Scene& scene() const { return scene_; }
  const rendering::Renderer& renderer() const { return *renderer_; }
  const rendering::LineProbe& rest() const { return rest_; }  ///< 1 mm deep, m
  /// N along z on each end at rest, and the number of objects touched.
  double force_tip() const { return force_tip_; }
  double force_tail() const { return force_tail_; }
  int contacts() const { return contacts_; }

 private:
  const rendering::Renderer* renderer_;
  rendering::Scene scene_;
  rendering::LineProbe rest_;
  double force_tip_ = 0, force_tail_ = 0;
  int contacts_ = 0;
};

struct LoopOutcome {
  bool stable = false;
  double early_amplitude = 0;  ///< m, peak to peak, in the second quarter of the run
  double late_amplitude = 0;   ///< m, the same in the last quarter
  std::uint64_t ticks = 0;
};

/// Released 0.1 mm (tip) and 0.06 mm (tail) from equilibrium, under the constant force that holds
/// it there. Each end is integrated exactly (matrix exponential) under a force stylus_at_height_0
/// over the tick. Unstable: the amplitude grows beyond the effect of quantisation.
LoopOutcome run_loop(const LoopSettings& settings, const LoopScene& scene);

}  // namespace palpate::runner
