#pragma once
// How a simulated participant judges levels: one number with noise for each stimulus that is felt.
// A model that is not fitted to any person.
//
//   compare   each interval gives an estimate, its level with noise; the largest (smallest) is
//             chosen. Of two intervals, the comparison is chosen with probability
//             Phi((level - standard) / (sqrt(2) sd)) = Phi((level - standard) / (weber standard)).
//             same_different: differ by more than sd
//   detect    "yes" by a psychometric function (protocols/tasks/levels.h)
//   rate      number = level^exponent, times exp(noise)
//   adjust    feels both; turns as many times as it would take if what was felt were true; feels
//   what it
//             turned again; done when they are "same" by the criterion above, or less than half a
//             turn apart, or when it turns no further. What it did not touch it goes back to
//   identify  what differs in stiffness alone: the stimulus whose stiffness is nearest, as a ratio,
//   to
//             the estimate; shapes: SimulatedParticipant; else right, but for lapses
// With the share `lapse` any answer is given.

#include <optional>
#include <vector>

#include "data/base/random.h"
#include "protocols/protocol.h"
#include "protocols/schedule.h"
#include "runner/participants/shape_observer.h"
#include "runner/servo/sample.h"

namespace palpate::runner {

// What a hand tells of a level while it explores: one estimate for each interval.
//
//   stiffness   mean of force over depth, of ticks in contact, as the hand met them. Likewise where
//               identification is of things that differ in stiffness alone
//   a length    ("..._m") that the felt surface depends on: who knows what kind of object it is
//               takes the level whose surface passes through the places felt, least squares,
//               linear about the true level. The places have the noise of the model's percepts
//   any other   (friction, damping, depth of layers, angles, meshes): no estimate

class LevelPercept {
 public:
  /// \param protocol  must outlive it
  explicit LevelPercept(const protocols::Protocol& protocol) : protocol_(protocol) {}

  /// Before an interval. \param trial  of version 2
  void begin(const protocols::Trial& trial, const protocols::Interval& interval);
  void add(const Sample& sample);
  void add(const Percept& percept);
  int contact_ticks() const { return contact_ticks_; }

  /// As the hand met it: the participant's noise is to come.
  std::optional<double> stiffness() const;
  /// With the noise of the percepts.
  std::optional<double> length() const;

 private:
  void know_object(const protocols::TaskBlock& block, const protocols::Interval& interval);

  const protocols::Protocol& protocol_;
  Quat orientation_{1, 0, 0, 0};
  bool of_stiffness_ = false;
  double stiffness_sum_ = 0;  ///< N/m
  int contact_ticks_ = 0;
  std::optional<double> level_;  ///< m; none: no length
  double step_ = 0;              ///< m, from `object_` to `other_`
  stimuli::ObjectSpec object_, other_;
  double squares_ = 0, products_ = 0;  ///< of the normal equation
};

/// Whether the stimuli of a block are alike but for their stiffness.
bool differ_in_stiffness(const protocols::Protocol& protocol, const protocols::TaskBlock& block);

/// Whether two objects have the same form in the same place.
bool have_one_form(const stimuli::ObjectSpec& a, const stimuli::ObjectSpec& b);

struct JudgementSettings {
  double weber = 0.15;     ///< noise of a difference of two estimates, as a share of the standard
                           ///< (of the largest level where that is 0)
  double turn_sd = 3;      ///< degrees; the same where an orientation is judged
  double threshold = 0.5;  ///< detect: where, as a share of the range of levels, from the hard end
  double spread = 0.1;     ///< detect: sd of the function, likewise
  double false_alarm = 0.05;
  double lapse = 0.02;
  double exponent = 0.8;   ///< rate
  double number_sd = 0.1;  ///< rate: sd of the log
};

class TaskJudgement {
 public:
  /// \param protocol  must outlive it
  TaskJudgement(const protocols::Protocol& protocol, const JudgementSettings& settings)
      : protocol_(protocol), settings_(settings) {}

  /// Before the first interval of a trial.
  void begin(const protocols::Trial& trial, const Random& random);
  /// What an interval is felt as.
  struct Felt {
    std::optional<double> measured;  ///< level as the hand met it (above); none: the true one
    bool noisy = false;              ///< the noise is in it already
    bool touched = true;             ///< false: any level will do
  };
  void feel(const protocols::Interval& interval, const Felt& felt);
  /// The answer: index into TaskBlock::answers; rate without a scale: into nothing.
  int answer();
  /// adjust: key presses of the last answer, where it turns.
  int turns() const { return turns_; }
  double number();  ///< rate: a number typed
  int confidence(int steps) const;

 private:
  const protocols::TaskBlock& block() const;
  double level_of(const protocols::Interval& interval) const;
  int index_of(const char* name) const;
  std::optional<int> compared();
  int detected();
  int adjusted();
  int identified();
  double noise_of_difference(double reference) const;

  const protocols::Protocol& protocol_;
  JudgementSettings settings_;
  protocols::Trial trial_;
  Random random_{0};
  std::vector<double> estimates_;         ///< of the intervals so far
  std::optional<double> own_, standard_;  ///< adjust: as felt last
  double shown_ = 0;                      ///< adjust: level that own_ is of
  double noise_ = 0;                      ///< sd of a difference from the standard
  int turns_ = 1;
  bool feels_standard_ = false;
  double last_level_ = 0;
  bool measured_ = false;  ///< the last one was
  bool touched_ = true;    ///< likewise
  double evidence_ = 0;    ///< how clear the answer was, in sd
};

}  // namespace palpate::runner
