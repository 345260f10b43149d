#include "analysis/statistics/paired_evidence.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <cmath>

#include "analysis/statistics/describe.h"

namespace palpate::analysis {

Equivalence equivalence(const std::vector<double>& differences, double bound) {
  Equivalence out;
  out.bound = bound;
  const TTest test = t_test(differences);
  out.undefined = test.undefined;
  if (!test.se || !test.t) return out;
  const boost::math::students_t t(*test.df);
  const double centre = mean(differences);
  out.p_low = cdf(complement(t, (centre + bound) / *test.se));
  out.p_high = cdf(t, (centre - bound) / *test.se);
  out.p = std::max(*out.p_low, *out.p_high);
  out.ci90 = evidence_of(centre, test).ci90;
  return out;
}

double jzs_bayes_factor(double t, std::size_t n) {
  const auto count = static_cast<double>(n);
  const double df = count - 1, r2 = 0.5;
  const double log_null = -(df + 1) / 2 * std::log1p(t * t / df);
  // g = e^u: smooth, and nearly zero at both ends.
  const auto density = [&](double u) {
    const double spread = 1 + count * std::exp(u) * r2;
    const double log_value = -0.5 * std::log(spread) -
                             (df + 1) / 2 * std::log1p(t * t / (spread * df)) -
                             0.5 * std::log(2 * M_PI) - 0.5 * u - 0.5 * std::exp(-u);
    return std::exp(log_value - log_null);
  };
  using Quadrature = boost::math::quadrature::gauss_kronrod<double, 61>;
  // Below e^-7 the prior of g is below 1e-200, above e^80 what is left is below 1e-17.
  return Quadrature::integrate(density, -7.0, 80.0, 15, 1e-12);
}

PairedEvidence evidence_of(double mean, const TTest& test) {
  PairedEvidence out;
  if (!test.se || !test.t || !test.df) return out;
  const double half = *test.se * quantile(boost::math::students_t(*test.df), 0.95);
  out.ci90 = Interval{mean - half, mean + half};
  out.least_bound = std::max(std::abs(out.ci90->low), std::abs(out.ci90->high));
  out.bayes_factor = jzs_bayes_factor(*test.t, static_cast<std::size_t>(*test.df + 1.5));
  return out;
}

}  // namespace palpate::analysis
