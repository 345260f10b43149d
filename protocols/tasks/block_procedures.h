#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "protocols/procedures/procedure.h"

namespace palpate::protocols {

/// How the levels of a block were chosen.
struct BlockProcedures {
  std::uint64_t protocol_seed = 0;
  std::uint64_t index = 0;           ///< of the block in its protocol
  std::vector<ProcedureSpec> specs;  ///< empty: none
  bool asks_smaller = false;         ///< compare: the interval with the smaller level
  std::string level_unit{};          ///< "N/m", ...; "1" without one, "": nothing is varied

  /// Of a track, from 1. \pre specs is not empty
  const ProcedureSpec& spec_of(int track) const;
  /// A track before its first answer, as TaskPlan begins it.
  Procedure begin(int participant_number, int track) const;
};

/// Of each block of a protocol of version 2 by its name, without the files that its stimuli need:
/// what a study that is analysed long after was shown by. Empty: version 1. \throws InputError
std::map<std::string, BlockProcedures> procedures_of_blocks(const std::string& text,
                                                            const std::string& file_name);

}  // namespace palpate::protocols
