#pragma once
// The stability boundary of a haptic loop: by simulation of the sampled closed loop of hand, two
// devices at the ends of a stylus and renderer (does a contact come to rest or oscillate?), and the
// passivity condition of theory. For studies, not for the servo.

#include <cstdint>
#include <optional>

#include "protocols/protocol.h"
#include "rendering/reach.h"
#include "rendering/renderer.h"
#include "rendering/scene.h"

namespace palpate::runner::evidence {

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
  std::optional<rendering::Reach> reach = std::nullopt;  ///< of the virtual stylus

  /// Whether forces are linear in the motion during contact, so that a swing grows or shrinks
  /// forever.
  bool linear() const { return friction == 0 && resolution == 0 && !passivity_controller; }
};

/// The contact that is pressed along -z; each end of the stylus moves along z only.
enum class ContactCase {
  wall,          ///< a plane, met by the tip
  edge,          ///< a cube's edge: the ray lies across it, the point touches a face near it
  sphere,        ///< met by the tip (point), by the side (ray)
  two_objects,   ///< the ray lies across two edges; the point is in a groove between two walls
  body,          ///< a body of 10 g that can move and lies on a plane, met by the tip
  groove,        ///< between two walls of one object, 60 degrees, met by the tip
  concave_edge,  ///< of a closed surface, 90 degrees, met by the tip
  tool,          ///< a cross at the tip lies across two edges; with the ray renderer alone
};
inline constexpr ContactCase kContactCases[] = {ContactCase::wall, ContactCase::edge,
                                                ContactCase::sphere, ContactCase::two_objects,
                                                ContactCase::body};
/// The objects felt by one ideal tool at several places.
inline constexpr ContactCase kConcaveCases[] = {ContactCase::groove, ContactCase::concave_edge,
                                                ContactCase::tool};
const char* to_string(ContactCase contact_case);

/// A scene and the equilibrium of the stylus in it.
class LoopScene {
 public:
  LoopScene(ContactCase contact_case, protocols::RendererKind renderer,
            const stimuli::Material& material);
  /// Any scene, turned so that the contact pushes along +z.
  /// \param start  2 mm below it is a place of contact
  /// \throws std::runtime_error: there is none within 10 mm
  LoopScene(rendering::Scene scene, const rendering::Renderer& renderer,
            const rendering::LineProbe& start);

  const rendering::Scene& scene() const { return scene_; }
  const rendering::Renderer& renderer() const { return *renderer_; }
  const rendering::LineProbe& rest() const { return rest_; }  ///< 1 mm deep, m
  /// N along z on each end at rest, and the number of objects touched.
  double force_tip() const { return force_tip_; }
  double force_tail() const { return force_tail_; }
  int contacts() const { return contacts_; }
  double stiffness() const;  ///< N/m, of the contact along z, at the virtual stylus
  /// m, above rest: a place from which the way down is free.
  double approach() const { return approach_; }

 private:
  void settle(const rendering::LineProbe& start, double slow, double step);

  const rendering::Renderer* renderer_;
  rendering::Scene scene_;
  rendering::LineProbe rest_;
  double force_tip_ = 0, force_tail_ = 0;
  int contacts_ = 0;
  double approach_ = 5e-3;
};

/// Swings are of the contact (its force over its stiffness), peak to peak, m.
struct LoopOutcome {
  bool stable = false;
  double initial_swing = 0;  ///< at the release
  double early_swing = 0;    ///< in the second quarter of the run
  double late_swing = 0;     ///< in the last quarter; infinite: it diverged
  double floor = 0;          ///< a smaller swing counts as rest
  std::uint64_t ticks = 0;
};

/// Whether a swing has come to rest. A limit cycle, which neither grows nor rests, is unstable.
enum class Verdict {
  stable,
  unstable,
  open,  ///< it shrinks and needs a longer run
};
Verdict verdict_on(const LoopOutcome& so_far, bool linear);

/// Releases the stylus 0.1 mm (tip) and 0.06 mm (tail) from equilibrium, under the constant force
/// that holds it there. Each end is integrated exactly (matrix exponential) under a force held over
/// the tick. Stable: the final swing is within three steps of the resolution, or within a hundredth
/// of the initial swing, or still shrinks. It runs 40 periods or, if that is inconclusive, up to 64
/// times as long.
LoopOutcome run_loop(const LoopSettings& settings, const LoopScene& scene);

/// A loop without the two quantities that span the boundary: stiffness and physical damping.
struct LoopCase {
  ContactCase contact_case = ContactCase::wall;
  protocols::RendererKind renderer = protocols::RendererKind::point;
  LoopSettings settings;       ///< the damping is ignored
  double virtual_damping = 0;  ///< N s/m, of the material
  /// Stiffness of a layer half as deep as the contact, as a share of the surface's; 0: none.
  double layer_share = 0;
  /// The mass of each end is chosen so that it oscillates 60 times more slowly than the sampling
  /// rate: the case of the theory, which is independent of the mass. False: settings.mass.
  bool heavy = false;
};

struct BoundaryPoint {
  double stiffness = 0;  ///< N/m
  double measured = 0;   ///< N s/m, smallest stable damping of each end; 0: stable without damping
  double theory = 0;     ///< N s/m, passive with any hand
  /// The theory applies: friction dissipates the effect of quantisation (K <= 2 f_c / Delta).
  bool promised = true;

  /// Unstable although the theory promises passivity.
  bool unsafe() const { return promised && measured > 1.001 * theory; }
};

/// K (T/2 + t_d) + |B|, with the effective K and B: of surface and layer together, and through the
/// lever of a reach, for contact at the virtual tip. Colgate & Schenkel 1997.
double passive_damping(const LoopCase& loop, double stiffness);

/// Whether run_loop() finds rest with this stiffness, N/m, and damping of each end, N s/m.
bool is_stable(const LoopCase& loop, double stiffness, double damping);

BoundaryPoint boundary_at(const LoopCase& loop, double stiffness);

/// N s/m, the smallest damping of each end at which a loop is stable, within `close` (a ratio above
/// 1); 0: stable without damping; infinity: no damping helps. \param settings  its damping is
/// ignored
double least_stable_damping(const LoopSettings& settings, const LoopScene& scene, double close);

/// Largest stiffness, N/m, at most 10^7, up to which all are stable with this damping of each end.
double stiffest_stable(const LoopCase& loop, double damping);

}  // namespace palpate::runner::evidence
