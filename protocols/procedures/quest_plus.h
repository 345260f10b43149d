#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "protocols/procedures/estimate.h"
#include "protocols/procedures/procedure_spec.h"

namespace palpate::protocols {

struct QuestPlusTables;

/// Watson 2017, "QUEST+: A general multidimensional Bayesian adaptive psychometric method".
/// Departs: the expected entropy is worked out as what is known before less the mutual information
/// of answer and parameters, so that no logarithm is taken of the posterior. Of levels that are
/// equally good to 1e-10 bit the first is taken.
class QuestPlusRun {
 public:
  explicit QuestPlusRun(const QuestPlus& spec);

  std::optional<double> next_level() const;
  /// A level beside the grid counts as what it is.
  void record(const Response& response);
  /// Means of the posterior, the threshold's on the scale.
  Estimate estimate() const;

  /// Expected information of an answer at each level, bit.
  std::vector<double> expected_information() const;
  double entropy_bits() const;  ///< of the posterior
  /// Posterior of all parameters, the lapse varying fastest, then guess, slope, threshold.
  const std::vector<double>& posterior() const { return posterior_; }
  /// Posterior of one parameter: 0 threshold, 1 slope, 2 guess, 3 lapse.
  std::vector<double> marginal(std::size_t parameter) const;

 private:
  std::shared_ptr<const QuestPlusTables> tables_;
  std::vector<double> posterior_;
  int trials_ = 0;
};

}  // namespace palpate::protocols
