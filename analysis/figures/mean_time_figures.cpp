// Figures of mean response times (as fig. 15 of Ho, Basdogan & Srinivasan 2000) and of their
// percent reduction, the latter with the censored estimate and the paper's percentages.

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <optional>
#include <utility>

#include "analysis/figures/panel_drawing.h"
#include "analysis/statistics/conclusions.h"
#include "analysis/text.h"

namespace palpate::analysis {

namespace {

/// 95 % t interval of the mean of participants' means (s): mean +- t(0.975, n - 1) sd / sqrt(n);
/// none for n < 2.
std::optional<Interval> interval_of(const TimesCell& cell) {
  if (!cell.sd_of_participant_means) return std::nullopt;
  const double n = static_cast<double>(cell.n_participants);
  const double half = quantile(boost::math::students_t(n - 1), 0.975) *
                      *cell.sd_of_participant_means / std::sqrt(n);
  return Interval{*cell.mean_of_participant_means - half, *cell.mean_of_participant_means + half};
}

/// Position of a renderer's marks within the slot of a shape, 0 to 1, at most `spread` from its
/// middle.
double slot_position(std::size_t renderer, std::size_t renderers, double spread) {
  if (renderers < 2) return 0.5;
  return 0.5 +
         spread * (2 * static_cast<double>(renderer) / static_cast<double>(renderers - 1) - 1);
}

/// Positions of a renderer's mean and of its participants' marks, which do not overlap. With two
/// renderers the participants' marks are between the means.
double mean_position(std::size_t renderer, std::size_t renderers) {
  return renderers <= 2 ? slot_position(renderer, renderers, 0.27)
                        : slot_position(renderer, renderers, 0.3) + 0.03;
}
double participant_position(std::size_t renderer, std::size_t renderers) {
  return renderers <= 2 ? slot_position(renderer, renderers, 0.15)
                        : slot_position(renderer, renderers, 0.3) - 0.03;
}

void add_participants(Panel& panel, const Analysis& analysis, std::size_t renderers,
                      std::size_t shape) {
  const auto& table = analysis.table;
  const std::size_t n = std::min(table.participants.size(), kShownParticipants);
  const double opacity = n <= 10 ? 0.6 : n <= 40 ? 0.4 : 0.2;
  for (std::size_t p = 0; p < n; ++p) {
    const std::string participant = printable(table.participants[p], 40);
    Mark line = line_mark(Role::soft, {}, {}, 1);
    line.opacity = opacity;
    line.participant = participant;
    line.text = participant + ", " + printable(table.shapes[shape], 40) + ":";
    std::vector<Mark> dots;
    for (std::size_t r = 0; r < renderers; ++r) {
      const ParticipantCell& cell = analysis.description.participant_cells[r][shape][p];
      if (cell.n_used == 0) continue;
      line.x.push_back(static_cast<double>(shape) + participant_position(r, renderers));
      line.y.push_back(cell.mean);
      line.text += " " + short_name(table.renderers[r]) + " " + seconds_text(cell.mean);
      const RendererStyle style = style_of(analysis, table.renderers[r]);
      dots.push_back(symbol(style.role, style.shape, line.x.back(), cell.mean, 2.4));
    }
    for (Mark& dot : dots) {
      dot.opacity = opacity;
      dot.text = line.text;
      dot.participant = participant;
      panel.marks.push_back(std::move(dot));
    }
    if (line.x.size() > 1) panel.marks.push_back(std::move(line));
  }
}

/// Upper end of the time axis, s. Intervals of two participants are cut at 1.5 times the largest
/// participant's mean: they may be ten times as long.
double highest_time(const Analysis& analysis, std::size_t renderers, std::size_t shapes) {
  double largest = 0, largest_end = 0, end_of_two = 0;
  for (std::size_t r = 0; r < renderers; ++r) {
    for (std::size_t s = 0; s < shapes; ++s) {
      for (const ParticipantCell& participant : analysis.description.participant_cells[r][s]) {
        if (participant.n_used > 0) largest = std::max(largest, participant.mean);
      }
      if (const auto ends = interval_of(analysis.description.times[r][s])) {
        double& end =
            analysis.description.times[r][s].n_participants < 3 ? end_of_two : largest_end;
        end = std::max(end, ends->high);
      }
    }
  }
  const double highest = std::max({largest, largest_end, std::min(end_of_two, 1.5 * largest)});
  return highest > 0 ? highest : 1;
}

/// The estimate with time-outs as censored times; null without time-outs or without an estimate.
const CensoredEstimate* shown_censored(const Comparison& comparison, std::size_t shape) {
  if (comparison.censored.empty()) return nullptr;
  const CensoredEstimate& censored = comparison.censored[shape];
  return censored.n_censored > 0 && censored.log_ratio ? &censored : nullptr;
}

/// The percent axis common to the panels of all comparisons.
FigureAxis reduction_axis(const Analysis& analysis, std::size_t comparisons, std::size_t shapes) {
  double low = 0, high = compares_as_paper(analysis) ? 25 : 10;  // the paper's largest is 22 %
  const auto include = [&](const Interval& log_ratio) {
    const Interval ends = percent_reduction(log_ratio);
    low = std::min(low, ends.low);
    high = std::max(high, ends.high);
  };
  for (std::size_t c = 0; c < comparisons; ++c) {
    for (std::size_t s = 0; s < shapes; ++s) {
      if (const CensoredEstimate* censored = shown_censored(analysis.comparisons[c], s)) {
        include({*censored->log_ratio, *censored->log_ratio});
        if (censored->log_ratio_ci95) include(*censored->log_ratio_ci95);
      }
      const PairedShape& shape = analysis.comparisons[c].shapes[s];
      if (!shape.percent_reduction_geometric) continue;
      low = std::min(low, *shape.percent_reduction_geometric);
      high = std::max(high, *shape.percent_reduction_geometric);
      if (shape.t_test.log_ratio_ci95) include(*shape.t_test.log_ratio_ci95);
    }
  }
  if (comparisons > 1)
    high += 0.12 * (high - std::max(low, -150.0));  // space for the p values below the top
  // 100 (1 - exp m) has no lower bound: the axis is cut at -150 %.
  return linear_axis(std::max(low, -150.0), high, gain_title(analysis, "less time", "than with"));
}

std::string interval_text(const Interval& percent) {
  return fixed(percent.low, 1) + " to " + fixed(percent.high, 1) + " %";
}

void add_paper(Panel& panel, const RendererPair& pair, const std::string& shape, double x) {
  const PaperEffect* effect = paper_effect(pair, shape);
  if (!effect) return;
  if (const auto& value = effect->percent_reduction) {
    panel.marks.push_back(symbol(Role::paper, MarkerShape::diamond, x, *value, 7,
                                 shape + ", Ho et al. 2000: " + fixed(*value, 0) + " %"));
  } else {
    Mark mark = text_mark(Role::paper, x, 0, "n.s.", 12);
    mark.bold = true;
    mark.dy = -6;
    panel.marks.push_back(std::move(mark));
  }
}

void add_censored(Panel& panel, const CensoredEstimate& censored, double x, std::string& text) {
  const double value = percent_reduction(*censored.log_ratio);
  std::string own = "time-outs as censored: " + fixed(value, 1) + " %";
  if (censored.log_ratio_ci95) {
    const Interval ends = percent_reduction(*censored.log_ratio_ci95);
    own += ", 95 % interval " + interval_text(ends);
    add_interval(panel, Role::amber, x, ends.low, ends.high, own);
  }
  panel.marks.push_back(symbol(Role::amber, MarkerShape::square, x,
                               std::clamp(value, panel.y.low, panel.y.high), 5.8, own));
  text += "; " + own;
}

/// Adds a comparison's reductions, shape by shape. \return false if none is defined
bool add_reductions(Panel& panel, const Comparison& comparison,
                    const std::vector<std::string>& names, std::size_t shapes,
                    std::string& description) {
  bool any = false;
  panel.marks.push_back(line_mark(Role::soft, {0, panel.x.high}, {0, 0}, 1.4));
  for (std::size_t s = 0; s < shapes; ++s) {
    const PairedShape& shape = comparison.shapes[s];
    const CensoredEstimate* censored = shown_censored(comparison, s);
    const double left = static_cast<double>(s) + (censored ? 0.36 : 0.42),
                 right = static_cast<double>(s) + (censored ? 0.72 : 0.62);
    std::string text =
        (panel.title.empty() ? "" : panel.title + ", ") + printable(names[s], 40) + ": ";
    text += shape.percent_reduction_geometric ? fixed(*shape.percent_reduction_geometric, 1) + " %"
                                              : std::string("undefined");
    if (shape.t_test.log_ratio_ci95) {
      const Interval ends = percent_reduction(*shape.t_test.log_ratio_ci95);
      text += ", 95 % interval " + interval_text(ends);
      add_interval(panel, Role::ink, left, ends.low, ends.high, text);
    }
    if (shape.percent_reduction_geometric) {
      panel.marks.push_back(symbol(
          Role::ink, MarkerShape::circle, left,
          std::clamp(*shape.percent_reduction_geometric, panel.y.low, panel.y.high), 6.5, text));
      any = true;
    }
    if (censored) add_censored(panel, *censored, static_cast<double>(s) + 0.54, text);
    add_paper(panel, comparison.pair, names[s], right);
    const std::string paper = paper_reduction(comparison.pair, names[s]);
    if (!paper.empty()) text += "; paper " + paper;
    if (const auto& p = shape.t_test.p_holm) {
      Mark mark = text_mark(Role::soft, static_cast<double>(s) + 0.5, panel.y.high,
                            (*p < 0.001 ? "p " : "p = ") + p_text(*p), 12);
      mark.bold = *p < 0.05;
      mark.dy = panel.title.empty() ? -9 : 14;  // below a title
      panel.marks.push_back(std::move(mark));
      text += "; adjusted p " + p_text(*p);
    }
    description += text + ". ";
  }
  return any;
}

}  // namespace

Figure figure15_of(const Analysis& analysis) {
  Figure figure = new_figure(analysis, "figure15", "Mean time to identify a shape");
  const auto& table = analysis.table;
  const std::size_t shapes = shown_shapes(analysis, figure);
  const std::size_t renderers = shown_renderers(analysis, figure);
  Panel panel;
  panel.x = names_axis(table.shapes, shapes, "");
  panel.y = linear_axis(0, highest_time(analysis, renderers, shapes), "time (s)");
  panel.width = std::max(kFullPanelWidth, std::max(70.0, 26.0 * static_cast<double>(renderers)) *
                                              static_cast<double>(shapes));
  panel.height = 380;
  for (std::size_t s = 0; s < shapes; ++s) {
    add_participants(panel, analysis, renderers, s);
    for (std::size_t r = 0; r < renderers; ++r) {
      const TimesCell& cell = analysis.description.times[r][s];
      if (!cell.mean_of_participant_means) continue;
      const RendererStyle style = style_of(analysis, table.renderers[r]);
      const double x = static_cast<double>(s) + mean_position(r, renderers);
      std::string text = printable(table.shapes[s], 40) + ", " + short_name(table.renderers[r]) +
                         ": mean " + seconds_text(*cell.mean_of_participant_means);
      if (const auto ends = interval_of(cell)) {
        text += ", 95 % interval " + fixed(ends->low, 2) + " to " + fixed(ends->high, 2) + " s";
        add_interval(panel, style.role, x, ends->low, ends->high, text);
      }
      figure.description += text + ". ";
      panel.marks.push_back(symbol(style.role, style.shape, x, *cell.mean_of_participant_means,
                                   style.shape == MarkerShape::square ? 5.8 : 6.5, text));
    }
  }
  figure.panels.push_back(std::move(panel));
  add_renderers(figure, analysis, renderers);
  figure.legend.push_back({"one participant", Role::soft, MarkerShape::dash});
  figure.notes.insert(
      figure.notes.begin(),
      "Correct answers only. Large marks: mean over participants of each one’s mean time; bars: 95 "
      "% interval of that mean (t). Small marks and thin lines: each participant." +
          std::string(compares_as_paper(analysis)
                          ? " Compare with fig. 15 of Ho, Basdogan & Srinivasan (2000)."
                          : ""));
  if (table.participants.size() > kShownParticipants) {
    figure.notes.push_back("Lines of the first " + std::to_string(kShownParticipants) + " of " +
                           std::to_string(table.participants.size()) +
                           " participants; means and intervals are of all.");
  }
  return figure;
}

Figure speedup_of(const Analysis& analysis) {
  Figure figure = new_figure(analysis, "speedup",
                             "Reduction of response time " + with_renderer(analysis, "against"));
  const std::size_t shapes = shown_shapes(analysis, figure);
  const std::size_t comparisons = shown_comparisons(analysis, figure);
  const FigureAxis axis = reduction_axis(analysis, comparisons, shapes);
  for (std::size_t c = 0; c < comparisons; ++c) {
    const Comparison& comparison = analysis.comparisons[c];
    Panel panel = comparison_panel(analysis, comparison.pair, shapes, 60);
    panel.x = names_axis(analysis.table.shapes, shapes, "");
    panel.y = axis;
    panel.height = 340;
    if (add_reductions(panel, comparison, analysis.table.shapes, shapes, figure.description)) {
      figure.panels.push_back(std::move(panel));
    }
  }
  if (figure.panels.empty()) return figure;
  const auto shown = [&](const auto& holds) {
    for (const Comparison& comparison : analysis.comparisons) {
      for (std::size_t s = 0; s < shapes; ++s) {
        if (holds(comparison, s)) return true;
      }
    }
    return false;
  };
  const bool with_paper = shown([&](const Comparison& comparison, std::size_t s) {
    return paper_effect(comparison.pair, analysis.table.shapes[s]) != nullptr;
  });
  const bool with_censored = shown([](const Comparison& comparison, std::size_t s) {
    return shown_censored(comparison, s) != nullptr;
  });
  figure.legend = {{"this data", Role::ink, MarkerShape::circle}};
  if (with_censored)
    figure.legend.push_back({"time-outs as censored", Role::amber, MarkerShape::square});
  if (with_paper) figure.legend.push_back({"Ho et al. 2000", Role::paper, MarkerShape::diamond});
  const RendererPair& first = analysis.comparisons.front().pair;
  const bool many = analysis.comparisons.size() > 1;
  figure.notes.insert(
      figure.notes.begin(),
      "Above 0 " +
          (many ? "the renderer is faster than " + with_article(short_name(first.reference))
                : with_article(short_name(first.renderer)) + " is faster") +
          ". Geometric reduction over participants with both renderers; bars: 95 % interval of the "
          "paired t-test on log times, not adjusted; p (Holm) adjusted over " +
          (many ? "all shapes and comparisons" : "the shapes") + ", bold below 0.05." +
          (with_censored ? " Time-outs as censored: log-normal times that exceed the limit "
                           "in trials without an answer in time."
                         : "") +
          (with_paper ? " n.s.: the paper found no significant difference." : ""));
  const bool cut = std::ranges::any_of(figure.panels, [](const Panel& panel) {
    return std::ranges::any_of(panel.marks,
                               [](const Mark& mark) { return mark.shape == MarkerShape::down; });
  });
  if (cut)
    figure.notes.emplace_back(
        "An arrow: the interval goes on beyond the axis; the table has its end.");
  return figure;
}

}  // namespace palpate::analysis
