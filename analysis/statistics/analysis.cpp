#include "analysis/statistics/analysis.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <utility>

#include "analysis/text.h"

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

constexpr double kMuchExcluded = 0.10;       // of a renderer's trials
constexpr double kUnequallyExcluded = 0.05;  // difference of two renderers' proportions
constexpr double kManyTimeOuts = 0.05;       // of a cell's trials
constexpr double kUnequalTimeOuts = 0.025;   // difference of two renderers' proportions for a shape
constexpr double kConcentrated = 1.5;        // ratio of a participant's proportion to the cell's
constexpr std::size_t kMostNamed = 6;        // shapes or comparisons named in a warning
constexpr double kLongTime = 600;            // s; a longer mean suggests times in milliseconds

Exclusions count_exclusions(const Description& description, std::size_t renderer) {
  Exclusions out;
  for (std::size_t s = 0; s < description.accuracy[renderer].size(); ++s) {
    const AccuracyCell& cell = description.accuracy[renderer][s];
    out.n_trials += cell.n_trials;
    out.n_timeouts += cell.n_timeouts;
    out.n_wrong += cell.n_trials - cell.n_correct - cell.n_timeouts;
    out.n_too_fast += cell.n_correct_too_fast;
    out.n_used += description.times[renderer][s].n_trials;
  }
  return out;
}

void warn_of_exclusions(Analysis& analysis) {
  const auto& renderers = analysis.table.renderers;
  for (std::size_t r = 0; r < renderers.size(); ++r) {
    const double proportion = analysis.exclusions[r].proportion_excluded();
    if (proportion > kMuchExcluded) {
      analysis.warnings.push_back(fixed(100 * proportion, 1) + " % of the trials with " +
                                  renderers[r] +
                                  " are excluded from the times (wrong, no response or too fast).");
    }
  }
  if (renderers.size() < 2) return;
  const auto [least, most] =
      std::ranges::minmax_element(analysis.exclusions, {}, &Exclusions::proportion_excluded);
  if (most->proportion_excluded() - least->proportion_excluded() <= kUnequallyExcluded) return;
  const auto proportion = [&](const Exclusions& one) {
    return fixed(100 * one.proportion_excluded(), 1) + " % with " +
           renderers[static_cast<std::size_t>(&one - analysis.exclusions.data())];
  };
  analysis.warnings.push_back(
      "Exclusions differ between renderers (" + proportion(*std::min(least, most)) + ", " +
      proportion(*std::max(least, most)) + "): the times compare different selections of trials.");
}

/// "12.2 % with the point (38.2 % of P3's trials)"
std::string time_outs_with(const Analysis& analysis, std::size_t renderer, std::size_t shape) {
  const TimeOutCell& cell = analysis.time_outs.cells[renderer][shape];
  std::string text = fixed(100 * cell.proportion(), 1) + " % with " +
                     with_article(analysis.table.renderers[renderer]);
  if (cell.most_affected && cell.largest_proportion > kConcentrated * cell.proportion()) {
    text += " (" + fixed(100 * cell.largest_proportion, 1) + " % in " +
            analysis.table.participants[*cell.most_affected] + ")";
  }
  return text;
}

