#pragma once
// The exploration of a simulated hand: it approaches from above, slides over the surface in a
// randomly changing direction with light pressure, lifts off and approaches again. It senses
// contact with a reaction delay and does not know the shape. If headings are chosen, the caller,
// which has beliefs about the shape, sets them.

#include <cstdint>
#include <vector>

#include "data/base/random.h"
#include "runner/participants/simulated_settings.h"

namespace palpate::runner::participants {

/// Contact that the hand senses at one tick.
struct TouchState {
  bool contact = false;
  Vec3 normal;       ///< unit, of the force
  Vec3 surface;      ///< m; sensed contact point
  double along = 0;  ///< m; from the tip along the stylus to that point
};

class Explorer {
 public:
  /// \param grip  m from the tip; \param wall_stiffness  N/m, determines the aim depth for a light
  /// force
  Explorer(const SimulatedSettings& settings, double grip, double wall_stiffness, double tick);

  /// Starts a trial with a random approach. \return its start pose
  devices::HandTarget begin(Random random);
  /// One tick. `now` and the stylus belong to this tick; contact in `now` takes effect only after
  /// the reaction delay. \param stylus_axis  unit, tip to tail
  devices::HandTarget step(const TouchState& now, const Vec3& stylus_tip, const Vec3& stylus_axis);

  /// Whether the sliding hand needs a new heading (settings.heading). Stays true until turn_to.
  bool wants_heading() const;
  /// Normal of the known contact, and the heading at right angles to it; unit. Valid while it
  /// slides.
  const Vec3& known_normal() const { return last_normal_; }
  const Vec3& heading() const { return heading_; }
  /// Turns from the present heading to this one in settings.heading.turning_time. Both are at right
  /// angles to the known normal.
  void turn_to(const Vec3& heading);

 private:
  enum class Motion { approach, follow, search, retreat };

  void draw_approach();
  Vec3 velocity(const TouchState& known);
  Vec3 search();
  Vec3 slide(const TouchState& known);
  Vec3 move_to_start();
  void turn_axis();
  void limit_force(const Vec3& held);

  SimulatedSettings settings_;
  double grip_, tick_;
  double aim_depth_;  ///< m; depth of the target below the sensed surface
  double
      max_offset_;  ///< m; largest distance of the target from the stylus, which limits the force
  double wander_;   ///< rad; standard deviation of the heading's change in a tick
  double turn_cosine_, turn_sine_;  ///< of the stylus' largest turn in a tick
  Random random_{0};
  std::vector<TouchState> past_;  ///< ring buffer over the reaction delay
  std::size_t now_ = 0;
  Motion motion_ = Motion::approach;
  Vec3 tip_, axis_{0, 0, 1};               ///< target pose
  Vec3 start_, aim_, goal_axis_{0, 0, 1};  ///< of the approach
  Vec3 heading_;                           ///< unit
  Vec3 last_normal_;                       ///< unit; of the last known contact
  double since_choice_ = 0;                ///< s
  double turn_rate_ = 0, turn_left_ = 0;   ///< rad/s and s, of a turn to a chosen heading
  double left_ = 0;                        ///< s left of this motion
};

}  // namespace palpate::runner::participants
