#pragma once
// The movement of all trials of a database, on several processors.

#include <cstdint>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "analysis/movement/comparison.h"
#include "analysis/movement/pictures.h"
#include "data/store/store.h"

namespace palpate::runner::movement {

struct MovementRequest {
  std::string database, mesh_folder;
  std::string protocol;  ///< the one that is wanted (analysis::is_protocol)
  int jobs = 1;
  analysis::MovementSettings settings;
  bool pictures = false;  ///< for figures as well
};

struct MovementStudy {
  /// The participant's id, session, trial: unique over all protocols.
  using TrialKey = std::tuple<std::int64_t, int, int>;

  analysis::MovementTable table;
  std::string csv;  ///< movement.csv: a row for each trial of the table, in its order
  std::vector<std::string> missing;  ///< of each row of the table: the reason of a missing value
  std::map<TrialKey, std::size_t> rows;
  analysis::MovementPictures pictures;  ///< if requested
};

MovementStudy::TrialKey key_of(const data::StoredTrial& trial);
/// \throws UsageError: no trial has samples
void require_samples(const MovementStudy& study, const std::string& database);

/// The same values whatever the jobs. \throws UsageError, InputError
MovementStudy measure_study(const MovementRequest& request);

}  // namespace palpate::runner::movement
