#pragma once
// Forces of an object beside its surface: force fields, and the knock of a contact.
// Added to the wrench of a tick, so a tick without them does not know of it. World frame, SI units.
// Nothing here throws or allocates.

#include <optional>
#include <vector>

#include "rendering/probe.h"
#include "stimuli/shapes.h"

namespace palpate::rendering {

class Scene;
struct RenderState;
struct Rendering;

/// The fields and the knock of one object.
struct ObjectEffects {
  int object = 0;      ///< index in the scene
  Pose pose;           ///< of the object's frame, at first
  bool moves = false;  ///< it is a body
  std::vector<stimuli::FieldSpec> fields;
  std::optional<stimuli::TransientSpec> transient;
};

struct SceneEffects {
  std::vector<ObjectEffects> objects;
  double grip = 0.06;  ///< m, from the virtual tip along the stylus
};

/// Both between ticks.
struct EffectsState {
  /// The knock of an object.
  struct Knock {
    bool touching = false;  ///< at the last tick
    bool sounding = false;
    double since = 0;  ///< s, since the first contact; not sounding: without contact
    double speed = 0;  ///< m/s, of the entry
    bool armed = true;
  };
  double time = 0;               ///< s, since the first tick
  std::vector<Vec3> velocities;  ///< m/s, of each field, after its low pass; world frame
  std::vector<Knock> knocks;     ///< of each object
  LineProbe last;
  bool has_last = false;
};

/// s without contact; then the next one knocks again.
inline constexpr double kArmedAfter = 0.02;
/// m/s; a faster entry knocks as this one does.
inline constexpr double kFastestEntry = 1;

/// N, of a field on a point of the stylus, in the object's frame.
/// \param place     m, of the point
/// \param velocity  m/s, of the point, after the low pass
/// \param time      s
/// \param touching  whether the object is in contact
Vec3 field_force(const stimuli::FieldSpec& field, const Vec3& place, const Vec3& velocity,
                 double time, bool touching);

/// The share of a new velocity in its one-pole low pass: T / (tau + T).
/// \param period  s, T > 0. \param low_pass  s, tau
inline double low_pass_share(double period, double low_pass) {
  return period / (low_pass + period);
}

/// N, added to the force along the normal `since` s after a contact at `speed` m/s.
double knock_force(const stimuli::TransientSpec& transient, double speed, double since);

/// W, that a sampled curl field puts into a hand that goes round a circle: it is not 0, since the
/// velocity is that of the last tick, filtered. Positive: the hand is driven, as where it turns
/// about the field's axis; the other way round it is braked. \param damping  N s/m. \param speed
/// m/s. \param turn  rad/s. \param period  s, of a tick \param low_pass  s
double curl_power(double damping, double speed, double turn, double period, double low_pass);

/// Adds fields and knocks to the wrench of a tick. A pose that is not finite gives no field.
/// \param side_contact  false: the force acts on the tip alone, without torque
/// \param dt  s, since the last tick
void add_effects(const Scene& scene, RenderState& state, const LineProbe& probe, double dt,
                 bool side_contact, Rendering& felt) noexcept;

}  // namespace palpate::rendering
