#pragma once
// Exponential, logarithm and normal distribution computed only with additions, multiplications and
// divisions: libm differs in the last bit between machines, but the choice of levels must not.

namespace palpate::protocols {

double portable_exp(double x);  ///< relative error below 1e-15; 0 and infinity beyond the range
double portable_log(double x);  ///< natural; x > 0; 0 gives -infinity
/// Distribution function of the standard normal, absolute error below 2e-15.
double portable_normal_cdf(double x);

inline constexpr double kLn2 = 0.69314718055994531;
/// p ln p; 0 at 0.
inline double portable_plogp(double p) { return p > 0 ? p * portable_log(p) : 0; }
/// Entropy of an answer of two kinds, nat. \param p  probability of one of them
inline double answer_entropy(double p) { return -portable_plogp(p) - portable_plogp(1 - p); }

}  // namespace palpate::protocols
