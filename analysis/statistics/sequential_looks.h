#pragma once
// Looks at a study before its end, with the error of all of them together kept at alpha.
// Alpha spending: Lan & DeMets 1983, Biometrika 70, 659-663; the recursion over looks: Armitage,
// McPherson & Rowe 1969, J. R. Stat. Soc. A 132, 235-244.

#include <cstddef>
#include <vector>

namespace palpate::analysis {

enum class Spending {
  obrien_fleming,  ///< 4 - 4 Phi(z / sqrt(t)), z the quantile of 1 - alpha / 4: little at first
  pocock           ///< alpha ln(1 + (e - 1) t): much at first
};

struct Look {
  std::size_t participants = 0;
  double alpha = 0;  ///< of a two-sided test at this look
  double bound = 0;  ///< of the standard normal |z| that this alpha stands for
  double spent = 0;  ///< up to and with this look
};

/// Two-sided levels at looks after some participants, the last with all of them. The information
/// is in proportion to the participants; statistics of the looks have the covariance of a Brownian
/// motion, which holds in large samples. \param participants  ascending, at least one
std::vector<Look> planned_looks(Spending spending, double alpha,
                                const std::vector<std::size_t>& participants);

}  // namespace palpate::analysis
