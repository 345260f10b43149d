#include "analysis/figures/panel_drawing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "analysis/figures/svg.h"
#include "analysis/statistics/conclusions.h"
#include "analysis/text.h"

namespace palpate::analysis {
namespace {

/// Distance of ticks: 1, 2 or 5 times a power of ten, near a fifth of `span`.
double round_step(double span) {
  const double power = std::pow(10.0, std::floor(std::log10(span / 5)));
  const double factor = span / 5 / power;
  return power * (factor < 1.5 ? 1 : factor < 3.5 ? 2 : factor < 7.5 ? 5 : 10);
}

/// "0.02", "500", "10⁻⁶", "2·10⁻⁶". \param factor 1, 2 or 5, times 10 to the `exponent`
std::string log_tick_text(int factor, int exponent) {
  constexpr int kFewDecimals = 3, kFewZeros = 4;
  if (exponent >= -kFewDecimals && exponent <= kFewZeros) {
    return fixed(factor * std::pow(10.0, exponent), std::max(0, -exponent));
  }
  constexpr const char* kRaised[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string text = factor == 1 ? "" : std::to_string(factor) + "·";
  text += exponent < 0 ? "10⁻" : "10";
  for (const char digit : std::to_string(std::abs(exponent))) text += kRaised[digit - '0'];
  return text;
}

constexpr double kPoint = 7;               // px: half the width of a point and its margin
constexpr double kBeside = 11;             // px from the point to its label
constexpr double kLeft = 12, kRight = 12;  // px beside the panel that a label may take

/// Axis-aligned rectangle in px from the panel's upper left corner, y down.
struct Box {
  double left, right, top, bottom;

  bool meets(const Box& other) const {
    return left < other.right && other.left < right && top < other.bottom && other.top < bottom;
  }
};

class Placement {
 public:
  Placement(const Panel& panel, double width) : panel_(panel), width_(width) {
    for (const Mark& mark : panel.marks) {
      if (mark.kind == Mark::Kind::line) {
        for (std::size_t i = 1; i < mark.x.size(); ++i) {
          take_segment(mark.x[i - 1], mark.y[i - 1], mark.x[i], mark.y[i]);
        }
      } else if (mark.kind == Mark::Kind::interval) {
        take_segment(mark.x[0], mark.y[0], mark.x[0], mark.y[1]);
      } else if (mark.kind == Mark::Kind::label) {
        const double px = x(mark.x[0]), py = y(mark.y[0]);
        taken_.push_back({px - kPoint, px + kPoint, py - kPoint, py + kPoint});
      }
    }
  }

  /// Chooses the candidate position with the fewest overlaps and marks it as taken.
  Mark put(const Mark& label) {
    Mark best;
    Box best_box{};
    std::ptrdiff_t fewest = std::ssize(taken_) + 4;
    for (const double dy : {4.0, -10.0, 19.0, -26.0, 35.0, -44.0, 53.0, -62.0, 71.0}) {
      for (const int anchor : {-1, 1}) {
        Mark text = label;
        text.kind = Mark::Kind::text;
        text.anchor = anchor;
        text.dx = -kBeside * anchor;
        text.dy = dy;
        const Box box = box_of(text);
        const std::ptrdiff_t hidden = n_hidden(box);
        if (hidden >= fewest) continue;
        fewest = hidden;
        best = std::move(text);
        best_box = box;
      }
    }
    taken_.push_back(best_box);
    return best;
  }

 private:
  void take_segment(double x0, double y0, double x1, double y1) {
    constexpr int kPieces = 4;  // of an oblique segment, as one bounding box would cover too much
    const int pieces = x0 == x1 || y0 == y1 ? 1 : kPieces;
    for (int i = 0; i < pieces; ++i) {
      const double from = static_cast<double>(i) / pieces, to = static_cast<double>(i + 1) / pieces;
      const auto [left, right] =
          std::minmax({x(std::lerp(x0, x1, from)), x(std::lerp(x0, x1, to))});
      const auto [top, bottom] =
          std::minmax({y(std::lerp(y0, y1, from)), y(std::lerp(y0, y1, to))});
      taken_.push_back({left - 2, right + 2, top - 2, bottom + 2});
    }
  }

  double x(double value) const {
    return (value - panel_.x.low) / (panel_.x.high - panel_.x.low) * width_;
  }
  double y(double value) const {
    return (panel_.y.high - value) / (panel_.y.high - panel_.y.low) * panel_.height;
  }

  Box box_of(const Mark& text) const {
    const double wide = text_width(text.text, text.size, text.bold);
    const double left = x(text.x[0]) + text.dx - (text.anchor > 0 ? wide : 0);
    const double base = y(text.y[0]) + text.dy;
    return {left, left + wide, base - text.size, base + 3};
  }

  /// Number of overlaps of a box; extending beyond the panel counts as three.
  std::ptrdiff_t n_hidden(const Box& box) const {
    const bool outside = box.left < -kLeft || box.right > width_ + kRight;
    return std::ranges::count_if(taken_, [&](const Box& other) { return box.meets(other); }) +
           (outside ? 3 : 0);
  }

  const Panel& panel_;
  double width_;
  std::vector<Box> taken_;  ///< points, intervals, lines, then labels placed so far
};

constexpr std::size_t kLongestName = 18;  // characters of a name beside an axis
constexpr double kTickSize = 12, kNameSize = 13, kLineHeight = 15;  // px

const std::string& colour(const Palette& palette, Role role) {
  return palette[static_cast<std::size_t>(role)];
}

std::string tick_text(const Tick& tick) { return shortened(tick.label, kLongestName); }

/// The labelled ticks: every `every`-th from `first` on, as many as fit without overlap; the tick
/// at 0 is labelled.
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

/// Names of categories, rotated if one is wider than its slot. \return height used, px
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

FigureAxis names_axis(const std::vector<std::string>& names, std::size_t shown, std::string title) {
  FigureAxis axis;
  axis.title = std::move(title);
  axis.high = static_cast<double>(std::max<std::size_t>(shown, 1));
  axis.grid = false;
  axis.names = true;
  for (std::size_t i = 0; i < shown; ++i) {
    axis.ticks.push_back({static_cast<double>(i) + 0.5, printable(names[i], 160)});
  }
  return axis;
}

FigureAxis linear_axis(double low, double high, std::string title) {
  if (!(high > low)) high = low + 1;
  const double step = round_step(high - low);
  FigureAxis axis;
  axis.title = std::move(title);
  axis.low = step * std::floor(low / step + 1e-9);
  axis.high = step * std::ceil(high / step - 1e-9);
  const int decimals = step < 1 ? static_cast<int>(std::ceil(-std::log10(step) - 1e-9)) : 0;
  const auto count = std::lround((axis.high - axis.low) / step);
  for (long i = 0; i <= count; ++i) {
    const double at = axis.low + static_cast<double>(i) * step;
    axis.ticks.push_back({at, fixed(at, decimals)});
  }
  return axis;
}

FigureAxis log_axis(double low, double high, std::string title) {
  constexpr double kMostWithFactors = 3.5;  // decades; beyond, no ticks at 2 and 5
  constexpr double kMostTicks = 9;          // beyond, every second, third ... power of ten
  if (!(high > low)) {
    low -= 0.1;
    high += 0.1;
  }
  FigureAxis axis;
  axis.title = std::move(title);
  axis.low = low;
  axis.high = high;
  const int last = static_cast<int>(std::ceil(high));
  const int step = std::max(1, static_cast<int>(std::ceil((high - low) / kMostTicks)));
  for (int exponent = static_cast<int>(std::floor(low)); exponent <= last; ++exponent) {
    if (exponent % step != 0) continue;
    for (const int factor : {1, 2, 5}) {
      const double at = exponent + std::log10(factor);
      if (factor > 1 && high - low > kMostWithFactors) continue;
      if (at < low - 1e-9 || at > high + 1e-9) continue;
      axis.ticks.push_back({at, log_tick_text(factor, exponent)});
    }
  }
  return axis;
}

FigureAxis decades_axis(double low, double high, std::string title) {
  const double first = std::floor(std::log10(low) + 1e-9);
  const double last = std::ceil(std::log10(high) - 1e-9);
  return log_axis(first, std::max(last, first + 1), std::move(title));
}

std::vector<std::pair<double, double>> outline_of(MarkerShape shape) {
  constexpr double kArm = 0.36;  // half the width of an arm of the cross
  std::vector<std::pair<double, double>> corners;
  if (shape == MarkerShape::right || shape == MarkerShape::left) {
    corners = {{1, 0}, {-0.8, -1}, {-0.8, 1}};
    if (shape == MarkerShape::left) {
      for (auto& corner : corners) corner.first = -corner.first;
    }
  } else if (shape == MarkerShape::cross || shape == MarkerShape::saltire) {
    corners = {{kArm, -1}, {kArm, -kArm}, {1, -kArm}, {1, kArm},   {kArm, kArm},   {kArm, 1},
               {-kArm, 1}, {-kArm, kArm}, {-1, kArm}, {-1, -kArm}, {-kArm, -kArm}, {-kArm, -1}};
    if (shape == MarkerShape::saltire) {
      const double turn = std::sqrt(0.5);
      for (auto& [x, y] : corners) {
        const double turned = turn * (x - y);
        y = turn * (x + y);
        x = turned;
      }
    }
  }
  return corners;
}

Mark symbol(Role role, MarkerShape shape, double x, double y, double size, std::string text) {
  Mark mark;
  mark.role = role;
  mark.shape = shape;
  mark.x = {x};
  mark.y = {y};
  mark.size = size;
  mark.text = std::move(text);
  return mark;
}

Mark text_mark(Role role, double x, double y, std::string text, double size) {
  Mark mark = symbol(role, MarkerShape::circle, x, y, size, std::move(text));
  mark.kind = Mark::Kind::text;
  return mark;
}

Mark line_mark(Role role, std::vector<double> x, std::vector<double> y, double width) {
  Mark mark;
  mark.kind = Mark::Kind::line;
  mark.role = role;
  mark.x = std::move(x);
  mark.y = std::move(y);
  mark.size = width;
  return mark;
}

Mark rect_mark(Role role, double x0, double y0, double x1, double y1, double opacity,
               std::string text) {
  Mark mark;
  mark.kind = Mark::Kind::rect;
  mark.role = role;
  mark.x = {x0, x1};
  mark.y = {y0, y1};
  mark.opacity = opacity;
  mark.text = std::move(text);
  return mark;
}

void add_interval(Panel& panel, Role role, double x, double low, double high, std::string text) {
  Mark bar;
  bar.kind = Mark::Kind::interval;
  bar.role = role;
  bar.x = {x};
  bar.y = {std::clamp(low, panel.y.low, panel.y.high), std::clamp(high, panel.y.low, panel.y.high)};
  bar.size = 2;
  bar.text = std::move(text);
  panel.marks.push_back(bar);
  const auto end = [&](double y, MarkerShape shape, double half) {
    panel.marks.push_back(symbol(role, shape, x, y, half, bar.text));
  };
  if (high <= panel.y.high) {
    end(bar.y[1], MarkerShape::dash, 5);
  } else {
    end(bar.y[1], MarkerShape::up, 5);
    panel.marks.back().dy = 4;
  }
  if (low >= panel.y.low) {
    end(bar.y[0], MarkerShape::dash, 5);
  } else {
    end(bar.y[0], MarkerShape::down, 5);
    panel.marks.back().dy = -4;
  }
}

void add_interval_across(Panel& panel, Role role, double y, double low, double high,
                         const std::string& text) {
  const double left = std::clamp(low, panel.x.low, panel.x.high);
  const double right = std::clamp(high, panel.x.low, panel.x.high);
  Mark bar = line_mark(role, {left, right}, {y, y}, 2);
  bar.text = text;
  panel.marks.push_back(std::move(bar));
  const double half = 5 * (panel.y.high - panel.y.low) / panel.height;
  const auto end = [&](double x, bool inside, MarkerShape arrow, double dx) {
    if (inside) {
      Mark cap = line_mark(role, {x, x}, {y - half, y + half}, 2);
      cap.text = text;
      panel.marks.push_back(std::move(cap));
    } else {
      panel.marks.push_back(symbol(role, arrow, x, y, 5, text));
      panel.marks.back().dx = dx;
    }
  };
  end(left, low >= panel.x.low, MarkerShape::left, 4);
  end(right, high <= panel.x.high, MarkerShape::right, -4);
}

std::vector<Mark> placed_labels(const Panel& panel, double width) {
  Placement placement(panel, width);
  std::vector<Mark> texts;
  for (const Mark& mark : panel.marks) {
    if (mark.kind == Mark::Kind::label) texts.push_back(placement.put(mark));
  }
  return texts;
}

Figure new_figure(const Analysis& analysis, std::string id, std::string title) {
  Figure figure;
  figure.id = std::move(id);
  figure.title = std::move(title);
  figure.label = simulated_label(analysis.table.simulated);
  const Counts& counts = analysis.description.counts;
  figure.subtitle = counted(counts.n_participants, "participant", "participants") + ", " +
                    counted(counts.n_trials, "trial", "trials");
  return figure;
}

RendererStyle style_of(const Analysis& analysis, std::string_view renderer) {
  constexpr std::array<RendererStyle, kShownRenderers> kStyles{
      {{Role::point, MarkerShape::circle},
       {Role::ray, MarkerShape::square},
       {Role::third, MarkerShape::right},
       {Role::fourth, MarkerShape::cross},
       {Role::fifth, MarkerShape::left},
       {Role::sixth, MarkerShape::saltire}}};
  const auto own = [](std::string_view name) {
    return name == "point" ? 0U : name == "ray" ? 1U : kShownRenderers;
  };
  if (own(renderer) < kShownRenderers) return kStyles[own(renderer)];
  std::array<bool, kShownRenderers> taken{};
  std::size_t before = 0;  // renderers without a fixed style that precede this one
  for (const std::string& name : analysis.table.renderers) {
    if (name == renderer) break;
    if (own(name) < kShownRenderers) {
      taken[own(name)] = true;
    } else {
      ++before;
    }
  }
  for (std::size_t i = 0; i < kShownRenderers; ++i) {
    if (!taken[i] && before-- == 0) return kStyles[i];
  }
  return kStyles.back();
}

std::string short_name(const std::string& renderer) { return printable(renderer, 40); }

void add_renderers(Figure& figure, const Analysis& analysis, std::size_t shown) {
  for (std::size_t r = 0; r < shown; ++r) {
    const std::string& renderer = analysis.table.renderers[r];
    const RendererStyle style = style_of(analysis, renderer);
    figure.legend.push_back({printable(renderer, 200), style.role, style.shape});
  }
}

std::size_t shown_shapes(const Analysis& analysis, Figure& figure) {
  const std::size_t n = analysis.table.shapes.size();
  if (n <= kShownShapes) return n;
  figure.notes.push_back("The first " + std::to_string(kShownShapes) + " of " + std::to_string(n) +
                         " shapes; the tables and the JSON file have all.");
  return kShownShapes;
}

std::size_t shown_renderers(const Analysis& analysis, Figure& figure) {
  const std::size_t n = analysis.table.renderers.size();
  if (n <= kShownRenderers) return n;
  figure.notes.push_back("The first " + std::to_string(kShownRenderers) + " of " +
                         std::to_string(n) + " renderers; the tables and the JSON file have all.");
  return kShownRenderers;
}

std::size_t shown_comparisons(const Analysis& analysis, Figure& figure) {
  return std::min(analysis.comparisons.size(),
                  std::max<std::size_t>(shown_renderers(analysis, figure), 2) - 1);
}

Panel comparison_panel(const Analysis& analysis, const RendererPair& pair, std::size_t shapes,
                       double slot) {
  const bool alone = analysis.comparisons.size() == 1;
  Panel panel;
  constexpr std::size_t kLongest = 24;  // bytes of each name, so that two fit above a narrow panel
  if (!alone) {
    panel.title = printable(pair.renderer, kLongest) + " − " + printable(pair.reference, kLongest);
  }
  panel.width =
      std::max(alone ? kFullPanelWidth : kComparisonPanelWidth, slot * static_cast<double>(shapes));
  return panel;
}

std::string gain_title(const Analysis& analysis, const std::string& what,
                       const std::string& joint) {
  return shortened(what + " " + with_renderer(analysis, joint), 58) + " (%)";
}

std::string seconds_text(double seconds) { return fixed(seconds, seconds < 10 ? 2 : 1) + " s"; }

std::vector<Figure> figures_of(const Analysis& analysis, const StudyRecord& record) {
  std::vector<Figure> figures{
      figure15_of(analysis),  speedup_of(analysis),        times_of(analysis),
      confusion_of(analysis), speed_accuracy_of(analysis), learning_of(analysis),
      order_of(analysis),     servo_of(analysis, record),  exclusions_of(analysis)};
  std::erase_if(figures, [](const Figure& figure) { return figure.panels.empty(); });
  return figures;
}

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
