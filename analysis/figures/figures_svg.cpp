#include "analysis/figures/figures_svg.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "analysis/figures/svg.h"
#include "analysis/text.h"

namespace palpate::analysis {

namespace {

constexpr double kMargin = 26, kLeft = 58, kGap = 30, kRow = 1000;
constexpr std::size_t kLongestName = 18;   // characters of a name below an axis
constexpr std::size_t kLongestEntry = 40;  // of one in the legend

class Drawing {
 public:
  Drawing(const Figure& figure, const Palette& palette, Stands stands)
      : figure_(figure), palette_(palette), in_page_(stands == Stands::in_page) {}

  std::string document() {
    measure();
    double y = heading();
    std::size_t row_start = 0;
    while (row_start < figure_.panels.size()) {
      std::size_t row_end = row_start + 1;
      while (row_end < figure_.panels.size() && right_of(row_start, row_end) <= total_) ++row_end;
      y = draw_row(row_start, row_end, y);
      row_start = row_end;
    }
    const double drawn = y + 8;
    y = draw_notes(y + 16);
    std::optional<Svg::Part> shown;
    if (in_page_) shown = Svg::Part{below_title_, drawn};
    Svg page;
    page.rect(0, 0, total_, y + kMargin - 10, colour(Role::page));
    page.append(svg_);
    return page.document(total_, y + kMargin - 10,
                         (figure_.label.empty() ? "" : figure_.label + ": ") + figure_.title,
                         figure_.description, figure_.id, shown);
  }

 private:
  struct Place {
    const Panel* panel;
    double left, top;
    double x(double value) const {
      return left + (value - panel->x.low) / (panel->x.high - panel->x.low) * panel->width;
    }
    double y(double value) const {
      return top + panel->height -
             (value - panel->y.low) / (panel->y.high - panel->y.low) * panel->height;
    }
  };

  const std::string& colour(Role role) const { return palette_[static_cast<std::size_t>(role)]; }

  static double left_room(const Panel& panel) {
    double widest = 0;
    for (const Tick& tick : panel.y.ticks) {
      widest = std::max(widest, text_width(shortened(tick.label, kLongestName), 12));
    }
    return std::max(kLeft, widest + (panel.y.title.empty() ? 16 : 44));
  }

  /// Right end of the panels [first, last] in one row.
  double right_of(std::size_t first, std::size_t last) const {
    double x = kMargin;
    for (std::size_t p = first; p <= last; ++p) {
      x += left_room(figure_.panels[p]) + figure_.panels[p].width + (p < last ? kGap : kMargin);
    }
    return x;
  }

  void measure() {
    total_ = 560;
    for (std::size_t p = 0; p < figure_.panels.size(); ++p) {
      total_ = std::max(total_, right_of(p, p));
      const double row = right_of(0, p);
      if (row <= kRow) total_ = std::max(total_, row);
    }
  }

  double heading() {
    double y = kMargin + 18;
    if (in_page_) svg_.begin_alone();
    for (const std::string& line : lines_of(figure_.title, total_ - 2 * kMargin, 19, true)) {
      svg_.text(kMargin, y, line, {19, colour(Role::ink), Svg::Anchor::start, true});
      y += 25;
    }
    if (in_page_) svg_.end_group();
    below_title_ = y - 20;  // the label's frame begins there
    double x = kMargin;
    if (!figure_.label.empty()) {
      const double pill = text_width(figure_.label, 12, true) + 44;
      svg_.rect(x, y - 15, pill, 22, "none", colour(Role::amber), 11);
      svg_.text(x + pill / 2, y, figure_.label,
                {12, colour(Role::amber), Svg::Anchor::middle, true});
      x += pill + 12;
    }
    svg_.text(x, y, figure_.subtitle, {13, colour(Role::soft)});
    y += 32;
    if (figure_.legend.empty()) return y - 8;
    x = kMargin;
    for (const LegendEntry& entry : figure_.legend) {
      const std::string label = shortened(entry.label, kLongestEntry);
      const double width = 30 + text_width(label, 13) + 22;
      if (x + width > total_ && x > kMargin) {
        x = kMargin;
        y += 22;
      }
      draw_symbol(entry.shape, entry.role, x + 9, y - 4.5, entry.shape == Shape::dash ? 9 : 6, 1);
      svg_.text(x + 24, y, label, {13, colour(Role::ink)});
      x += width;
    }
    return y + 14;
  }

