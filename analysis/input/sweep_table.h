#pragma once
// The points of a sweep as columns of numbers.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "data/sweep_record.h"

namespace palpate::analysis {

struct SweepTable {
  std::string source;         ///< path as the user gave it
  std::string protocol_name;  ///< "": the protocol has none
  std::string design;         ///< lhs, sobol, grid, saltelli
  std::int64_t planned = 0;   ///< points of the sweep; the file may hold fewer
  std::uint64_t seed = 0;
  int participants = 0, repetitions = 0;  ///< at each point
  std::string program_version;            ///< of the program that simulated

  std::vector<std::string> parameters, shapes, renderers;
  /// Parameters, then figures (gain_SHAPE, time_RENDERER_SHAPE and so on).
  std::vector<std::string> columns;
  std::vector<data::EstimateColumns> estimates;  ///< the figures with a standard error
  /// [column][row]; NaN: undefined, or of a failed point. A word is stored as its index in `words`.
  std::vector<std::vector<double>> values;
  std::vector<std::vector<std::string>> words;  ///< of each parameter; empty: numbers
  std::vector<std::int64_t> points;             ///< number of each row's point, from 1, ascending
  std::vector<bool> failed;
  std::vector<std::pair<std::string, std::size_t>> reasons;  ///< of failures, most frequent first

  std::size_t rows() const { return points.size(); }
  std::optional<std::size_t> column(std::string_view name) const;
};

/// \throws as SweepFile::open; protocols::InputError: no point is on record.
SweepTable read_sweep_table(const std::string& path);

}  // namespace palpate::analysis
