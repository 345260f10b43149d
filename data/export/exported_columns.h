#pragma once
// Name, unit and meaning of every exported column. One table for CSV headers, the codebook, BIDS
// sidecars and variableMeasured of Psych-DS.

#include <span>
#include <utility>
#include <vector>

#include "data/export/clock.h"
#include "data/store/store.h"

namespace palpate::data {

struct Column {
  /// Unit of the block's varied number, which its protocol names.
  static constexpr const char* kLevelUnit = "see block_name";
  const char* name;
  const char* description;
  const char* unit = "";  ///< "1": a pure number; "": a text or a code
  /// Code -> meaning; empty: the values are not codes.
  std::vector<std::pair<const char*, const char*>> levels = {};
  /// Other values: names from the protocol, or answers to its tasks.
  enum class Names { none, stimuli, blocks, answers } names = Names::none;
};

/// Columns of trials.csv, in order, as an export has them. Groups, blocks of tasks, runs with
/// torque left out and relative times add some.
std::span<const Column> trial_columns(const ExportClock& clock);
/// Those that do not only describe the participant.
std::span<const Column> columns_of_trial(const ExportClock& clock);
std::span<const Column> attempt_columns(const ExportClock& clock);  ///< of attempts.csv, likewise
/// The group of a participant.
const Column& group_column();
std::span<const Column> sample_columns();  ///< of a servo tick, in order
/// After them, if a stimulus of the protocol moves: its state after the tick.
std::span<const Column> body_columns();
/// After those, if contacts are requested.
std::span<const Column> contact_columns();
/// How a dataset shows a study.
struct DatasetForm {
  const char* study;              ///< begins its description
  std::vector<Column> intervals;  ///< before those of a sample
};
const DatasetForm& dataset_form(const ProtocolFacts& facts);

}  // namespace palpate::data
