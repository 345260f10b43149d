#pragma once
// A simulated participant for all tasks. It identifies shapes as SimulatedParticipant does, percept
// by percept. In all other tasks it explores likewise for a while and judges levels from contact if
// contact reveals them; the model is given the other levels. It reaches as Reacher.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "data/base/random.h"
#include "protocols/protocol.h"
#include "protocols/schedule.h"
#include "runner/participants/cue_combination.h"
#include "runner/participants/reacher.h"
#include "runner/participants/respondent.h"
#include "runner/participants/shape_observer.h"
#include "runner/participants/simulated.h"
#include "runner/servo/sample.h"
#include "stimuli/polygon_soup.h"

namespace palpate::runner::participants {

/// Estimates a level from exploration: one estimate for each interval.
///
///   stiffness   mean of force over depth in ticks with contact, without noise. Also used to
///               identify stimuli that differ in stiffness only
///   a length    ("..._m") that changes the felt surface: knowing the kind of object, it takes
///               the level whose surface passes best through the felt places (least squares,
///               linearised at the true level). The places have the noise of the model's percepts
///   any other   (friction, damping, depth of layers, angles, meshes): no estimate
class LevelPercept {
 public:
  /// \param protocol  must outlive it
  explicit LevelPercept(const protocols::Protocol& protocol) : protocol_(protocol) {}

  /// Before an interval. \param trial  of version 2
  void begin(const protocols::Trial& trial, const protocols::Interval& interval);
  void add(const servo::Sample& sample);
  void add(const Percept& percept);
  int contact_ticks() const { return contact_ticks_; }

  /// Without noise: the participant's is added later.
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
  double step_ = 0;              ///< m, change of the level from `object_` to `other_`
  stimuli::ObjectSpec object_, other_;
  double squares_ = 0, products_ = 0;  ///< of the normal equation
};

/// Whether the stimuli of a block differ in stiffness only.
bool differ_in_stiffness(const protocols::Protocol& protocol, const protocols::TaskBlock& block);

/// Whether two objects have the same form in the same place.
bool have_one_form(const stimuli::ObjectSpec& a, const stimuli::ObjectSpec& b);

struct JudgementSettings {
  double weber = 0.15;     ///< noise of a difference of two estimates, as a share of the standard
                           ///< (of the largest level where that is 0)
  double turn_sd = 3;      ///< degrees; the same where an orientation is judged
  double threshold = 0.5;  ///< detect: as a share of the range of levels from the hard end
  double spread = 0.1;     ///< detect: sd of the function, likewise
  double false_alarm = 0.05;
  double lapse = 0.02;
  double exponent = 0.8;  ///< rate
  /// rate, where the level is a texture's period: for 13 of 23 people numbers fall with it
  /// (Kornbrot et al. 2007, sinusoids of 0.675 to 20.7 mm through a probe). A number, no model of
  /// roughness.
  double period_exponent = -0.80;
  double number_sd = 0.1;  ///< rate: sd of the log

  // Of a person whom a plan describes; by default nothing is added.
  /// compare, adjust: the comparison feels less by so many standard deviations of a difference, so
  /// the PSE is higher.
  double shift = 0;
  double threshold_log_ratio = 0;       ///< compare, detect: the threshold is exp() times as high
  std::optional<double> share_correct;  ///< identify: instead of a judgement
  /// rate without exponent: steps from the middle of the scale, and of single ratings.
  double rating = 0, rating_sd = 0;
  std::optional<double> time;  ///< s, of the answer; none: as long as exploring takes
};

/// The judgement of participant 1, 2, ... in a trial, for a study that a plan describes. It judges
/// the true levels, not what was felt.
using JudgementOf = std::function<JudgementSettings(int, const protocols::Trial&)>;

/// How a simulated participant judges levels: one noisy estimate for each felt stimulus. A model
/// that is not fitted to any person.
///
///   compare   each interval gives an estimate, its level with noise; the largest (smallest) is
///             chosen. Of two intervals, the comparison is chosen with probability
///             Phi((level - standard) / (sqrt(2) sd)) = Phi((level - standard) / (weber standard)).
///             same_different: differ by more than sd
///   detect    "yes" by a psychometric function (protocols/tasks/levels.h)
///   rate      number = level^exponent, times exp(noise)
///   adjust    feels both; turns as often as needed if its estimates were true; feels the turned
///             one again; done when they are "same" by the criterion above, or less than half a
///             turn apart, or when it turns no further. Returns to an interval that it did not
///             touch
///   identify  stimuli that differ in stiffness only: the nearest stiffness, as a ratio, to the
///             estimate; shapes: SimulatedParticipant; else correct, except for lapses
/// With probability `lapse` the answer is random.
///
/// Where a protocol has a view, the felt estimate is the true level with that noise, whatever the
/// hand measured, so that its sd is known; what is seen of an interval gives a second estimate, and
/// both are combined (cue_combination.h). Blur adds to its sd where the level is a length.
class TaskJudgement {
 public:
  /// \param protocol  must outlive it
  TaskJudgement(const protocols::Protocol& protocol, const JudgementSettings& settings,
                const CueSettings& cues = {})
      : protocol_(protocol), settings_(settings), cues_(cues) {}

