#pragma once
// The movement of all trials of a database, on several processors.

#include <string>

#include "analysis/movement/comparison.h"

namespace palpate::runner {

struct MovementRequest {
  std::string database, mesh_folder;
  int jobs = 1;
  analysis::MovementSettings settings;
};

struct MovementStudy {
  analysis::MovementTable table;
  std::string csv;  ///< movement.csv: a row for each trial of the table, in its order
};

/// The same values whatever the jobs. \throws UsageError, InputError
MovementStudy measure_study(const MovementRequest& request);

}  // namespace palpate::runner
