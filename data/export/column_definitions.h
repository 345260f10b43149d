#pragma once
// Internal to data/export: name, unit and meaning of every exported column. One table for CSV
// headers, the codebook, BIDS sidecars and variableMeasured of Psych-DS.

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "data/export/settings.h"

namespace palpate::data {

struct Column {
  /// Unit of the block's varied number, which its protocol names.
  static constexpr const char* kLevelUnit = "see block_name";
  const char* name;
  const char* description;
  const char* unit = "";  ///< "1": a pure number; "": a text or a code
  /// Code -> meaning; empty where the values are no codes.
  std::vector<std::pair<const char*, const char*>> levels = {};
  /// What else the values are: names that the protocol gives, or answers to its tasks.
  enum class Names { none, stimuli, blocks, answers } names = Names::none;
};

/// Of trials.csv, in order. \param tasks  a protocol of version 2 is among the studies: with the
/// columns of its tasks. \param torque  torque was left out in a run: with torque_driven. Relative
/// times add the column elapsed.
std::span<const Column> trial_columns(Times times, bool tasks = false, bool torque = false);
std::span<const Column> attempt_columns(Times times);  ///< of attempts.csv, likewise
std::span<const Column> sample_columns();              ///< of a servo tick, in order
/// After them where a stimulus of the protocol moves: where it was after the tick.
std::span<const Column> body_columns();
/// After those where contacts are asked for.
std::span<const Column> contact_columns();
/// Before them where a protocol of version 2 is among the studies.
const Column& interval_column();

}  // namespace palpate::data