  void draw_symbol(Shape shape, Role role, double x, double y, double half, double opacity) {
    const std::string& fill = colour(role);
    switch (shape) {
      case Shape::circle:
        svg_.circle(x, y, half, fill, opacity);
        break;
      case Shape::square:
        svg_.square(x, y, 0.9 * half, fill, opacity);
        break;
      case Shape::diamond:
        svg_.diamond(x, y, half, fill, colour(Role::page));
        break;
      case Shape::up:
      case Shape::down:
        svg_.triangle(x, y, half, shape == Shape::up, fill);
        break;
      case Shape::dash:
        svg_.line(x - half, y, x + half, y, fill, 2, opacity);
        break;
      case Shape::right:
      case Shape::cross:
      case Shape::left:
      case Shape::saltire:
        draw_outline(shape, fill, x, y, half, opacity);
        break;
    }
  }

  void draw_outline(Shape shape, const std::string& fill, double x, double y, double half,
                    double opacity) {
    std::vector<double> xs, ys;
    for (const auto& [corner_x, corner_y] : outline_of(shape)) {
      xs.push_back(x + half * corner_x);
      ys.push_back(y + half * corner_y);
    }
    svg_.area(xs, ys, fill, opacity, "none", 0);
  }

  double draw_row(std::size_t first, std::size_t last, double y) {
    double x = kMargin, tallest = 0;
    bool titled = false;
    for (std::size_t p = first; p < last; ++p) {
      tallest = std::max(tallest, figure_.panels[p].height);
      titled = titled || !figure_.panels[p].title.empty();
    }
    const double top = y + (titled ? 44 : 26);
    double below = 0;
    for (std::size_t p = first; p < last; ++p) {
      const Panel& panel = figure_.panels[p];
      x += left_room(panel);
      const Place place{&panel, x, top};
      if (!panel.title.empty()) {
        svg_.text(x, top - 14, panel.title, {14, colour(Role::ink), Svg::Anchor::start, true});
      }
      below = std::max(below, draw_axes(place));
      draw_marks(place);
      x += panel.width + kGap;
    }
    return top + tallest + below;
  }

  /// \return room that the lower axis takes
  double draw_axes(const Place& place) {
    const Panel& panel = *place.panel;
    const double right = place.left + panel.width, bottom = place.top + panel.height;
    for (const Tick& tick : panel.y.ticks) {
      const double y = place.y(tick.at);
      if (panel.y.grid) svg_.line(place.left, y, right, y, colour(Role::grid));
      svg_.text(place.left - 9, y + 4, shortened(tick.label, kLongestName),
                {12, colour(Role::soft), Svg::Anchor::end});
    }
    if (!panel.y.title.empty()) {
      const double x = place.left - left_room(panel) + 12;
      svg_.text(x, place.top + panel.height / 2, fitting(panel.y.title, panel.height + 20, 12),
                {12, colour(Role::soft), Svg::Anchor::middle, false, -90});
    }
    const double slot = panel.width / std::max(1.0, panel.x.high - panel.x.low);
    bool turned = false;
    for (const Tick& tick : panel.x.ticks) {
      turned = turned ||
               (panel.x.names && text_width(shortened(tick.label, kLongestName), 13) > slot - 6);
    }
    for (const Tick& tick : panel.x.ticks) {
      const double x = place.x(tick.at);
      if (panel.x.grid) svg_.line(x, place.top, x, bottom, colour(Role::grid));
      const std::string label = shortened(tick.label, kLongestName);
      if (turned) {
        svg_.text(x + 5, bottom + 20, label, {13, colour(Role::ink), Svg::Anchor::end, false, -30});
      } else {
        svg_.text(x, bottom + 20, label,
                  {panel.x.names ? 13.0 : 12.0, colour(panel.x.names ? Role::ink : Role::soft),
                   Svg::Anchor::middle});
      }
    }
    double below = turned ? 84 : 34;
    if (!panel.x.title.empty()) {
      svg_.text(place.left + panel.width / 2, bottom + below + 8, panel.x.title,
                {12, colour(Role::soft), Svg::Anchor::middle});
      below += 20;
    }
    return below;
  }

