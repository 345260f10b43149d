#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "protocols/procedures/estimate.h"
#include "protocols/procedures/procedure_spec.h"

namespace palpate::protocols {

/// Levels of a series until its end, from `inside` steps within the range.
std::vector<double> series_levels(const Limits& spec, bool ascending, int inside);

class LimitsRun {
 public:
  LimitsRun(const Limits& spec, std::uint64_t seed);

  std::optional<double> next_level() const;
  void record(const Response& response);
  /// Threshold: mean on the scale over the series with a change, each half a step before it.
  Estimate estimate() const;

 private:
  struct Series {
    bool ascending = true;
    std::vector<double> levels;
  };

  Limits spec_;
  std::vector<Series> series_;
  std::size_t current_ = 0, place_ = 0;  // series, level within it
  std::vector<double> changes_;          // on the scale
  int trials_ = 0, unchanged_ = 0;
};

}  // namespace palpate::protocols
