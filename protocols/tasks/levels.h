#pragma once
// A stimulus at a level (with one of its numbers replaced), and a participant's judgement of it.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "protocols/parse.h"
#include "protocols/protocol.h"
#include "protocols/schedule.h"

namespace palpate::protocols {

/// Stimulus `stimulus` of the protocol with the block's varied number at `level`; named "NAME at
/// LEVEL".
/// \throws InputError: the stimulus cannot have that level
StimulusSpec at_level(const Protocol& protocol, const TaskBlock& block, int stimulus, double level);

/// The same with several numbers at the place of a point: those of the standard, or those of what
/// is compared with it. \pre the block has dimensions
/// \throws InputError: the stimulus cannot have them
StimulusSpec at_point(const Protocol& protocol, const TaskBlock& block, int stimulus,
                      const LevelPoint& point, bool standard);

/// The stimulus of an interval as it is shown. \pre it has one
/// \throws InputError
StimulusSpec shown_stimulus(const Protocol& protocol, const TaskBlock& block,
                            const Interval& interval);

/// The numbers of a stimulus that the block varies: of its level, or of its dimensions.
std::vector<LevelTarget> targets_of(const TaskBlock& block);

/// The stimuli of a block whose numbers can be varied: those that are shown, or, of a comparison,
/// its standards, each once.
std::vector<int> varied_stimuli(const TaskBlock& block, bool standard);

/// The dimension that answers are about: the first of the comparison.
/// \pre the block has dimensions
const LevelDimension& judged_dimension(const TaskBlock& block);
/// Of an interval at a point, the value at the path of the judged dimension; none: it has none.
std::optional<double> judged_value(const Protocol& protocol, const TaskBlock& block,
                                   const Interval& interval);

/// "standard 300, comparison 350".
std::string point_text(const TaskBlock& block, const LevelPoint& point);

/// Points that a block may show; a stimulus that cannot have one of them is refused before the
/// first trial. Each once, in order; empty: it has no dimensions.
std::vector<LevelPoint> points_of(const TaskBlock& block);

/// The least and most of each dimension, over the procedures of a block.
/// \pre the block has dimensions
std::vector<DimensionRange> ranges_of(const TaskBlock& block);

/// Levels that a block may show; a stimulus that cannot have one of them is refused before the
/// first trial. Ascending, each once; empty: nothing is varied.
std::vector<double> levels_of(const TaskBlock& block);

/// A stimulus's own level; none: it lacks that number.
std::optional<double> own_level(const Protocol& protocol, const TaskBlock& block, int stimulus);

/// The side of the standard on which the levels of a comparison of two intervals lie: 1: all at or
/// above it, -1: all at or below it, 0: on both sides, or no comparison.
int side_of_levels(const Protocol& protocol, const TaskBlock& block);

/// Calls fault(stimulus, point, as the standard, fault) for each stimulus that cannot have a point
/// of the block.
void check_points(const Protocol& protocol, const TaskBlock& block,
                  const std::function<void(int, const LevelPoint&, bool, const Fault&)>& fault);

/// The protocol with an additional stimulus for every level of every block; version 1: unchanged.
Protocol with_all_levels(const Protocol& protocol);

/// "m", "N/m", "deg", ...: the unit of a varied number, from the end of its name; "1": no unit.
/// \param path  JSON pointer
std::string unit_of_level(const std::string& path);

/// The varied number for people: "stiffness" for "/stiffness_n_per_m", "size" for "/size_m/0".
/// \param path  JSON pointer
std::string level_name(const std::string& path);

/// The shortest text that reads back as the same level.
std::string level_text(double level);

/// A level for people: rounded to four digits, with the unit of the block's varied number.
std::string level_in_words(const TaskBlock& block, double level);
/// The same of a varied number. \param path  JSON pointer
std::string number_in_words(const std::string& path, double number);

/// Of a simulated participant for a block with adaptive levels: a generic psychometric function
/// fitted to the block's range, not a model of a person.
struct TypicalSettings {
  double place = 0.5;    ///< of the threshold, as a share of the levels' range, from the hard end
  double spread = 0.15;  ///< sd of the function, likewise
  double false_alarm = 0.05;  ///< detect, same/different
  double lapse = 0.02;
};

/// Probability with which a participant succeeds at the point of a trial: by the function of its
/// QUEST+ in the middle of its grids; without one, in compare by the differences between what is
/// compared (a Weber fraction of 0.15), else by the mean of the dimensions' places in their ranges.
/// \pre the trial has a point
double typical_success(const Protocol& protocol, const Trial& trial,
                       const TypicalSettings& settings = {});

/// Cumulative normal on the scale of the block's first adaptive procedure, with its easier levels.
/// compare: the guess rate is 1 / intervals; with levels on both sides of the standard, guess and
/// lapse rates are equal and the threshold is at the standard.
/// \param block  with levels
PsychometricParticipant typical_participant(const Protocol& protocol, const TaskBlock& block,
                                            const TypicalSettings& settings = {});

}  // namespace palpate::protocols