  void draw_marks(const Place& place) {
    using Kind = Mark::Kind;
    for (const Kind kind :
         {Kind::rect, Kind::area, Kind::line, Kind::interval, Kind::symbol, Kind::text}) {
      for (const Mark& mark : place.panel->marks) {
        if (mark.kind == kind) draw(mark, place);
      }
    }
  }

  void draw(const Mark& mark, const Place& place) {
    const bool told = mark.kind != Mark::Kind::text && !mark.text.empty();
    if (told) svg_.begin_group(mark.text);
    std::vector<double> x, y;
    x.reserve(mark.x.size());
    y.reserve(mark.y.size());
    for (const double value : mark.x) x.push_back(place.x(value));
    for (const double value : mark.y) y.push_back(place.y(value));
    const std::string& fill = colour(mark.role);
    switch (mark.kind) {
      case Mark::Kind::rect:
        svg_.area({x[0], x[1], x[1], x[0]}, {y[0], y[0], y[1], y[1]}, fill, mark.opacity, "none",
                  0);
        break;
      case Mark::Kind::area:
        svg_.area(x, y, fill, mark.opacity, fill, mark.size);
        break;
      case Mark::Kind::line:
        svg_.path(x, y, fill, mark.size, mark.opacity);
        break;
      case Mark::Kind::interval:
        svg_.line(x[0], y[0], x[0], y[1], fill, mark.size, mark.opacity);
        break;
      case Mark::Kind::symbol:
        draw_symbol(mark.shape, mark.role, x[0] + mark.dx, y[0] + mark.dy, mark.size, mark.opacity);
        break;
      case Mark::Kind::text:
        svg_.text(x[0] + mark.dx, y[0] + mark.dy, mark.text,
                  {mark.size, fill, static_cast<Svg::Anchor>(mark.anchor + 1), mark.bold});
        break;
    }
    if (told) svg_.end_group();
  }

  double draw_notes(double y) {
    if (in_page_) svg_.begin_alone();
    for (const std::string& note : figure_.notes) {
      for (const std::string& line : lines_of(note, total_ - 2 * kMargin, 12)) {
        svg_.text(kMargin, y, line, {12, colour(Role::soft)});
        y += 17;
      }
    }
    if (in_page_) svg_.end_group();
    return y;
  }

  const Figure& figure_;
  const Palette& palette_;
  bool in_page_;
  Svg svg_;
  double total_ = 0, below_title_ = 0;
};

}  // namespace

Palette light_palette() {
  return {"#ffffff", "#1f2328", "#59636e", "#e3e6ea", "#0072b2", "#d55e00", "#00795a",
          "#0072b2", "#8a5a00", "#aa3377", "#009e73", "#000000", "#665c00"};
}

Palette dark_palette() {
  return {"#171b1f", "#e6e9ec", "#a3adb8", "#30373e", "#56b4e9", "#f28b3c", "#2fbf96",
          "#56b4e9", "#f0b84a", "#e08bbf", "#35d0a5", "#ffffff", "#f0e442"};
}

Palette page_palette() {
  Palette palette;
  for (std::size_t r = 0; r < kRoles; ++r) {
    palette[r] = std::string("var(--") + to_string(static_cast<Role>(r)) + ")";
  }
  return palette;
}

std::string figure_svg(const Figure& figure, const Palette& palette, Stands stands) {
  return Drawing(figure, palette, stands).document();
}

}  // namespace palpate::analysis
