#pragma once
// Internal to data/: what every column of an export is. One table for CSV headers, BIDS sidecars
// and Psych-DS's variableMeasured.

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "data/export/settings.h"

namespace palpate::data {

struct Column {
  const char* name;
  const char* description;
  const char* unit = "";  ///< "1": a pure number; "": a text or a code
  /// Value -> meaning; empty where the values are no codes.
  std::vector<std::pair<const char*, const char*>> levels = {};
};

/// Of trials.csv, in order; relative times have one more at the end.
std::span<const Column> trial_columns(Times times);
std::span<const Column> attempt_columns(Times times);  ///< of attempts.csv, likewise
std::span<const Column> sample_columns();              ///< of a servo tick, in order

}  // namespace palpate::data
