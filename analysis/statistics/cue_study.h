#pragma once
// The answers of a study of seen and felt cues, as its protocol declares the blocks.

#include <string>
#include <vector>

#include "analysis/input/study_table.h"
#include "analysis/statistics/cues.h"

namespace palpate::analysis {

/// The key `cues` of a protocol.
struct CueDesign {
  struct Both {
    std::string block;
    double ratio = 1;            ///< of the seen standard by the felt one
    std::optional<double> seen;  ///< the seen standard; none: `ratio` tells
  };
  std::string haptic, visual;  ///< blocks
  std::vector<Both> both;
  std::string level_path;  ///< of the number that is compared
  bool asks_smaller = false;
};

/// \return none: the protocol declares no cues \throws nlohmann::json::exception: it has faults
std::optional<CueDesign> read_cue_design(const std::string& text);

/// By participant in the order of the table: all trials that count and were answered.
std::vector<CueAnswers> cue_answers(const StudyTable& table, const CueDesign& design);

}  // namespace palpate::analysis
