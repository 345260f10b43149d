#pragma once
// The parts of a protocol's stored text that tables and analyses read. Not validated again: it was
// valid when stored, and its mesh files may be missing now. What the text does not have, or has as
// another type, keeps its default.

#include <string>
#include <utility>
#include <vector>

#include "data/base/group_assignment.h"
#include "data/record.h"

namespace palpate::data {

struct StoredBlock {
  std::string name, task;
  bool practice = false;
  std::vector<std::string> renderers, stimuli;  ///< names, in the block's order
  std::vector<std::string> dimensions = {};     ///< names; empty: the level is one number, or none
  /// Of the factors that it crosses, the factor and level of each in each cell, the last factor's
  /// levels innermost. Empty: none, or tracks go on over all cells.
  std::vector<std::vector<std::pair<std::string, std::string>>> cells = {};
};

/// A question of a page whose answer describes the participant: age, sex, handedness.
struct StoredColumn {
  std::string column, page, item, question;
  bool number = false;
  std::vector<std::string> choices;  ///< empty: any text or number
};

/// A factor within participants besides renderer, stimulus and level.
struct StoredFactor {
  std::string name;
  std::vector<std::pair<std::string, std::string>> levels;  ///< name, JSON of what it sets
};

struct StoredProtocol {
  std::string name, title, description;  ///< "": none
  std::string seed;                      ///< of the trial orders, as written; "": none
  std::vector<std::string> stimuli;      ///< names, in the protocol's order
  int repetitions = 0;                   ///< of a protocol without blocks
  std::vector<StoredBlock> blocks;       ///< empty: version 1
  std::vector<StoredColumn> columns;     ///< of participants
  GroupAssignment groups;                ///< of participants
  std::vector<StoredFactor> factors;     ///< empty: none
  bool has_view = false;                 ///< something may be seen beside touch
  bool has_sound = false;                ///< contacts of a stimulus may be heard
  std::vector<std::string> tests;        ///< effects to adjust p values over; empty: all
};

StoredProtocol read_stored_protocol(const std::string& text);

/// Whether any of them has blocks of tasks.
bool have_blocks(const std::vector<std::string>& texts);

}  // namespace palpate::data