/// Time-outs of one shape of a comparison and their effect on its reduction; empty if few, similar
/// and without effect.
std::string time_outs_of(const Analysis& analysis, const Comparison& comparison,
                         std::size_t shape) {
  const std::size_t reference = *comparison.pair.reference_at,
                    renderer = *comparison.pair.renderer_at;
  const double a = analysis.time_outs.cells[reference][shape].proportion(),
               b = analysis.time_outs.cells[renderer][shape].proportion();
  if (a + b == 0) return {};
  const CensoredEstimate& censored = comparison.censored[shape];
  const PairedShape& paired = comparison.shapes[shape];
  const auto& primary = paired.t_test.log_ratio_ci95;
  const bool moved = primary && censored.log_ratio &&
                     (*censored.log_ratio < primary->low || *censored.log_ratio > primary->high);
  if (std::max(a, b) <= kManyTimeOuts && std::fabs(a - b) <= kUnequalTimeOuts && !moved) return {};
  std::string text = analysis.table.shapes[shape] + " " +
                     time_outs_with(analysis, reference, shape) + " and " +
                     time_outs_with(analysis, renderer, shape);
  if (censored.log_ratio && paired.percent_reduction_geometric) {
    text += ", reduction " + fixed(percent_reduction(*censored.log_ratio), 1) +
            " % with time-outs as censored times, " +
            fixed(*paired.percent_reduction_geometric, 1) + " % without them" +
            (moved ? ", outside its interval" : "");
  }
  return text;
}

void warn_of_time_outs(Analysis& analysis) {
  const auto warn = [&](const std::vector<std::string>& shapes) {
    if (shapes.empty()) return;
    std::string text;
    for (std::size_t i = 0; i < std::min(shapes.size(), kMostNamed); ++i) {
      text += (i == 0 ? "" : "; ") + shapes[i];
    }
    if (shapes.size() > kMostNamed) {
      text += "; and " + std::to_string(shapes.size() - kMostNamed) + " more shapes";
    }
    analysis.warnings.push_back(
        "Time-outs are excluded from the times, which biases the times of slow "
        "conditions downwards: " +
        text + ".");
  };
  std::size_t n_warnings = 0;
  for (const Comparison& comparison : analysis.comparisons) {
    std::vector<std::string> shapes;
    for (std::size_t s = 0; s < analysis.table.shapes.size(); ++s) {
      if (!comparison.pair.in_data()) {
        const std::size_t renderer = comparison.pair.reference_at.value_or(0);
        if (analysis.time_outs.cells[renderer][s].proportion() > kManyTimeOuts) {
          shapes.push_back(analysis.table.shapes[s] + " " + time_outs_with(analysis, renderer, s));
        }
      } else if (!comparison.censored.empty()) {
        std::string text = time_outs_of(analysis, comparison, s);
        if (!text.empty()) shapes.push_back(std::move(text));
      }
    }
    if (!shapes.empty() && ++n_warnings > kMostNamed) return;
    warn(shapes);
  }
}

/// Names each participant without a pair for some shape: "P3 (point: cone; ray: every shape)".
void warn_of_dropped(Analysis& analysis) {
  const TrialTable& table = analysis.table;
  if (table.renderers.size() < 2) return;
  // [participant][renderer]: shapes without a time. All comparisons have the same reference.
  std::map<std::size_t, std::map<std::size_t, std::vector<std::string>>> shapes_of;
  for (std::size_t s = 0; s < table.shapes.size(); ++s) {
    for (const Comparison& comparison : analysis.comparisons) {
      for (const DroppedParticipant& dropped : comparison.shapes[s].dropped) {
        for (const std::string& renderer : dropped.renderers) {
          auto& shapes = shapes_of[dropped.participant][static_cast<std::size_t>(
              std::ranges::find(table.renderers, renderer) - table.renderers.begin())];
          if (shapes.empty() || shapes.back() != table.shapes[s]) shapes.push_back(table.shapes[s]);
        }
      }
    }
  }
  std::vector<std::string> participants;
  for (const auto& [participant, renderers] : shapes_of) {
    std::string text;
    for (const auto& [renderer, shapes] : renderers) {
      text += (text.empty() ? "" : "; ") + table.renderers[renderer] + ": " +
              (shapes.size() == table.shapes.size() ? "every shape" : joined(shapes));
    }
    participants.push_back(table.participants[participant] + " (" + text + ")");
  }
  if (participants.empty()) return;
  analysis.warnings.push_back(
      "Left out of paired comparisons where there is no time: " + joined(participants) + ".");
}

