#pragma once
// The procedures of the blocks of a protocol, for the analysis of what they recorded.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "protocols/procedures/procedure.h"
#include "protocols/protocol.h"

namespace palpate::protocols {

/// The procedures that chose a block's levels.
struct BlockProcedures {
  std::uint64_t protocol_seed = 0;
  std::uint64_t index = 0;         ///< of the block in its protocol
  std::size_t tracks_of_cell = 0;  ///< of each cell that stands apart; 0: none does
  bool cells_share_tracks = false;
  std::vector<ProcedureSpec> specs;          ///< empty: none
  bool asks_smaller = false;                 ///< compare: the interval with the smaller level
  std::string level_unit{};                  ///< "N/m", ...; "1" without one, "": nothing is varied
  std::vector<LevelDimension> dimensions{};  ///< of several; empty: the level is one number
  std::vector<std::string> dimension_units{};  ///< "N/m", ...; "1": without
  std::vector<ScaleStep> rating_steps{};       ///< rate: of a labelled scale; empty: none

  /// The spec of a track, from 1.
  /// \pre specs is not empty
  const ProcedureSpec& spec_of(int track) const;
  /// A track before its first answer, as SessionPlan begins it.
  Procedure begin(int participant_number, int track) const;
};

/// The procedures of each block, by its name, of a protocol of version 2, without the files that
/// its stimuli need: for the analysis of an old study. Empty: version 1.
/// \throws InputError
std::map<std::string, BlockProcedures> procedures_of_blocks(const std::string& text,
                                                            const std::string& file_name);

}  // namespace palpate::protocols
