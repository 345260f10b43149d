#pragma once
// A hand, two devices at the ends of a stylus, and a renderer in a closed loop, sampled: does a
// contact come to rest, or does it buzz? For checks and plans, not for the servo.

#include <string>

#include "protocols/protocol.h"
#include "rendering/renderer.h"
#include "rendering/scene.h"

namespace palpate::runner {

/// What the hand does at each end, about where it wants the end to be.
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
  int delay = 0;          ///< ticks from a reading to its force, beyond the same tick
  EndImpedance hand;
  bool passivity_controller = false;
};

/// Where the stylus is pressed in along -z, each end free to move along z alone.
enum class Situation {
  wall,         ///< a plane, met by the tip
  edge,         ///< a cube's edge: the ray lies across it, the point meets a side near it
  sphere,       ///< met by the tip (point), by the side (ray)
  two_objects,  ///< the ray lies across two edges; the point is in a groove between two walls
};
inline constexpr Situation kSituations[] = {Situation::wall, Situation::edge, Situation::sphere,
                                            Situation::two_objects};
const char* to_string(Situation situation);

/// A scene and how the stylus rests in it before the loop begins.
class LoopScene {
 public:
  LoopScene(Situation situation, protocols::RendererKind renderer,
            const stimuli::Material& material);

  const rendering::Scene& scene() const { return scene_; }
  const rendering::Renderer& renderer() const { return *renderer_; }
  const rendering::LineProbe& rest() const { return rest_; }  ///< 1 mm deep, m
  /// N along z on each end at rest, and how many objects give it.
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
  double early = 0, late = 0;  ///< m, of the springs, from crest to trough, early and late
  std::uint64_t ticks = 0;
};

/// Let go 0.1 mm (tip) and 0.06 mm (tail) off its rest, under the force that holds it there. The
/// linear part of each end moves exactly (matrix exponential) under a force that is held over the
/// tick. Unstable: the motion grows, beyond what a count of the resolution makes.
LoopOutcome run_loop(const LoopSettings& settings, const LoopScene& scene);

}  // namespace palpate::runner
