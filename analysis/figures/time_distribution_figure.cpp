// Figure of the distributions of response times: violins (kernel density on log10 s) by shape and
// renderer, with median, quartiles and time-outs. Densities are binned, so that the file does not
// grow with the number of trials.

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "analysis/figures/panel_drawing.h"
#include "analysis/statistics/quantiles.h"
#include "analysis/text.h"

namespace palpate::analysis {

namespace {

constexpr std::size_t kBins = 80;
constexpr std::size_t kFewTimes = 12;  // below it, single times are drawn instead of a density
using Bins = std::array<double, kBins>;

/// log10 of s, sorted, of the trials with usable times. [renderer][shape]
using Times = std::vector<std::vector<std::vector<float>>>;

Times used_times(const Analysis& analysis) {
  Times times(analysis.table.renderers.size(),
              std::vector<std::vector<float>>(analysis.table.shapes.size()));
  for (const TrialRow& row : analysis.table.rows) {
    if (!row.correct || row.timed_out || row.answer < 0) continue;
    if (!(row.response_time >= analysis.settings.too_fast)) continue;
    times[row.renderer][row.shape].push_back(static_cast<float>(std::log10(row.response_time)));
  }
  for (auto& shapes : times) {
    for (auto& cell : shapes) std::ranges::sort(cell);
  }
  return times;
}

/// Gaussian kernel density on kBins bins from low to high, summing to 1; bandwidth 0.9 (IQR / 1.34)
/// n^-1/5 (Silverman 1986, eq. 3.31 without the sd), at least 0.6 bins.
Bins density(const std::vector<float>& sorted, double low, double high) {
  const double step = (high - low) / kBins;
  Bins counts{}, smooth{};
  for (const float time : sorted) {
    const double bin = (static_cast<double>(time) - low) / step;
    counts[static_cast<std::size_t>(std::clamp(bin, 0.0, kBins - 1.0))] += 1;
  }
  const double spread = (sorted_quantile(sorted, 0.75) - sorted_quantile(sorted, 0.25)) / 1.34;
  const double width =
      std::max(0.9 * spread * std::pow(static_cast<double>(sorted.size()), -0.2) / step, 0.6);
  double total = 0;
  for (std::size_t to = 0; to < kBins; ++to) {
    for (std::size_t from = 0; from < kBins; ++from) {
      const double z = (static_cast<double>(to) - static_cast<double>(from)) / width;
      smooth[to] += counts[from] * std::exp(-0.5 * z * z);
    }
    total += smooth[to];
  }
  for (double& value : smooth) value /= total;
  return smooth;
}

/// Position of a cell: half a violin on one side of x, or a whole one around x.
struct ViolinPosition {
  double x = 0;
  double side = 0;   ///< -1: left half, 1: right half, 0: both
  double scale = 1;  ///< half width in slots for each unit of density
};

/// A violin or half of one. \param limit log10 of s, its upper end: times beyond a limit do not
/// exist
void add_violin(Panel& panel, Role role, const Bins& bins, const ViolinPosition& position,
                double limit, const std::string& text) {
  const double step = (panel.y.high - panel.y.low) / kBins;
  Mark area = line_mark(role, {}, {}, 1.2);
  area.kind = Mark::Kind::area;
  area.opacity = 0.4;
  area.text = text;
  const auto corner = [&](double offset, double bin) {
    area.x.push_back(position.x + offset);
    area.y.push_back(std::min(panel.y.low + (bin + 0.5) * step, limit));
  };
  std::size_t first = 0, last = kBins - 1;
  const double least = 0.004 / position.scale;
  while (first < last && bins[first] < least) ++first;
  while (last > first && bins[last] < least) --last;
  // Cut the kernel at the limit, beyond which there are no times.
  while (last > first && panel.y.low + (static_cast<double>(last) - 0.5) * step > limit) --last;
  if (position.side != 0) {
    const auto beside = [&](double width) { return position.side * (0.02 + width); };
    corner(beside(0), static_cast<double>(first));
    for (std::size_t b = first; b <= last; ++b) {
      corner(beside(position.scale * bins[b]), static_cast<double>(b));
    }
    corner(beside(0), static_cast<double>(last));
  } else {
    for (std::size_t b = first; b <= last; ++b) {
      corner(position.scale * bins[b], static_cast<double>(b));
    }
    for (std::size_t b = last + 1; b-- > first;) {
      corner(-position.scale * bins[b], static_cast<double>(b));
    }
  }
  panel.marks.push_back(std::move(area));
}

void add_cell(Panel& panel, const RendererStyle& style, const std::vector<float>& times,
              const Bins& bins, const ViolinPosition& position, double limit,
              const std::string& text) {
  if (times.size() < kFewTimes) {
    for (const float time : times) {
      panel.marks.push_back(symbol(style.role, style.shape, position.x + position.side * 0.12,
                                   static_cast<double>(time), 3, text));
    }
    return;
  }
  add_violin(panel, style.role, bins, position, limit, text);
  const double at = position.x + position.side * 0.055;
  panel.marks.push_back(line_mark(style.role, {at, at},
                                  {sorted_quantile(times, 0.25), sorted_quantile(times, 0.75)}, 4));
  const double median = sorted_quantile(times, 0.5);
  panel.marks.push_back(symbol(style.role, style.shape, at, median, 5.2, text));
  panel.marks.push_back(symbol(Role::page, style.shape, at, median, 3, text));
}

/// Two renderers: half violins back to back; more: whole violins side by side. \param widest
/// largest density of all cells
ViolinPosition violin_position(const Analysis& analysis, std::size_t renderer,
                               std::size_t renderers, std::size_t shape, double widest) {
  const double slot = static_cast<double>(shape) + 0.5, scale = 0.4 / std::max(widest, 1e-9);
  if (renderers <= 2) {
    const bool right = analysis.table.renderers[renderer] == "ray" || renderer == 1;
    return {slot, renderers == 2 && renderer == 0 ? -1.0 : right ? 1.0 : -1.0, scale};
  }
  const double n = static_cast<double>(renderers);
  return {slot - 0.45 + 0.9 * (static_cast<double>(renderer) + 0.5) / n, 0, scale / n};
}

/// Number and percentage of a cell's time-outs, above its violin. \param max_width of the text, in
/// slots
void add_time_outs(Panel& panel, const TimeOutCell& cell, const RendererStyle& style,
                   const ViolinPosition& position, double max_width, const std::string& name) {
  if (cell.n_timeouts == 0) return;
  const std::string percent =
      fixed(100 * cell.proportion(), cell.proportion() < 0.0995 ? 1 : 0) + " %";
  const double x = position.x + 0.25 * position.side;
  Mark mark = text_mark(style.role, x, panel.y.high,
                        std::to_string(cell.n_timeouts) + " (" + percent + ")", 11.5);
  mark.bold = true;
  mark.dy = 16;
  mark.max_width = max_width;
  mark.shorter = percent;
  panel.marks.push_back(std::move(mark));
  panel.marks.push_back(symbol(style.role, MarkerShape::up, x, std::log10(*cell.highest_limit), 4,
                               name + ": " + counted(cell.n_timeouts, "time-out", "time-outs") +
                                   " of " + counted(cell.n_trials, "trial", "trials") + " (" +
                                   percent + "), longer than the limit"));
  panel.marks.back().dy = -6;
}

/// The distinct limits of the time-outs drawn, log10 of s, ascending; of more than three only the
/// first and last.
std::vector<double> limits_of(const Analysis& analysis, std::size_t renderers, std::size_t shapes) {
  std::vector<double> limits;
  for (std::size_t r = 0; r < renderers; ++r) {
    for (std::size_t s = 0; s < shapes; ++s) {
      for (const TimeOutGroup& group : analysis.time_outs.cells[r][s].groups) {
        if (group.has_limit()) limits.push_back(std::log10(group.limit));
      }
    }
  }
  std::ranges::sort(limits);
  limits.erase(
      std::unique(limits.begin(), limits.end(), [](double a, double b) { return b - a < 0.005; }),
      limits.end());
  constexpr std::size_t kMostLines = 3;
  if (limits.size() > kMostLines) limits = {limits.front(), limits.back()};
  return limits;
}

/// A line for each limit, with its own tick on the y axis; ticks close to it are left out.
void add_limits(Panel& panel, const std::vector<double>& limits) {
  constexpr double kApart = 0.07;  // log10 of s: height of a line of text
  for (const double limit : limits) {
    const std::string seconds = fixed(std::pow(10, limit), limit < 1 ? 2 : 0) + " s";
    Mark line = line_mark(Role::amber, {panel.x.low, panel.x.high}, {limit, limit}, 1.4);
    line.text = "limit of " + seconds;
    panel.marks.push_back(std::move(line));
    std::erase_if(panel.y.ticks,
                  [&](const Tick& tick) { return std::fabs(tick.at - limit) < kApart; });
    panel.y.ticks.push_back({limit, "limit " + seconds});
  }
}

}  // namespace

Figure times_of(const Analysis& analysis) {
  Figure figure = new_figure(analysis, "times", "Distributions of the times");
  const auto& table = analysis.table;
  const std::size_t shapes = shown_shapes(analysis, figure);
  const std::size_t renderers = shown_renderers(analysis, figure);
  Times times = used_times(analysis);
  times.resize(renderers);
  double low = 1e9, high = -1e9;
  for (const auto& renderer : times) {
    for (std::size_t s = 0; s < shapes; ++s) {
      if (renderer[s].empty()) continue;
      low = std::min(low, static_cast<double>(renderer[s].front()));
      high = std::max(high, static_cast<double>(renderer[s].back()));
    }
  }
  if (low > high) return figure;
  const std::vector<double> limits = limits_of(analysis, renderers, shapes);
  // Space above the highest limit for the counts of time-outs.
  const double top = limits.empty() ? high + 0.08 : std::max(high, limits.back()) + 0.17;
  Panel panel;
  panel.x = names_axis(table.shapes, shapes, "");
  panel.y = log_axis(low - 0.08, top, "time (s, logarithmic)");
  panel.width = std::max(kFullPanelWidth, std::max(70.0, 35.0 * static_cast<double>(renderers)) *
                                              static_cast<double>(shapes));
  panel.height = 360;
  std::vector<std::vector<Bins>> densities(times.size(), std::vector<Bins>(shapes));
  double widest = 0;
  for (std::size_t r = 0; r < times.size(); ++r) {
    for (std::size_t s = 0; s < shapes; ++s) {
      if (times[r][s].size() < kFewTimes) continue;
      densities[r][s] = density(times[r][s], panel.y.low, panel.y.high);
      widest = std::max(widest, *std::ranges::max_element(densities[r][s]));
    }
  }
  const double max_width = 0.85 / static_cast<double>(renderers);
  for (std::size_t s = 0; s < shapes; ++s) {
    for (std::size_t r = 0; r < times.size(); ++r) {
      const TimeOutCell& outs = analysis.time_outs.cells[r][s];
      const std::string name =
          printable(table.shapes[s], 40) + ", " + short_name(table.renderers[r]);
      const RendererStyle style = style_of(analysis, table.renderers[r]);
      const ViolinPosition position = violin_position(analysis, r, renderers, s, widest);
      if (outs.highest_limit) add_time_outs(panel, outs, style, position, max_width, name);
      if (outs.n_timeouts > 0) {
        figure.description += name + ": " + counted(outs.n_timeouts, "time-out", "time-outs") +
                              " of " + counted(outs.n_trials, "trial", "trials") + ". ";
      }
      if (times[r][s].empty()) continue;
      std::string text =
          name + ": median " + seconds_text(std::pow(10, sorted_quantile(times[r][s], 0.5))) +
          ", middle 50 % " + fixed(std::pow(10, sorted_quantile(times[r][s], 0.25)), 2) + " to " +
          fixed(std::pow(10, sorted_quantile(times[r][s], 0.75)), 2) + " s, " +
          counted(times[r][s].size(), "time", "times");
      add_cell(panel, style, times[r][s], densities[r][s], position,
               std::max(limits.empty()       ? panel.y.high
                        : outs.highest_limit ? std::log10(*outs.highest_limit)
                                             : limits.back(),
                        static_cast<double>(times[r][s].back())),
               text);
      figure.description += text + ". ";
    }
  }
  add_limits(panel, limits);
  figure.panels.push_back(std::move(panel));
  add_renderers(figure, analysis, renderers);
  figure.notes.insert(
      figure.notes.begin(),
      "All correct answers of all participants" +
          std::string(limits.empty() ? ""
                                     : "; above the limit: trials that ended there, without a "
                                       "time (percent of the cell’s trials)") +
          ". Width: density of the trials "
          "(smoothed); mark: median; bar: the middle 50 % of the trials. Cells of fewer "
          "than " +
          std::to_string(kFewTimes) + " times show each one.");
  return figure;
}

}  // namespace palpate::analysis
