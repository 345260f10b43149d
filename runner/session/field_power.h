#pragma once
// The power that the fields which depend on velocity put into the hand, as a session measures it.

#include <vector>

#include "rendering/fields.h"
#include "rendering/scene.h"
#include "runner/servo/sample.h"

namespace palpate::runner::session {

/// Measures viscous and curl fields of objects that do not move: the force of each tick acts until
/// the next one, so it does the work force . displacement. A curl field would do none if it were
/// not sampled and filtered (rendering/fields.h, curl_power).
class FieldPower {
 public:
  static constexpr double kMemory = 0.1;  ///< s, of the mean

  /// Begins with the fields of a scene. \param side_contact  as add_effects takes it
  void begin(const rendering::Scene& scene, bool side_contact);
  /// The next tick with forces on. Does not allocate.
  void add(const servo::Sample& sample) noexcept;
  /// Whether the scene has such fields.
  bool measures() const { return !fields_.empty(); }
  double watts() const { return watts_; }  ///< mean, positive: into the hand

 private:
  struct Field {
    stimuli::FieldSpec spec;
    Quat orientation;     ///< of its object, virtual world
    Vec3 velocity, last;  ///< m/s after its low pass; m, of its point of the stylus
    Vec3 force;           ///< N, of the last tick
  };
  std::vector<Field> fields_;
  double grip_ = 0;  ///< m, from the virtual tip
  bool side_contact_ = false, has_last_ = false;
  double watts_ = 0;
};

}  // namespace palpate::runner::session
