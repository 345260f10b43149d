#include "analysis/statistics/paired.h"

#include <algorithm>
#include <atomic>
#include <boost/math/distributions/students_t.hpp>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <numeric>
#include <thread>

#include "stimuli/random.h"

namespace palpate::analysis {

namespace {

constexpr std::size_t kManyPairs =
    1000;  // pairs from which bootstraps run in parallel: they outweigh the start of a thread
constexpr const char* kOnePair = "one participant, so no variance between participants";
constexpr const char* kNoPairs = "no participant has times for both renderers";
constexpr const char* kAllEqual = "all differences are equal (no variance)";

/// Why inference from these differences is impossible; empty: possible.
std::string no_inference(const std::vector<double>& differences) {
  if (differences.empty()) return kNoPairs;
  if (differences.size() == 1) return kOnePair;
  return {};
}

bool no_variance(double sd, double centre) {
  return sd <= 1e-10 * std::max(1.0, std::fabs(centre));
}

}  // namespace

double percent_reduction(double log_ratio) { return -100 * std::expm1(log_ratio); }

Interval percent_reduction(const Interval& log_ratio) {
  return {percent_reduction(log_ratio.high), percent_reduction(log_ratio.low)};
}

TTest t_test(const std::vector<double>& differences) {
  TTest test;
  test.undefined = no_inference(differences);
  if (!test.undefined.empty()) return test;
  const double n = static_cast<double>(differences.size()), m = mean(differences);
  test.sd = *standard_deviation(differences);
  test.se = *test.sd / std::sqrt(n);
  test.df = n - 1;
  if (no_variance(*test.sd, m)) {
    test.undefined = kAllEqual;
    return test;
  }
  const boost::math::students_t distribution(n - 1);
  test.t = m / *test.se;
  test.p = std::min(1.0, 2 * cdf(complement(distribution, std::fabs(*test.t))));
  const double half = quantile(distribution, 0.975) * *test.se;
  test.log_ratio_ci95 = Interval{m - half, m + half};
  return test;
}

EffectSize effect_size(const std::vector<double>& differences) {
  EffectSize effect;
  effect.undefined = no_inference(differences);
  if (!effect.undefined.empty()) return effect;
  const double sd = *standard_deviation(differences), m = mean(differences);
  if (no_variance(sd, m)) {
    effect.undefined = kAllEqual;
    return effect;
  }
  effect.dz = m / sd;
  const double df = static_cast<double>(differences.size()) - 1;
  if (df < 2) {
    effect.undefined = "two pairs: Hedges' correction J is 0";
    return effect;
  }
  const double j =
      std::exp(boost::math::lgamma(df / 2) - boost::math::lgamma((df - 1) / 2)) / std::sqrt(df / 2);
  effect.hedges_gz = j * *effect.dz;
  return effect;
}

std::vector<std::optional<double>> holm(const std::vector<std::optional<double>>& p) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < p.size(); ++i) {
    if (p[i]) order.push_back(i);
  }
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return *p[a] < *p[b]; });
  std::vector<std::optional<double>> adjusted(p.size());
  double largest = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    largest = std::max(largest, static_cast<double>(order.size() - i) * *p[order[i]]);
    adjusted[order[i]] = std::min(1.0, largest);
  }
  return adjusted;
}

std::vector<PairedShape> compare_by_shape(const TrialTable& table, const Description& description,
                                          const RendererPair& pair) {
  std::vector<PairedShape> all(table.shapes.size());
  for (std::size_t s = 0; s < all.size(); ++s) {
    PairedShape& shape = all[s];
    std::vector<double> references, others;
    for (std::size_t p = 0; p < table.participants.size(); ++p) {
      const ParticipantCell nothing;
      const auto& a =
          pair.reference_at ? description.participant_cells[*pair.reference_at][s][p] : nothing;
      const auto& b =
          pair.renderer_at ? description.participant_cells[*pair.renderer_at][s][p] : nothing;
      if (a.n_used > 0 && b.n_used > 0) {
        shape.differences.push_back(b.mean_log - a.mean_log);
        references.push_back(a.mean);
        others.push_back(b.mean);
      } else if (a.n_trials + b.n_trials > 0) {
        DroppedParticipant dropped{p, {}};
        if (a.n_used == 0) dropped.renderers.push_back(pair.reference);
        if (b.n_used == 0) dropped.renderers.push_back(pair.renderer);
        shape.dropped.push_back(std::move(dropped));
      }
    }
    shape.n_pairs = shape.differences.size();
    if (shape.n_pairs == 0) {
      shape.undefined =
          pair.in_data() ? kNoPairs : "only one renderer in the data: nothing to compare";
    } else {
      shape.percent_reduction_arithmetic =
          100 * (mean(references) - mean(others)) / mean(references);
      shape.mean_log_ratio = mean(shape.differences);
      shape.percent_reduction_geometric = percent_reduction(*shape.mean_log_ratio);
    }
    shape.t_test = t_test(shape.differences);
    shape.effect_size = effect_size(shape.differences);
    shape.wilcoxon = wilcoxon(shape.differences);
  }
  return all;
}

void bootstrap_all(const std::vector<PairedShape*>& tests, std::uint64_t seed) {
  std::atomic<std::size_t> next{0};
  // A random stream for each: the result does not depend on the number of threads.
  const auto work = [&] {
    for (std::size_t i = next++; i < tests.size(); i = next++) {
      stimuli::Random random(seed, {i});
      tests[i]->bootstrap = bootstrap_mean(tests[i]->differences, random);
      tests[i]->bootstrap.seed = seed;
    }
  };
  std::size_t pairs = 0;
  for (const PairedShape* test : tests) pairs += test->n_pairs;
  std::vector<std::jthread> threads;
  if (pairs > kManyPairs) {
    const std::size_t most = std::max(1U, std::thread::hardware_concurrency());
    threads.reserve(most);
    while (threads.size() + 1 < std::min(most, tests.size())) threads.emplace_back(work);
  }
  work();
}

void adjust_all(const std::vector<PairedShape*>& tests) {
  std::vector<std::optional<double>> p;
  p.reserve(tests.size());
  for (const PairedShape* test : tests) p.push_back(test->t_test.p);
  const auto adjusted = holm(p);
  for (std::size_t i = 0; i < tests.size(); ++i) tests[i]->t_test.p_holm = adjusted[i];
}

}  // namespace palpate::analysis
