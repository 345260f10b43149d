#pragma once
// A stimulus at a level (with one of its numbers replaced), and a participant's judgement of it.

#include <string>
#include <vector>

#include "protocols/protocol.h"

namespace palpate::protocols {

/// Stimulus `stimulus` of the protocol with the block's varied number at `level`; named "NAME at
/// LEVEL".
/// \throws InputError: the stimulus cannot have that level
StimulusSpec at_level(const Protocol& protocol, const TaskBlock& block, int stimulus, double level);

/// Levels that a block may show; a stimulus that cannot have one of them is refused before the
/// first trial. Ascending, each once; empty: nothing is varied.
std::vector<double> levels_of(const TaskBlock& block);

/// A stimulus's own level; none: it lacks that number.
std::optional<double> own_level(const Protocol& protocol, const TaskBlock& block, int stimulus);

/// The side of the standard on which the levels of a comparison of two intervals lie: 1: all at or
/// above it, -1: all at or below it, 0: on both sides, or no comparison.
int side_of_levels(const Protocol& protocol, const TaskBlock& block);

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

// A simulated participant for a block with adaptive levels: a generic psychometric function fitted
// to the block's range, not a model of a person.

struct TypicalSettings {
  double place = 0.5;    ///< of the threshold, as a share of the levels' range, from the hard end
  double spread = 0.15;  ///< sd of the function, likewise
  double false_alarm = 0.05;  ///< detect, same/different
  double lapse = 0.02;
};

/// Cumulative normal on the scale of the block's first adaptive procedure, with its easier levels.
/// compare: the guess rate is 1 / intervals; with levels on both sides of the standard, guess and
/// lapse rates are equal and the threshold is at the standard.
/// \param block  with levels
PsychometricParticipant typical_participant(const Protocol& protocol, const TaskBlock& block,
                                            const TypicalSettings& settings = {});

}  // namespace palpate::protocols
