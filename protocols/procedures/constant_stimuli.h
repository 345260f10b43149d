#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "protocols/procedures/estimate.h"
#include "protocols/procedures/procedure_spec.h"

namespace palpate::protocols {

class ConstantStimuliRun {
 public:
  ConstantStimuliRun(const ConstantStimuli& spec, std::uint64_t seed);

  std::optional<double> next_level() const;
  void record(const Response& response);
  Estimate estimate() const;  ///< counts only: a threshold is the analysis' business

 private:
  std::vector<double> order_;
  std::size_t trials_ = 0;
};

}  // namespace palpate::protocols
