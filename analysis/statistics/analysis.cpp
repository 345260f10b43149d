#include "analysis/statistics/analysis.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "analysis/text.h"

namespace palpate::analysis {

namespace {

constexpr double kMuchExcluded = 0.10;       // of a renderer's trials
constexpr double kUnequallyExcluded = 0.05;  // difference of two renderers' proportions
constexpr double kManyTimeOuts = 0.05;       // of a cell's trials
constexpr double kUnequalTimeOuts = 0.025;   // difference of two renderers' proportions for a shape
constexpr double kConcentrated = 1.5;        // ratio of a participant's proportion to the cell's
constexpr std::size_t kMostNamed = 6;        // shapes or comparisons named in a warning
constexpr double kAlpha = 0.05;
constexpr double kLongTime = 600;  // s; a longer mean suggests times in milliseconds

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
  if (out.table.provenance.protocol_sha256.size() > 1) {
    out.warnings.push_back("Trials of " +
                           std::to_string(out.table.provenance.protocol_sha256.size()) +
                           " different protocols are pooled.");
  }
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
