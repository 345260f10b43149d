#pragma once
// A stimulus at a level, where one number of it is another, and how a participant judges it.

#include <string>
#include <vector>

#include "protocols/protocol.h"

namespace palpate::protocols {

/// Stimulus `stimulus` of the protocol with the block's varied number at `level`; named
/// "NAME at LEVEL". \throws InputError: the stimulus cannot have it.
StimulusSpec at_level(const Protocol& protocol, const TaskBlock& block, int stimulus, double level);

/// Levels that a block may show: what cannot be shown at one of them is refused before the first
/// trial. Ascending, each once; empty: nothing is varied.
std::vector<double> levels_of(const TaskBlock& block);

/// The level that a stimulus has by itself; none: the number has no place in it.
std::optional<double> own_level(const Protocol& protocol, const TaskBlock& block, int stimulus);

/// Where the levels of a comparison of two intervals stand: 1, -1: all above, below that of the
/// standard (or at it); 0: on both sides, or nothing is compared.
int side_of_levels(const Protocol& protocol, const TaskBlock& block);

/// The protocol with a stimulus more for every level of every block; version 1: as it is.
Protocol with_all_levels(const Protocol& protocol);

/// "m", "N/m", "deg", ...: the unit of a varied number, of the end of its name; "1" without one.
/// \param path  JSON pointer
std::string unit_of_level(const std::string& path);

/// A level as it is printed: the shortest text that reads back as it.
std::string level_text(double level);

/// A level for people: rounded to four digits, with the unit of the block's varied number.
std::string level_in_words(const TaskBlock& block, double level);

// A simulated participant for a block whose levels are chosen by answers: a psychometric function
// made to measure, that of nobody.

struct TypicalSettings {
  double place = 0.5;    ///< of the threshold, as a share of the levels' range, from the hard end
  double spread = 0.15;  ///< sd of the function, likewise
  double false_alarm = 0.05;  ///< detect, same/different
  double lapse = 0.02;
};

/// Cumulative normal on the scale of the block's first adaptive procedure, with its easier levels.
/// compare: guesses 1 / intervals; with levels on both sides of the standard they are lapses as
/// well, as many as at the other end, and the threshold is at the standard. \param block  with
/// levels
PsychometricParticipant typical_participant(const Protocol& protocol, const TaskBlock& block,
                                            const TypicalSettings& settings = {});

/// The harder and easier end of a procedure's levels; constant stimuli tell neither: nullopt.
std::optional<Easier> easier_of(const ProcedureSpec& spec);
LevelScale procedure_scale(const ProcedureSpec& spec);  ///< constant stimuli: linear

}  // namespace palpate::protocols
