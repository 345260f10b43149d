#include "analysis/figures/panel_drawing.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "analysis/figures/label_placement.h"
#include "analysis/figures/marks.h"
#include "analysis/text.h"

namespace palpate::analysis {

namespace {

constexpr std::size_t kLongestName = 18;  // characters of a name beside an axis
constexpr double kTickSize = 12, kNameSize = 13, kLineHeight = 15;  // px

const std::string& colour(const Palette& palette, Role role) {
  return palette[static_cast<std::size_t>(role)];
}

std::string tick_text(const Tick& tick) { return shortened(tick.label, kLongestName); }

/// Which ticks have labels: every `every`-th from `first` on, the fewest left out so that labels do
/// not overlap; the tick at 0 has one.
struct LabelStride {
  std::size_t every = 1, first = 0;
  bool has_label(std::size_t tick) const { return tick % every == first; }
};

/// \param at px of each tick along the axis \param lengths px of each label along the axis
LabelStride label_stride(const FigureAxis& axis, const std::vector<double>& at,
                         const std::vector<double>& lengths) {
  const std::size_t n = axis.ticks.size();
  const auto zero = static_cast<std::size_t>(
      std::ranges::find_if(axis.ticks, [](const Tick& tick) { return tick.at == 0; }) -
      axis.ticks.begin());
  LabelStride stride;
  for (; stride.every < n; ++stride.every) {
    stride.first = zero < n ? zero % stride.every : 0;
    bool apart = true;
    for (std::size_t i = stride.first; i + stride.every < n; i += stride.every) {
      const std::size_t next = i + stride.every;
      apart = apart && std::fabs(at[next] - at[i]) >= (lengths[i] + lengths[next]) / 2;
    }
    if (apart) break;
  }
  return stride;
}

void draw_left_axis(Svg& svg, const PlacedPanel& placed, const Palette& palette) {
  const Panel& panel = *placed.panel;
  std::vector<double> at;
  for (const Tick& tick : panel.y.ticks) at.push_back(placed.y(tick.at));
  const LabelStride stride =
      label_stride(panel.y, at, std::vector<double>(at.size(), panel.y.names ? 0 : kTickSize));
  for (std::size_t i = 0; i < at.size(); ++i) {
    if (panel.y.grid) {
      svg.line(placed.left, at[i], placed.left + placed.width, at[i], colour(palette, Role::grid));
    }
    if (!stride.has_label(i)) continue;
    svg.text(placed.left - 9, at[i] + 4, tick_text(panel.y.ticks[i]),
             {kTickSize, colour(palette, Role::soft), Svg::Anchor::end});
  }
  if (panel.y.title.empty()) return;
  svg.text(placed.left - left_axis_width(panel) + 12, placed.top + panel.height / 2,
           fitting(panel.y.title, panel.height + 20, kTickSize),
           {kTickSize, colour(palette, Role::soft), Svg::Anchor::middle, false, -90});
}

/// Names of categories, rotated where one is wider than its slot. \return height used, px
double draw_names(Svg& svg, const PlacedPanel& placed, const Palette& palette) {
  const Panel& panel = *placed.panel;
  const double bottom = placed.top + panel.height;
  const double slot = placed.width / std::max(1.0, panel.x.high - panel.x.low);
  const bool rotated = std::ranges::any_of(panel.x.ticks, [&](const Tick& tick) {
    return text_width(tick_text(tick), kNameSize) > slot - 6;
  });
  for (const Tick& tick : panel.x.ticks) {
    const double x = placed.x(tick.at);
    if (rotated) {
      svg.text(x + 5, bottom + 20, tick_text(tick),
               {kNameSize, colour(palette, Role::ink), Svg::Anchor::end, false, -30});
    } else {
      svg.text(x, bottom + 20, tick_text(tick),
               {kNameSize, colour(palette, Role::ink), Svg::Anchor::middle});
    }
  }
  return rotated ? 84 : 34;
}

/// Ticks of a numeric lower axis. \return height used, px
double draw_numbers(Svg& svg, const PlacedPanel& placed, const Palette& palette) {
  const Panel& panel = *placed.panel;
  const double bottom = placed.top + panel.height;
  constexpr double kApart = 8;  // px between two labels
  std::vector<double> at, lengths;
  for (const Tick& tick : panel.x.ticks) {
    at.push_back(placed.x(tick.at));
    lengths.push_back(text_width(tick_text(tick), kTickSize) + kApart);
  }
  const LabelStride stride = label_stride(panel.x, at, lengths);
  for (std::size_t i = 0; i < at.size(); ++i) {
    if (panel.x.grid) svg.line(at[i], placed.top, at[i], bottom, colour(palette, Role::grid));
    if (!stride.has_label(i)) continue;
    svg.text(at[i], bottom + 20, tick_text(panel.x.ticks[i]),
             {kTickSize, colour(palette, Role::soft), Svg::Anchor::middle});
  }
  return 34;
}

void draw_text(Svg& svg, const PlacedPanel& placed, const Palette& palette, const Mark& mark) {
  const double available = mark.max_width > 0 ? mark.max_width * placed.width /
                                                    (placed.panel->x.high - placed.panel->x.low)
                                              : 0;
  const auto fits = [&](std::string_view text) {
    return available == 0 || text_width(text, mark.size, mark.bold) <= available;
  };
  const std::string& text = fits(mark.text) ? mark.text : mark.shorter;
  if (text.empty() || !fits(text)) return;
  svg.text(placed.x(mark.x[0]) + mark.dx, placed.y(mark.y[0]) + mark.dy, text,
           {mark.size, colour(palette, mark.role), static_cast<Svg::Anchor>(mark.anchor + 1),
            mark.bold});
}

void draw_mark(Svg& svg, const PlacedPanel& placed, const Palette& palette, const Mark& mark) {
  if (mark.kind == Mark::Kind::text) {
    draw_text(svg, placed, palette, mark);
    return;
  }
  const bool grouped = !mark.text.empty() || !mark.participant.empty();
  if (grouped) svg.begin_group(mark.text, mark.participant);
  std::vector<double> x, y;
  x.reserve(mark.x.size());
  y.reserve(mark.y.size());
  for (const double value : mark.x) x.push_back(placed.x(value));
  for (const double value : mark.y) y.push_back(placed.y(value));
  const std::string& fill = colour(palette, mark.role);
  switch (mark.kind) {
    case Mark::Kind::rect:
      svg.area({x[0], x[1], x[1], x[0]}, {y[0], y[0], y[1], y[1]}, fill, mark.opacity, "none", 0);
      break;
    case Mark::Kind::area:
      svg.area(x, y, fill, mark.opacity, fill, mark.size);
      break;
    case Mark::Kind::line:
      svg.path(x, y, fill, mark.size, mark.opacity, mark.dashed);
      break;
    case Mark::Kind::interval:
      svg.line(x[0], y[0], x[0], y[1], fill, mark.size, mark.opacity);
      break;
    case Mark::Kind::symbol:
      draw_symbol(svg, palette, mark.shape, mark.role, x[0] + mark.dx, y[0] + mark.dy, mark.size,
                  mark.opacity);
      break;
    case Mark::Kind::text:
    case Mark::Kind::label:
      break;
  }
  if (grouped) svg.end_group();
}

}  // namespace

double left_axis_width(const Panel& panel) {
  constexpr double kLeast = 58, kWithoutTitle = 16, kWithTitle = 44;
  double widest = 0;
  for (const Tick& tick : panel.y.ticks) {
    widest = std::max(widest, text_width(tick_text(tick), kTickSize));
  }
  return std::max(kLeast, widest + (panel.y.title.empty() ? kWithoutTitle : kWithTitle));
}

double draw_axes(Svg& svg, const PlacedPanel& placed, const Palette& palette) {
  draw_left_axis(svg, placed, palette);
  const Panel& panel = *placed.panel;
  double below =
      panel.x.names ? draw_names(svg, placed, palette) : draw_numbers(svg, placed, palette);
  if (panel.x.title.empty()) return below;
  const double available = placed.width + left_axis_width(panel);
  for (const std::string& line : lines_of(panel.x.title, available, kTickSize)) {
    const double half = text_width(line, kTickSize) / 2;
    // Centred below the panel, but within the drawing on the left.
    const double centre =
        std::max(placed.left + placed.width / 2,
                 placed.left - left_axis_width(panel) + std::min(half, available / 2));
    svg.text(centre, placed.top + panel.height + below + 8, line,
             {kTickSize, colour(palette, Role::soft), Svg::Anchor::middle});
    below += kLineHeight;
  }
  return below + 5;
}

void draw_marks(Svg& svg, const PlacedPanel& placed, const Palette& palette) {
  using Kind = Mark::Kind;
  for (const Kind kind :
       {Kind::rect, Kind::area, Kind::line, Kind::interval, Kind::symbol, Kind::text}) {
    for (const Mark& mark : placed.panel->marks) {
      if (mark.kind == kind) draw_mark(svg, placed, palette, mark);
    }
  }
  for (const Mark& text : placed_labels(*placed.panel, placed.width)) {
    draw_text(svg, placed, palette, text);
  }
}

void draw_symbol(Svg& svg, const Palette& palette, MarkerShape shape, Role role, double x, double y,
                 double half, double opacity) {
  const std::string& fill = colour(palette, role);
  switch (shape) {
    case MarkerShape::circle:
      svg.circle(x, y, half, fill, opacity);
      break;
    case MarkerShape::square:
      svg.square(x, y, 0.9 * half, fill, opacity);
      break;
    case MarkerShape::diamond:
      svg.diamond(x, y, half, fill, colour(palette, Role::page));
      break;
    case MarkerShape::up:
    case MarkerShape::down:
      svg.triangle(x, y, half, shape == MarkerShape::up, fill);
      break;
    case MarkerShape::dash:
      svg.line(x - half, y, x + half, y, fill, 2, opacity);
      break;
    case MarkerShape::right:
    case MarkerShape::cross:
    case MarkerShape::left:
    case MarkerShape::saltire: {
      std::vector<double> xs, ys;
      for (const auto& [corner_x, corner_y] : outline_of(shape)) {
        xs.push_back(x + half * corner_x);
        ys.push_back(y + half * corner_y);
      }
      svg.area(xs, ys, fill, opacity, "none", 0);
      break;
    }
  }
}

}  // namespace palpate::analysis
