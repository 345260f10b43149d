#pragma once
// A simulated participant: explores, perceives with noise, decides and answers. The model is not
// fitted to any person; all its data are labelled as simulated.

#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <vector>

#include "data/base/random.h"
#include "runner/participants/heading_choice.h"
#include "runner/participants/respondent.h"
#include "runner/participants/shape_observer.h"
#include "runner/participants/simulated_settings.h"

namespace palpate::runner::participants {

/// Contact that the hand senses at one tick.
struct TouchState {
  bool contact = false;
  Vec3 normal;       ///< unit, of the force
  Vec3 surface;      ///< m; sensed contact point
  double along = 0;  ///< m; from the tip along the stylus to that point
};

/// The exploration of a simulated hand: it approaches from above, slides over the surface in a
/// randomly changing direction with light pressure, lifts off and approaches again. It senses
/// contact with a reaction delay and does not know the shape. If headings are chosen, the caller,
/// which has beliefs about the shape, sets them.
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

/// A trial cannot begin: the stylus rests outside the home zone. what() names participant, trial
/// and settings.
class StuckParticipant : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

class SimulatedParticipant final : public Respondent {
 public:
  /// \param own  settings of this individual. \param number  its number. Every trial has its own
  /// random stream, seeded with `seed`, number, session and trial, so it does not depend on earlier
  /// trials. \param hypotheses, stylus, protocol  must outlive it
  SimulatedParticipant(const SimulatedSettings& own, const ShapeHypotheses& hypotheses,
                       devices::SimulatedStylus& stylus, const protocols::Protocol& protocol,
                       std::uint64_t seed, int number);

  void read(const std::string&) override {}
  void feedback(bool) override {}  // without effect: it does not learn
  void begin_trial(const protocols::Trial& trial) override;
  /// \throws StuckParticipant
  std::optional<Answer> step(const servo::Sample& sample) override;
  /// The percept of the last step; none: nothing new.
  const std::optional<Percept>& percept() const { return percept_; }
  /// Posterior of the most probable shape.
  double certainty() const { return observer_.probability(observer_.best()); }

 private:
  void wait_for_time_zero(const servo::Sample& sample);
  /// The stylus of a sample, in the form that hand and percepts need.
  struct SensedStylus {
    explicit SensedStylus(const rendering::LineProbe& probe);
    Vec3 span;      ///< m, tip to tail
    double length;  ///< m
    Vec3 axis;      ///< unit
  };
  void move_hand(const TouchState& touch, const Vec3& tip, const Vec3& axis);
  /// Converts from the explorer's frame to the device's.
  void put_in_device(devices::HandTarget& target) const;
  Vec3 explored(const Vec3& world) const;
  Vec3 explored_in_world(const Vec3& explored) const;
  TouchState sense_touch(const servo::Sample& sample, const SensedStylus& stylus);
  Vec3 perceived_shift() const;
  Percept perceive(const servo::Sample& sample, const SensedStylus& stylus,
                   const TouchState& touch);
  void choose_heading(const servo::Sample& sample, const TouchState& touch);

  SimulatedSettings settings_;
  devices::SimulatedStylus& stylus_;
  const protocols::Protocol& protocol_;
  double wall_stiffness_, period_, low_pass_;
  double surely_unfelt2_;  ///< N^2; below it a force is certainly not felt
  std::uint64_t seed_;
  int number_;
  WorkspaceMap workspace_;
  bool far_;        ///< the hand is far from the object, beyond a stylus that reaches farther
  Quat hand_side_;  ///< rotates the explorer's up to the direction from object to hand
  Explorer explorer_;
  ShapeObserver observer_;
  HeadingChoice heading_choice_;
  Random random_{0}, heading_random_{0};
  bool ray_ = false;
  protocols::Trial trial_;
  std::int64_t ticks_before_ = 0;  ///< of this trial, before time zero
  Vec3 centre_error_;              ///< m; error of the believed centre
  Vec3 force_, torque_;            ///< low-passed: N on the hand, N m about the tip
  bool along_known_ = false;  ///< force and stylus are not parallel, so that torque gives `along`
  double next_percept_ = 0;   ///< s from time zero
  std::optional<double> answer_at_;    ///< s from time zero
  bool touched_ = false;               ///< there was a percept with contact
  Vec3 touched_tip_, touched_normal_;  ///< at the last such percept: m, and unit
  std::optional<Percept> percept_;     ///< of the last step
};

}  // namespace palpate::runner::participants
