#include "analysis/statistics/sequential_looks.h"

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <numbers>

namespace palpate::analysis {
namespace {

constexpr double kWidest = 38;  // sd; beyond it no double holds the normal's tail
constexpr int kSteps = 1600;    // of Simpson's rule, even
constexpr double kReach = 9;    // sd; less than 1e-18 of a motion is outside

double above(double z) { return cdf(complement(boost::math::normal(), z)); }

/// The motion that no look has stopped so far: density at places across the bounds.
class Motion {
 public:
  /// \param sd  of the motion at the first look
  Motion(double bound, double sd) : half_(std::min(bound, kReach * sd)) {
    for (int i = 0; i <= kSteps; ++i) density_.push_back(normal(place(i), sd));
  }

  /// Probability to be stopped at the next look. \param sd  of the step to it
  double stopped(double bound, double sd) const {
    return integral([&](double at) { return above((bound - at) / sd) + above((bound + at) / sd); });
  }

  void go_to(double bound, double step_sd, double sd) {
    Motion next;
    next.half_ = std::min(bound, kReach * sd);
    for (int i = 0; i <= kSteps; ++i)
      next.density_.push_back(
          integral([&](double at) { return normal(next.place(i) - at, step_sd); }));
    *this = std::move(next);
  }

 private:
  Motion() = default;
  static double normal(double x, double sd) {
    return std::exp(-0.5 * x * x / (sd * sd)) / (sd * std::sqrt(2 * std::numbers::pi));
  }
  double place(int i) const { return half_ * (2.0 * i / kSteps - 1); }
  /// Of the density times a function of the place, by Simpson's rule.
  template <class Function>
  double integral(const Function& function) const {
    double sum = 0;
    for (int i = 0; i <= kSteps; ++i) {
      const double weight = i == 0 || i == kSteps ? 1 : i % 2 == 1 ? 4 : 2;
      sum += weight * density_[static_cast<std::size_t>(i)] * function(place(i));
    }
    return sum * 2 * half_ / kSteps / 3;
  }

  double half_ = 0;  // sqrt of information
  std::vector<double> density_;
};

/// The bound at which a falling probability is the wanted one.
template <class Probability>
double bound_of(const Probability& probability, double wanted) {
  double low = 0, high = kWidest;
  for (int i = 0; i < 100; ++i) {
    const double middle = (low + high) / 2;
    (probability(middle) > wanted ? low : high) = middle;
  }
  return (low + high) / 2;
}

/// Two-sided alpha, half of it on either side, spent up to a share t of the information. \param
/// share  t, 0 to 1
double alpha_spent(Spending spending, double alpha, double share) {
  if (share >= 1) return alpha;
  if (spending == Spending::pocock) return alpha * std::log1p((std::numbers::e - 1) * share);
  const double z = quantile(complement(boost::math::normal(), alpha / 4));
  return 4 * above(z / std::sqrt(share));
}

}  // namespace

std::vector<Look> planned_looks(Spending spending, double alpha,
                                const std::vector<std::size_t>& participants) {
  std::vector<Look> out;
  const auto all = static_cast<double>(participants.back());
  Motion motion(0, 1);
  double before = 0, spent_before = 0;  // information and alpha
  for (const std::size_t n : participants) {
    const double share = static_cast<double>(n) / all, sd = std::sqrt(share),
                 step = std::sqrt(share - before);
    Look& look = out.emplace_back();
    look.participants = n;
    look.spent = alpha_spent(spending, alpha, share);
    const double now = look.spent - spent_before;
    look.bound = bound_of(
        [&](double z) { return out.size() == 1 ? 2 * above(z) : motion.stopped(z * sd, step); },
        now);
    look.alpha = 2 * above(look.bound);
    if (out.size() == 1) {
      motion = Motion(look.bound * sd, sd);
    } else if (n != participants.back()) {
      motion.go_to(look.bound * sd, step, sd);
    }
    before = share;
    spent_before = look.spent;
  }
  return out;
}

}  // namespace palpate::analysis
