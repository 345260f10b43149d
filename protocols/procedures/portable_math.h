#pragma once
// Exponential, logarithm and normal distribution computed only with additions, multiplications and
// divisions: libm differs in the last bit between machines, but the choice of levels must not.

namespace palpate::protocols {

double portable_exp(double x);  ///< relative error below 1e-15; 0 and infinity beyond the range
double portable_log(double x);  ///< natural; x > 0; 0 gives -infinity
/// Distribution function of the standard normal, absolute error below 2e-15.
double portable_normal_cdf(double x);

}  // namespace palpate::protocols
