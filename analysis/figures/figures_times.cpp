// Distributions of times, binned: a million trials take no more room than a thousand.

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "analysis/figures/figures_parts.h"
#include "analysis/text.h"

namespace palpate::analysis {

namespace {

constexpr std::size_t kBins = 80;
constexpr std::size_t kFewTimes = 12;  // below it each time is drawn: a curve would pretend
using Bins = std::array<double, kBins>;

/// log10 of s, sorted, of the trials that the times use. [renderer][shape]
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

double quantile_of(const std::vector<float>& sorted, double share) {
  const double at = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  const double part = at - static_cast<double>(below);
  return (1 - part) * static_cast<double>(sorted[below]) +
         part * static_cast<double>(sorted[above]);
}

/// Gaussian kernel of Silverman's (1986) width on bins from low to high; sums to 1.
Bins density(const std::vector<float>& sorted, double low, double high) {
  const double step = (high - low) / kBins;
  Bins counts{}, smooth{};
  for (const float time : sorted) {
    const double bin = (static_cast<double>(time) - low) / step;
    counts[static_cast<std::size_t>(std::clamp(bin, 0.0, kBins - 1.0))] += 1;
  }
  const double spread = (quantile_of(sorted, 0.75) - quantile_of(sorted, 0.25)) / 1.34;
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

/// Where a cell is drawn: a half of a violin on one side of x, or both halves around it.
struct Stand {
  double x = 0;
  double side = 0;  ///< -1 or 1: the half there; 0: both
  double scale = 1;
};

/// A violin, or its half that bulges to one side. \param limit log10 of s, where it ends at the
/// latest
void add_violin(Panel& panel, Role role, const Bins& share, const Stand& stand, double limit,
                const std::string& text) {
  const double step = (panel.y.high - panel.y.low) / kBins;
  Mark area = line_mark(role, {}, {}, 1.2);
  area.kind = Mark::Kind::area;
  area.opacity = 0.4;
  area.text = text;
  const auto corner = [&](double offset, double bin) {
    area.x.push_back(stand.x + offset);
    area.y.push_back(std::min(panel.y.low + (bin + 0.5) * step, limit));
  };
  std::size_t first = 0, last = kBins - 1;
  const double least = 0.004 / stand.scale;
  while (first < last && share[first] < least) ++first;
  while (last > first && share[last] < least) --last;
  // Smoothing spreads times beyond the limit, where there can be none.
  while (last > first && panel.y.low + (static_cast<double>(last) - 0.5) * step > limit) --last;
  if (stand.side != 0) {
    const auto beside = [&](double width) { return stand.side * (0.02 + width); };
    corner(beside(0), static_cast<double>(first));
    for (std::size_t b = first; b <= last; ++b) {
      corner(beside(stand.scale * share[b]), static_cast<double>(b));
    }
    corner(beside(0), static_cast<double>(last));
  } else {
    for (std::size_t b = first; b <= last; ++b) {
      corner(stand.scale * share[b], static_cast<double>(b));
    }
    for (std::size_t b = last + 1; b-- > first;) {
      corner(-stand.scale * share[b], static_cast<double>(b));
    }
  }
  panel.marks.push_back(std::move(area));
}

void add_cell(Panel& panel, const Look& look, const std::vector<float>& times, const Bins& share,
              const Stand& stand, double limit, const std::string& text) {
  if (times.size() < kFewTimes) {
    for (const float time : times) {
      panel.marks.push_back(symbol(look.role, look.shape, stand.x + stand.side * 0.12,
                                   static_cast<double>(time), 3, text));
    }
    return;
  }
  add_violin(panel, look.role, share, stand, limit, text);
  const double at = stand.x + stand.side * 0.055;
  panel.marks.push_back(
      line_mark(look.role, {at, at}, {quantile_of(times, 0.25), quantile_of(times, 0.75)}, 4));
  const double median = quantile_of(times, 0.5);
  panel.marks.push_back(symbol(look.role, look.shape, at, median, 5.2, text));
  panel.marks.push_back(symbol(Role::page, look.shape, at, median, 3, text));
}

/// Two renderers share a place, back to back; more stand side by side.
Stand stand_of(const Analysis& analysis, std::size_t renderer, std::size_t renderers,
               std::size_t shape, double widest) {
  const double slot = static_cast<double>(shape) + 0.5, scale = 0.4 / std::max(widest, 1e-9);
  if (renderers <= 2) {
    const bool right = analysis.table.renderers[renderer] == "ray" || renderer == 1;
    return {slot, renderers == 2 && renderer == 0 ? -1.0 : right ? 1.0 : -1.0, scale};
  }
  const double n = static_cast<double>(renderers);
  return {slot - 0.45 + 0.9 * (static_cast<double>(renderer) + 0.5) / n, 0, scale / n};
}

/// A cell's time-outs above the middle of its violin, or of its half. \param room for the text,
/// in slots
void add_time_outs(Panel& panel, const TimeOutCell& cell, const Look& look, const Stand& stand,
                   double room, const std::string& name) {
  if (cell.n_timeouts == 0) return;
  const std::string share = fixed(100 * cell.share(), cell.share() < 0.0995 ? 1 : 0) + " %";
  const double x = stand.x + 0.25 * stand.side;
  Mark mark = text_mark(look.role, x, panel.y.high,
                        std::to_string(cell.n_timeouts) + " (" + share + ")", 11.5);
  mark.bold = true;
  mark.dy = 16;
  mark.room = room;
  mark.shorter = share;
  panel.marks.push_back(std::move(mark));
  panel.marks.push_back(symbol(look.role, Shape::up, x, std::log10(*cell.highest_limit), 4,
                               name + ": " + counted(cell.n_timeouts, "time-out", "time-outs") +
                                   " of " + counted(cell.n_trials, "trial", "trials") + " (" +
                                   share + "), longer than the limit"));
  panel.marks.back().dy = -6;
}

/// The limits of all time-outs that are drawn, log10 of s, and a few lines at most.
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

/// A line for each limit, named where the axis has its ticks; those close by give way.
void add_limits(Panel& panel, const std::vector<double>& limits) {
  constexpr double kApart = 0.07;  // log10 of s: a line of text
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
  // Above the highest limit there is room for what ended there.
  const double top = limits.empty() ? high + 0.08 : std::max(high, limits.back()) + 0.17;
  Panel panel;
  panel.x = names_axis(table.shapes, shapes, "");
  panel.y = log_axis(low - 0.08, top, "time (s, logarithmic)");
  panel.width = std::max(
      kWide, std::max(70.0, 35.0 * static_cast<double>(renderers)) * static_cast<double>(shapes));
  panel.height = 360;
  std::vector<std::vector<Bins>> shares(times.size(), std::vector<Bins>(shapes));
  double widest = 0;
  for (std::size_t r = 0; r < times.size(); ++r) {
    for (std::size_t s = 0; s < shapes; ++s) {
      if (times[r][s].size() < kFewTimes) continue;
      shares[r][s] = density(times[r][s], panel.y.low, panel.y.high);
      widest = std::max(widest, *std::ranges::max_element(shares[r][s]));
    }
  }
  const double room = 0.85 / static_cast<double>(renderers);
  for (std::size_t s = 0; s < shapes; ++s) {
    for (std::size_t r = 0; r < times.size(); ++r) {
      const TimeOutCell& outs = analysis.time_outs.cells[r][s];
      const std::string name =
          stimuli::printable(table.shapes[s], 40) + ", " + short_name(table.renderers[r]);
      const Look look = look_of(analysis, table.renderers[r]);
      const Stand stand = stand_of(analysis, r, renderers, s, widest);
      if (outs.highest_limit) add_time_outs(panel, outs, look, stand, room, name);
      if (outs.n_timeouts > 0) {
        figure.description += name + ": " + counted(outs.n_timeouts, "time-out", "time-outs") +
                              " of " + counted(outs.n_trials, "trial", "trials") + ". ";
      }
      if (times[r][s].empty()) continue;
      std::string text = name + ": median " +
                         seconds_text(std::pow(10, quantile_of(times[r][s], 0.5))) +
                         ", middle half " + fixed(std::pow(10, quantile_of(times[r][s], 0.25)), 2) +
                         " to " + fixed(std::pow(10, quantile_of(times[r][s], 0.75)), 2) + " s, " +
                         counted(times[r][s].size(), "time", "times");
      add_cell(panel, look, times[r][s], shares[r][s], stand,
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
                                     : "; above the limit: trials that ended there, which have no "
                                       "time (share of the cell’s trials)") +
          ". Width: share of the trials "
          "(smoothed); mark: median; bar: the middle half of the trials. Cells of fewer "
          "than " +
          std::to_string(kFewTimes) + " times show each one.");
  return figure;
}

}  // namespace palpate::analysis