void warn_of_times(Analysis& analysis) {
  for (const auto& renderer : analysis.description.times) {
    for (const TimesCell& cell : renderer) {
      if (cell.mean_of_participant_means.value_or(0) > kLongTime) {
        analysis.warnings.push_back(
            "A mean response time is longer than 10 minutes: are the times in seconds?");
        return;
      }
    }
  }
}

/// Warns if practice may explain a gain: one order only, or an effect of order.
void warn_of_practice(Analysis& analysis) {
  for (std::size_t c = 0; c < analysis.comparisons.size(); ++c) {
    const RendererPair& pair = analysis.comparisons[c].pair;
    const bool many = analysis.comparisons.size() > 1;
    const OrderEffect& order = analysis.practice.pairs[c].all_shapes;
    const std::size_t reference_first = order.reference_first.n_participants,
                      renderer_first = order.renderer_first.n_participants;
    if (reference_first + renderer_first > 0 && (reference_first == 0 || renderer_first == 0)) {
      const bool reference = renderer_first == 0;
      analysis.warnings.push_back(
          "All participants had " + with_article(reference ? pair.reference : pair.renderer) +
          (many ? " before " + with_article(reference ? pair.renderer : pair.reference)
                : " first") +
          ": effects of practice and renderer are confounded.");
    } else if (order.test.p_holm.value_or(1) < kAlpha) {
      analysis.warnings.push_back(
          (many ? "The gain of " + with_article(pair.renderer) + " over " +
                      with_article(pair.reference) +
                      " depends on which of them came first (adjusted p "
                : "The gain depends on which renderer came first (adjusted p ") +
          p_text(*order.test.p_holm) +
          "): see practice for the gain with the two orders balanced.");
    }
  }
}

/// \param too_fast s, as in describe()
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

}  // namespace

double Exclusions::proportion_excluded() const {
  if (n_trials == 0) return 0;
  return static_cast<double>(n_trials - n_used) / static_cast<double>(n_trials);
}

Analysis analyze(TrialTable table, const AnalysisSettings& settings,
                 const std::string& program_version) {
  Analysis out;
  out.settings = settings;
  out.program_version = program_version;
  out.description = describe(table, settings.too_fast);
  out.time_outs = time_outs(table, out.description);
  out.comparisons = compare_renderers(table, out.description, out.time_outs, settings.seed);
  out.rm_anova = rm_anova(out.description.participant_cells);
  out.mixed_model = mixed_model(out.description.participant_cells, table.renderers, table.shapes);
  const RendererPair& first = out.comparisons.front().pair;
  if (table.renderers.size() == 2 && first.in_data()) {
    const ParticipantCells& cells = out.description.participant_cells;
    out.shape_slope_model =
        shape_slope_model({cells[*first.reference_at], cells[*first.renderer_at]});
  } else {
    out.shape_slope_model.undefined = "for two renderers";
  }
  out.practice = practice_effects(table, out.description, settings.too_fast);
  for (std::size_t r = 0; r < table.renderers.size(); ++r) {
    out.exclusions.push_back(count_exclusions(out.description, r));
  }
  out.warnings = table.warnings;
  out.table = std::move(table);
  if (out.table.simulated == Simulated::mixed) {
    out.warnings.push_back(
        "Human and simulated participants are pooled: no conclusion about humans.");
  }
  if (out.table.provenance.protocol_sha256.size() > 1)
    out.warnings.push_back(pooled_protocols(out.table.provenance));
  warn_of_times(out);
  warn_of_exclusions(out);
  if (out.time_outs.any) warn_of_time_outs(out);
  warn_of_dropped(out);
  warn_of_practice(out);
  return out;
}

std::string simulated_label(Simulated simulated) {
  switch (simulated) {
    case Simulated::yes:
      return "SIMULATED PARTICIPANTS";
    case Simulated::mixed:
      return "PARTLY SIMULATED PARTICIPANTS";
    case Simulated::no:
      break;
  }
  return {};
}

}  // namespace palpate::analysis
