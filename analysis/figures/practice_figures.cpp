// Figures of practice: learning curves over trials, and the gain by order of renderers.

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <optional>
#include <utility>

#include "analysis/figures/panel_drawing.h"
#include "analysis/text.h"

namespace palpate::analysis {

namespace {

constexpr double kLongestBar =
    0.7;  // natural log; intervals, such as those of two participants, are cut beyond

/// Half width of a bin's 95 % t interval over participants, natural log of s; none for n < 2.
std::optional<double> half_interval(const LearningBin& bin) {
  if (!bin.se_mean_log) return std::nullopt;
  const boost::math::students_t distribution(static_cast<double>(bin.n_participants) - 1);
  return quantile(distribution, 0.975) * *bin.se_mean_log;
}

/// Adds a comparison's gains by order, shape by shape. \return false if none is defined
bool add_orders(Panel& panel, const Analysis& analysis, std::size_t comparison, std::size_t shapes,
                std::string& description) {
  const RendererPair& pair = analysis.comparisons[comparison].pair;
  const std::string before = panel.title.empty() ? "" : panel.title + ", ";
  bool any = false;
  panel.marks.push_back(line_mark(Role::soft, {0, panel.x.high}, {0, 0}, 1.4));
  for (std::size_t s = 0; s < shapes; ++s) {
    const OrderEffect& order = analysis.practice.pairs[comparison].shapes[s];
    const std::string name = before + printable(analysis.table.shapes[s], 40);
    const double x = static_cast<double>(s) + 0.5;
    const auto add_group = [&](const OrderGroup& group, const std::string& renderer, double at) {
      if (!group.mean_log_ratio) return;
      any = true;
      const double value = percent_reduction(*group.mean_log_ratio);
      const RendererStyle style = style_of(analysis, renderer);
      const std::string text = name + ", " + short_name(renderer) + " first: " + fixed(value, 1) +
                               " %, " +
                               counted(group.n_participants, "participant", "participants");
      panel.marks.push_back(symbol(style.role, style.shape, at,
                                   std::clamp(value, panel.y.low, panel.y.high), 5.5, text));
      description += text + ". ";
    };
    add_group(order.reference_first, pair.reference, x - 0.2);
    add_group(order.renderer_first, pair.renderer, x + 0.2);
    if (!order.balanced_log_ratio) continue;
    const double value = percent_reduction(*order.balanced_log_ratio);
    std::string text = name + ", orders balanced: " + fixed(value, 1) + " %";
    if (order.balanced_ci95) {
      const Interval ends = percent_reduction(*order.balanced_ci95);
      text += ", 95 % interval " + fixed(ends.low, 1) + " to " + fixed(ends.high, 1) + " %";
      add_interval(panel, Role::ink, x, ends.low, ends.high, text);
    }
    panel.marks.push_back(symbol(Role::ink, MarkerShape::diamond, x,
                                 std::clamp(value, panel.y.low, panel.y.high), 6, text));
    description += text + ". ";
  }
  return any;
}

}  // namespace

Figure learning_of(const Analysis& analysis) {
  Figure figure = new_figure(analysis, "learning", "Times over the trials with a renderer");
  const auto& learning = analysis.practice.learning;
  double low = 1e9, high = -1e9;
  const std::size_t renderers = shown_renderers(analysis, figure);
  for (std::size_t r = 0; r < renderers; ++r) {
    for (const LearningBin& bin : learning[r].bins) {
      if (!bin.mean_log) continue;
      const double half = std::min(half_interval(bin).value_or(0), kLongestBar);
      low = std::min(low, *bin.mean_log - half);
      high = std::max(high, *bin.mean_log + half);
    }
  }
  if (low > high) return figure;
  const double per_decade = std::log(10.0);
  Panel panel;
  std::vector<std::string> parts;
  parts.reserve(kLearningBins);
  for (std::size_t b = 0; b < kLearningBins; ++b) parts.push_back(std::to_string(b + 1));
  panel.x = names_axis(parts, kLearningBins, "part of the trials with a renderer, first to last");
  panel.y = log_axis(low / per_decade - 0.05, high / per_decade + 0.05,
                     "geometric mean time (s, logarithmic)");
  if (panel.y.ticks.size() < 3) {
    const FigureAxis seconds =
        linear_axis(std::pow(10, panel.y.low), std::pow(10, panel.y.high), "");
    panel.y.ticks.clear();
    for (const Tick& tick : seconds.ticks) {
      if (!(tick.at > 0)) continue;
      const double at = std::log10(tick.at);
      if (at >= panel.y.low && at <= panel.y.high) panel.y.ticks.push_back({at, tick.label});
    }
  }
  panel.width = kFullPanelWidth;
  panel.height = 300;
  add_renderers(figure, analysis, renderers);
  std::string slopes;
  for (std::size_t r = 0; r < renderers; ++r) {
    const std::string renderer = short_name(analysis.table.renderers[r]);
    const auto [role, shape] = style_of(analysis, analysis.table.renderers[r]);
    const double shift = 0.12 * static_cast<double>(r) - 0.06 * static_cast<double>(renderers - 1);
    Mark line = line_mark(role, {}, {}, 2);
    for (std::size_t b = 0; b < kLearningBins; ++b) {
      const LearningBin& bin = learning[r].bins[b];
      if (!bin.mean_log) continue;
      const double x = static_cast<double>(b) + 0.5 + shift, y = *bin.mean_log / per_decade;
      line.x.push_back(x);
      line.y.push_back(y);
      const std::string text = renderer + ", part " + parts[b] + ": " +
                               seconds_text(std::exp(*bin.mean_log)) + ", " +
                               counted(bin.n_trials, "trial", "trials");
      if (const auto natural = half_interval(bin)) {
        const double half = *natural / per_decade;
        add_interval(panel, role, x, y - half, y + half, text);
      }
      panel.marks.push_back(symbol(role, shape, x, y, 5, text));
    }
    if (line.x.size() > 1) panel.marks.push_back(std::move(line));
    const LearningBin &first = learning[r].bins.front(), &last = learning[r].bins.back();
    if (first.mean_log && last.mean_log) {
      figure.description += renderer + ": " + seconds_text(std::exp(*first.mean_log)) +
                            " in the first part, " + seconds_text(std::exp(*last.mean_log)) +
                            " in the last. ";
    }
    if (const auto& slope = learning[r].mean_slope) {
      std::string text = renderer + ": " + fixed(100 * std::expm1(*slope), 1) + " % per 100 trials";
      if (const auto& ends = learning[r].slope.log_ratio_ci95) {
        text += " (95 % interval " + fixed(100 * std::expm1(ends->low), 1) + " to " +
                fixed(100 * std::expm1(ends->high), 1) + " %)";
      }
      slopes += text + ". ";
    }
  }
  figure.description += slopes;
  figure.panels.push_back(std::move(panel));
  figure.notes.push_back(
      "Each participant’s times relative to their own mean of the shape, then the mean over "
      "participants, the renderer’s mean added back; bars: 95 % interval of that mean (t)." +
      (slopes.empty() ? "" : " Change of the time: " + slopes));
  return figure;
}

Figure order_of(const Analysis& analysis) {
  Figure figure = new_figure(analysis, "order", "Reduction by the order of the renderers");
  const std::size_t shapes = shown_shapes(analysis, figure);
  const std::size_t comparisons = shown_comparisons(analysis, figure);
  double low = 0, high = 10;
  for (std::size_t c = 0; c < comparisons; ++c) {
    for (std::size_t s = 0; s < shapes; ++s) {
      const OrderEffect& order = analysis.practice.pairs[c].shapes[s];
      for (const OrderGroup* group : {&order.reference_first, &order.renderer_first}) {
        if (!group->mean_log_ratio) continue;
        low = std::min(low, percent_reduction(*group->mean_log_ratio));
        high = std::max(high, percent_reduction(*group->mean_log_ratio));
      }
      if (const auto& ends = order.balanced_ci95) {
        low = std::min(low, percent_reduction(*ends).low);
        high = std::max(high, percent_reduction(*ends).high);
      }
    }
  }
  const RendererPair& first = analysis.comparisons.front().pair;
  const auto add_entry = [&](const std::string& renderer) {
    const RendererStyle style = style_of(analysis, renderer);
    figure.legend.push_back({printable(renderer, 200) + " first", style.role, style.shape});
  };
  for (std::size_t c = 0; c < comparisons; ++c) {
    const RendererPair& pair = analysis.comparisons[c].pair;
    Panel panel = comparison_panel(analysis, pair, shapes, 60);
    panel.x = names_axis(analysis.table.shapes, shapes, "");
    panel.y =
        linear_axis(std::max(low, -150.0), high, gain_title(analysis, "less time", "than with"));
    panel.height = 300;
    if (!add_orders(panel, analysis, c, shapes, figure.description)) continue;
    if (figure.panels.empty()) add_entry(pair.reference);
    add_entry(pair.renderer);
    figure.panels.push_back(std::move(panel));
  }
  if (figure.panels.empty()) return figure;
  figure.legend.push_back({"orders balanced", Role::ink, MarkerShape::diamond});
  figure.notes.insert(
      figure.notes.begin(),
      "Practice makes the second renderer appear faster: the gain of participants "
      "who began with " +
          with_article(short_name(first.reference)) +
          " is then too large, that of the others too small. "
          "The mean of both groups is free of this bias (two-period crossover); bars: 95 % "
          "interval.");
  return figure;
}

}  // namespace palpate::analysis
