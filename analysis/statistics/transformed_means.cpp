#include "analysis/statistics/transformed_means.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "analysis/statistics/describe.h"

namespace palpate::analysis {
namespace {

TransformedMean mean_on_scale(const std::vector<double>& values,
                              const std::function<double(double)>& back) {
  TransformedMean out;
  out.n = values.size();
  if (values.empty()) {
    out.undefined = "no participant has the measure";
    return out;
  }
  out.mean = back(mean(values));
  const TTest test = t_test(values);
  out.undefined = test.undefined;
  if (const auto& ends = test.log_ratio_ci95; ends && test.t)
    out.ci95 = Interval{back(ends->low), back(ends->high)};
  return out;
}

}  // namespace

TransformedMean mean_information(const std::vector<double>& bits, double most) {
  std::vector<double> values;
  values.reserve(bits.size());
  for (const double one : bits)
    values.push_back(std::asin(std::sqrt(std::clamp(one / most, 0.0, 1.0))));
  TransformedMean out = mean_on_scale(values, [most](double value) {
    const double sine = std::sin(std::clamp(value, 0.0, M_PI / 2));
    return most * sine * sine;
  });
  // Values at one end, alike up to rounding, have no spread to judge by.
  if (!values.empty() && std::ranges::all_of(bits, [most](double one) { return one >= most; })) {
    out.undefined = "all participants transmit the most possible";
    out.ci95.reset();
  }
  return out;
}

TransformedMean mean_type2_area(const std::vector<Type2Roc>& curves) {
  std::vector<double> values;
  std::size_t left_out = 0;
  for (const Type2Roc& one : curves) {
    if (!one.area) {
      ++left_out;
      continue;
    }
    const double pairs = static_cast<double>(one.correct) * one.wrong;
    const double area = (*one.area * pairs + 0.5) / (pairs + 1);
    values.push_back(std::log(area / (1 - area)));
  }
  TransformedMean out =
      mean_on_scale(values, [](double logit) { return 1 / (1 + std::exp(-logit)); });
  out.left_out = left_out;
  return out;
}

}  // namespace palpate::analysis
