#pragma once

#include <functional>
#include <vector>

namespace palpate::analysis {

struct SimplexMinimum {
  std::vector<double> place;
  double value = 0;
};

/// A local minimum by Nelder & Mead 1965, begun again from where it ends until that gains less than
/// `tolerance`. \param steps  first steps, one a parameter; not 0
SimplexMinimum minimize(const std::function<double(const std::vector<double>&)>& function,
                        const std::vector<double>& start, const std::vector<double>& steps,
                        double tolerance = 1e-11);

}  // namespace palpate::analysis
