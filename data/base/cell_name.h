#pragma once
// The name of a stimulus in a cell of crossed factors, as it is stored with a trial:
// "soft[surface=rough,damping=high]". Names that people give have no brackets.

#include <string>
#include <utility>
#include <vector>

namespace palpate {

struct CellName {
  std::string base;                                           ///< "soft"
  std::vector<std::pair<std::string, std::string>> levels{};  ///< factor, level; empty: no factors
  /// The level of a factor; "": the stimulus is in no cell of it.
  const std::string& level(const std::string& factor) const;
  /// "soft[surface=rough,damping=high]"
  std::string text() const;
};

/// A stored name in parts; a name without factors is its own base.
CellName cell_name(const std::string& stored);
/// The part before the levels.
std::string base_name(const std::string& stored);

}  // namespace palpate
