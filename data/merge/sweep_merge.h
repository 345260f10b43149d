#pragma once
// palpate merge, of sweeps: the files of shards into one.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "data/store/sweep_file.h"

namespace palpate::data {

struct SweepMergeResult {
  SweepPlan plan;
  std::int64_t points = 0;  ///< on record in the new file; the plan may have more
  std::int64_t failed = 0;  ///< of them
};

/// Creates the union of the points of several files of one plan; a point that several hold must be
/// the same in all. The new file has the bytes that one process would have written for the same
/// points, whatever the order of the inputs. Files are opened one after the other and copied row by
/// row: memory does not grow with their number or size. The inputs are not written to; `out`
/// appears complete or not at all, and never replaces a file. \param progress called after each
/// file with its number; may throw to stop \throws StoreRefused: another plan than the first
/// file's, with everything that differs; a point with other results; a file that SweepFile::open
/// would refuse or that is open for writing
SweepMergeResult merge_sweeps(const std::string& out, const std::vector<std::string>& inputs,
                              const std::function<void(std::int64_t)>& progress = {});

}  // namespace palpate::data
