#include "analysis/statistics/practice.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <cstdint>
#include <limits>

namespace palpate::analysis {

namespace {

constexpr double kPer = 100;  // trials to which slopes refer
const std::string kTooFew =
    "fewer than " + std::to_string(kSlopeTrials) + " times or no shape twice";

/// Sums of one participant's trials with one renderer and shape: of exposures and of logs, relative
/// to the cell's mean log.
struct ShapeSums {
  double n = 0, x = 0, xx = 0, xy = 0;
};

/// One participant's trials with one renderer.
struct ParticipantSums {
  std::vector<ShapeSums> shapes;
  std::array<double, kLearningBins> relative{};     // sums of log - mean log of the cell
  std::array<std::size_t, kLearningBins> trials{};  // usable trials
  std::uint32_t first = std::numeric_limits<std::uint32_t>::max(), last = 0;  // positions
  std::uint32_t exposures = 0;  // number of trials with the renderer

  /// Least-squares slope within shapes per kPer trials; none with few trials or no shape twice.
  std::optional<double> slope() const {
    double n = 0, xx = 0, xy = 0;
    for (const ShapeSums& shape : shapes) {
      if (shape.n == 0) continue;
      n += shape.n;
      xx += shape.xx - shape.x * shape.x / shape.n;
      xy += shape.xy;  // the logs' own sum is 0
    }
    if (n < static_cast<double>(kSlopeTrials)) return std::nullopt;
    if (xx <= 0.25)
      return std::nullopt;  // exposures are integers: two different ones give at least 0.5
    return kPer * xy / xx;
  }
};

using AllSums = std::vector<std::vector<ParticipantSums>>;  // [renderer][participant]

AllSums sum_up(const TrialTable& table, const Description& description, double too_fast) {
  ParticipantSums empty;
  empty.shapes.resize(table.shapes.size());
  AllSums all(table.renderers.size(),
              std::vector<ParticipantSums>(table.participants.size(), empty));
  for (const TrialRow& row : table.rows) {
    ParticipantSums& participant = all[row.renderer][row.participant];
    participant.first = std::min(participant.first, row.position);
    participant.last = std::max(participant.last, row.position);
    participant.exposures = std::max(participant.exposures, row.exposure);
  }
  for (const TrialRow& row : table.rows) {
    if (!row.correct || row.answer < 0 || row.response_time < too_fast) continue;
    ParticipantSums& participant = all[row.renderer][row.participant];
    const double x = row.exposure;
    const double y =
        std::log(row.response_time) -
        description.participant_cells[row.renderer][row.shape][row.participant].mean_log;
    ShapeSums& shape = participant.shapes[row.shape];
    ++shape.n;
    shape.x += x;
    shape.xx += x * x;
    shape.xy += x * y;
    const std::size_t bin =
        std::size_t{row.exposure - 1} * kLearningBins / std::max(1U, participant.exposures);
    participant.relative[bin] += y;
    ++participant.trials[bin];
  }
  return all;
}

/// Mean over participants of the mean over their shapes.
std::optional<double> overall_mean(const ParticipantCells& participant_cells,
                                   std::size_t renderer) {
  std::vector<double> means;
  const std::size_t n_participants =
      participant_cells[renderer].empty() ? 0 : participant_cells[renderer][0].size();
  for (std::size_t p = 0; p < n_participants; ++p) {
    std::vector<double> logs;
    for (const auto& shape : participant_cells[renderer]) {
      if (shape[p].n_used > 0) logs.push_back(shape[p].mean_log);
    }
    if (!logs.empty()) means.push_back(mean(logs));
  }
  if (means.empty()) return std::nullopt;
  return mean(means);
}

Learning learning(const std::vector<ParticipantSums>& participants,
                  const std::optional<double>& overall) {
  Learning out;
  std::array<std::vector<double>, kLearningBins> relative;
  std::vector<double> slopes;
  for (const ParticipantSums& participant : participants) {
    if (const auto slope = participant.slope()) slopes.push_back(*slope);
    for (std::size_t b = 0; b < kLearningBins; ++b) {
      if (participant.trials[b] == 0) continue;
      relative[b].push_back(participant.relative[b] / static_cast<double>(participant.trials[b]));
      out.bins[b].n_trials += participant.trials[b];
    }
  }
  for (std::size_t b = 0; b < kLearningBins; ++b) {
    LearningBin& bin = out.bins[b];
    bin.n_participants = relative[b].size();
    if (relative[b].empty() || !overall) continue;
    bin.mean_log = *overall + mean(relative[b]);
    if (const auto sd = standard_deviation(relative[b])) {
      bin.se_mean_log = *sd / std::sqrt(static_cast<double>(relative[b].size()));
    }
  }
  out.n_participants = slopes.size();
  out.slope = t_test(slopes);
  if (slopes.empty()) {
    out.slope.undefined = "every participant has " + kTooFew + " with it: too few for a slope";
  } else {
    out.mean_slope = mean(slopes);
  }
  return out;
}

enum class First { reference, renderer, mixed };

First first_of(const ParticipantSums& reference, const ParticipantSums& renderer) {
  if (reference.last < renderer.first) return First::reference;
  if (renderer.last < reference.first) return First::renderer;
  return First::mixed;
}

OrderGroup group_of(const std::vector<double>& differences) {
  OrderGroup out;
  out.n_participants = differences.size();
  if (!differences.empty()) out.mean_log_ratio = mean(differences);
  return out;
}

double squares(const std::vector<double>& values) {
  const double centre = mean(values);
  double sum = 0;
  for (const double value : values) sum += (value - centre) * (value - centre);
  return sum;
}

OrderEffect order_effect(const RendererPair& pair, const std::vector<double>& reference_first,
                         const std::vector<double>& renderer_first) {
  OrderEffect out;
  out.reference_first = group_of(reference_first);
  out.renderer_first = group_of(renderer_first);
  if (reference_first.empty() && renderer_first.empty()) {
    out.undefined = "no participant did one renderer after the other";
  } else if (reference_first.empty() || renderer_first.empty()) {
    out.undefined = "all participants had " +
                    with_article(reference_first.empty() ? pair.renderer : pair.reference) +
                    " first";
  }
  if (!out.undefined.empty()) {
    out.test.undefined = out.undefined;
    return out;
  }
  const double a = *out.reference_first.mean_log_ratio, b = *out.renderer_first.mean_log_ratio;
  out.difference = a - b;
  out.balanced_log_ratio = (a + b) / 2;
  const auto n1 = static_cast<double>(reference_first.size()),
             n2 = static_cast<double>(renderer_first.size());
  if (n1 + n2 < 3) {
    out.test.undefined = "one participant in each order, so no variance within the orders";
    return out;
  }
  const double df = n1 + n2 - 2;
  const double sd = std::sqrt((squares(reference_first) + squares(renderer_first)) / df);
  const double se = sd * std::sqrt(1 / n1 + 1 / n2);
  out.test.sd = sd;
  out.test.se = se;
  out.test.df = df;
  if (sd <= 1e-10 * std::max({1.0, std::fabs(a), std::fabs(b)})) {
    out.test.undefined = "all differences are equal (no variance)";
    return out;
  }
  const boost::math::students_t distribution(df);
  out.test.t = *out.difference / se;
  out.test.p = std::min(1.0, 2 * cdf(complement(distribution, std::fabs(*out.test.t))));
  const double half = quantile(distribution, 0.975) * se;
  out.test.log_ratio_ci95 = Interval{*out.difference - half, *out.difference + half};
  out.balanced_ci95 =
      Interval{*out.balanced_log_ratio - half / 2, *out.balanced_log_ratio + half / 2};
  return out;
}

void compare_orders(const Description& description, const AllSums& sums, const RendererPair& pair,
                    PairPractice& out) {
  const std::size_t reference = *pair.reference_at, renderer = *pair.renderer_at;
  const std::size_t n_shapes = description.participant_cells[0].size();
  std::vector<std::vector<double>> reference_first(n_shapes), renderer_first(n_shapes);
  std::vector<double> all_reference_first, all_renderer_first;
  for (std::size_t p = 0; p < sums[0].size(); ++p) {
    const ParticipantSums &with_reference = sums[reference][p], &with_renderer = sums[renderer][p];
    if (with_reference.last == 0 || with_renderer.last == 0) continue;
    const First first = first_of(with_reference, with_renderer);
    if (first == First::mixed) {
      ++out.n_interleaved;
      continue;
    }
    std::vector<double> differences;
    for (std::size_t s = 0; s < n_shapes; ++s) {
      const ParticipantCell& a = description.participant_cells[reference][s][p];
      const ParticipantCell& b = description.participant_cells[renderer][s][p];
      if (a.n_used == 0 || b.n_used == 0) continue;
      differences.push_back(b.mean_log - a.mean_log);
      (first == First::reference ? reference_first : renderer_first)[s].push_back(
          differences.back());
    }
    if (differences.size() == n_shapes) {
      (first == First::reference ? all_reference_first : all_renderer_first)
          .push_back(mean(differences));
    }
  }
  out.all_shapes = order_effect(pair, all_reference_first, all_renderer_first);
  for (std::size_t s = 0; s < n_shapes; ++s) {
    out.shapes.push_back(order_effect(pair, reference_first[s], renderer_first[s]));
  }
}

PairPractice pair_practice(const Description& description, const AllSums& sums,
                           const RendererPair& pair) {
  PairPractice out;
  if (!pair.in_data()) {
    out.slope_difference.undefined = out.all_shapes.undefined = out.all_shapes.test.undefined =
        "only one renderer in the data";
    out.shapes.assign(description.participant_cells[0].size(), out.all_shapes);
    return out;
  }
  std::vector<double> differences;
  for (std::size_t p = 0; p < sums[0].size(); ++p) {
    const auto reference = sums[*pair.reference_at][p].slope(),
               renderer = sums[*pair.renderer_at][p].slope();
    if (reference && renderer) differences.push_back(*renderer - *reference);
  }
  out.slope_difference = t_test(differences);
  if (differences.empty()) {
    out.slope_difference.undefined =
        "every participant has " + kTooFew + " with one of them: too few for slopes";
  } else {
    out.mean_slope_difference = mean(differences);
  }
  compare_orders(description, sums, pair, out);
  return out;
}

/// Holm's adjustment over all tests of practice.
void adjust(Practice& practice) {
  std::vector<TTest*> tests;
  for (Learning& learning : practice.learning) tests.push_back(&learning.slope);
  for (PairPractice& pair : practice.pairs) {
    tests.push_back(&pair.slope_difference);
    tests.push_back(&pair.all_shapes.test);
    for (OrderEffect& shape : pair.shapes) tests.push_back(&shape.test);
  }
  std::vector<std::optional<double>> p;
  p.reserve(tests.size());
  for (const TTest* test : tests) {
    p.push_back(test->p);
    practice.n_tests += test->p ? 1 : 0;
  }
  const auto adjusted = holm(p);
  for (std::size_t i = 0; i < tests.size(); ++i) tests[i]->p_holm = adjusted[i];
}

}  // namespace

Practice practice_effects(const TrialTable& table, const Description& description,
                          double too_fast) {
  Practice out;
  const AllSums sums = sum_up(table, description, too_fast);
  for (std::size_t r = 0; r < sums.size(); ++r) {
    out.learning.push_back(learning(sums[r], overall_mean(description.participant_cells, r)));
  }
  for (const RendererPair& pair : renderer_pairs(table.renderers)) {
    out.pairs.push_back(pair_practice(description, sums, pair));
  }
  adjust(out);
  return out;
}

}  // namespace palpate::analysis