  void set(const JudgementSettings& settings) { settings_ = settings; }
  /// Before the first interval of a trial.
  void begin(const protocols::Trial& trial, const Random& random);
  /// The sensation of an interval.
  struct Felt {
    std::optional<double> measured;  ///< measured level (above); none: the true one
    bool noisy = false;              ///< `measured` includes the noise already
    bool touched = true;             ///< false: the level was not felt
  };
  void feel(const protocols::Interval& interval, const Felt& felt);
  /// The answer: index into TaskBlock::answers; rate without a scale: into nothing.
  int answer();
  /// adjust: key presses of the last answer, if it turns.
  int turns() const { return turns_; }
  double number();  ///< rate: the number typed
  int confidence(int steps) const;

 private:
  const protocols::TaskBlock& block() const;
  double level_of(const protocols::Interval& interval) const;
  /// Levels of the number that answers are about: all of one, the ends of a dimension.
  std::vector<double> levels() const;
  protocols::Interval standard_interval() const;  ///< \pre the block has a standard
  int index_of(const char* name) const;
  std::optional<int> compared();
  int detected();
  int adjusted();
  int identified();
  int rated(std::uint64_t steps);
  double noise_of_difference(double reference) const;
  double planned_noise(double noise, double reference) const;
  struct Sight;
  Sight sight_of(const protocols::Interval& interval) const;
  double with_sight(const protocols::Interval& interval, std::optional<double> felt, double sd);

  const protocols::Protocol& protocol_;
  JudgementSettings settings_;
  CueSettings cues_;
  std::optional<double> look_;  ///< switching: drawn once a trial, 0 to 1
  protocols::Trial trial_;
  Random random_{0};
  std::vector<double> estimates_;         ///< of the intervals so far
  std::optional<double> own_, standard_;  ///< adjust: as last felt
  double shown_ = 0;                      ///< adjust: level at which own_ was felt
  double noise_ = 0;                      ///< sd of a difference from the standard
  int turns_ = 1;
  bool feels_standard_ = false;
  double last_level_ = 0;
  bool measured_ = false;  ///< whether the last interval was
  bool touched_ = true;    ///< likewise
  double evidence_ = 0;    ///< how clear the answer was, in sd
};

/// Hypotheses for each block of a protocol; null: nothing to identify, or stimuli of one shape.
using BlockHypotheses = std::vector<std::shared_ptr<const ShapeHypotheses>>;
/// Reasons why stimuli of a block that asks for the shape alone cannot be told.
std::vector<std::string> unknown_shapes(const protocols::Protocol& protocol);
/// \throws MeshError
BlockHypotheses block_hypotheses(const protocols::Protocol& protocol);

class TaskParticipant final : public Respondent {
 public:
  /// As SimulatedParticipant. \param hypotheses  for exploration. \param of_blocks  for
  /// identification; must outlive it, too \param planned  empty: judges what it feels
  TaskParticipant(const SimulatedSettings& own, const ShapeHypotheses& hypotheses,
                  const BlockHypotheses& of_blocks, devices::SimulatedStylus& stylus,
                  const protocols::Protocol& protocol, std::uint64_t seed, int number,
                  JudgementOf planned = {});

  void read(const std::string&) override {}
  void feedback(bool) override {}
  void begin_trial(const protocols::Trial& trial) override;
  void begin_interval(const protocols::Trial& trial, const IntervalView& view) override;
  std::optional<Answer> step(const servo::Sample& sample) override;
  void learn_from(const data::TrialRecord& record) override { reacher_.learn(record); }
  std::optional<Answer> confidence(const protocols::ConfidenceSpec& asked) override;
  std::optional<std::string> ask(const protocols::PageSpec& page, const protocols::PageItem& item,
                                 const Asking& how) override;

 private:
  Answer answer(std::int64_t time_ns);
  const protocols::TaskBlock& block() const;
  std::optional<Answer> identify(const servo::Sample& sample);
  std::optional<Answer> step_as_planned(const servo::Sample& sample);

  const protocols::Protocol& protocol_;
  SimulatedParticipant hand_;
  /// Participants by the hypotheses that they identify.
  std::map<const ShapeHypotheses*, SimulatedParticipant> identifiers_;
  const BlockHypotheses& of_blocks_;
  SimulatedParticipant* identifier_ = nullptr;  ///< of this trial
  Reacher reacher_;
  TaskJudgement judgement_;
  JudgementOf planned_;
  JudgementSettings planned_now_;  ///< of this trial
  LevelPercept percept_;
  std::uint64_t seed_;
  int number_;
  protocols::Trial trial_;
  IntervalView view_;
  int felt_ = 0;  ///< intervals of the trial so far
  double period_;
  std::int64_t answered_ns_ = 0;
  bool judged_ = false;   ///< in this interval
  double look_ = 0;       ///< s of exploration in it
  bool limited_ = false;  ///< it ends by itself
};

}  // namespace palpate::runner::participants
