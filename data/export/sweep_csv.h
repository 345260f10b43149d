#pragma once
// Export of a sweep as CSV: one row a point.

#include <cstdint>
#include <functional>
#include <string>

#include "data/store/sweep_file.h"

namespace palpate::data {

/// Writes the points on record, in order, with the columns of sweep_columns(). As export_csv()
/// writes: RFC 4180, the shortest texts of numbers that read back exactly, texts guarded; complete
/// or not at all. Undefined figures and those of failed points are empty. \param progress called
/// with the points written; may throw to stop \return points. \throws StoreRefused: the file exists
/// and `force` is not given, or must not be written to; StoreError
std::int64_t export_sweep_csv(SweepFile& sweep, const std::string& path, bool force,
                              const std::function<void(std::int64_t)>& progress = {});

}  // namespace palpate::data
