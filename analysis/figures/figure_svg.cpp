#include <algorithm>
#include <cstddef>
#include <optional>
#include <vector>

#include "analysis/figures/panel_drawing.h"
#include "analysis/figures/svg.h"
#include "analysis/text.h"

namespace palpate::analysis {

namespace {

constexpr double kGap = 30, kLeastWidth = 560;  // px
constexpr double kNarrow = 380;                 // px: width of a drawing for narrow screens
constexpr std::size_t kLongestEntry = 40;       // characters of a legend's entry

class Drawing {
 public:
  Drawing(const Figure& figure, const Palette& palette, FigurePlacement placement)
      : figure_(figure),
        palette_(palette),
        in_page_(placement != FigurePlacement::standalone),
        narrow_(placement == FigurePlacement::in_narrow_page),
        margin_(narrow_ ? 4 : 26) {}

  std::string document() {
    measure();
    double y = heading();
    for (std::size_t first = 0, last = 0; first < figure_.panels.size(); first = last) {
      last = row_end(first);
      y = draw_row(first, last, y);
    }
    const double drawn = y + 8;
    y = draw_notes(y + 16) + margin_ - 10;
    std::optional<Svg::Part> shown;
    // The HTML page has margins: only the part within ours is shown.
    if (in_page_)
      shown = Svg::Part{margin_ - 2, std::min(total_, total_ - margin_ + 14), below_title_, drawn};
    Svg page;
    page.rect(0, 0, total_, y, colour(Role::page));
    page.append(svg_);
    return page.document(total_, y,
                         (figure_.label.empty() ? "" : figure_.label + ": ") + figure_.title,
                         figure_.description, figure_.id + (narrow_ ? "-narrow" : ""), shown);
  }

 private:
  const std::string& colour(Role role) const { return palette_[static_cast<std::size_t>(role)]; }

  /// px. On a narrow page at least kLeastSlot for each category.
  double width_of(const Panel& panel) const {
    if (!narrow_) return panel.width;
    constexpr double kLeast = 220, kLeastSlot = 26;
    const double least =
        std::min(panel.width, panel.x.names ? std::max(kLeast, kLeastSlot * panel.x.high) : kLeast);
    return std::min(panel.width, std::max(least, kNarrow - 2 * margin_ - left_axis_width(panel) -
                                                     kRightOfNarrow));
  }

  /// px: right end of a row with the panels first to last, margin included.
  double right_of(std::size_t first, std::size_t last) const {
    double x = margin_;
    for (std::size_t p = first; p <= last; ++p) {
      x += left_axis_width(figure_.panels[p]) + width_of(figure_.panels[p]) +
           (p < last ? kGap : margin_);
    }
    return x + (narrow_ ? kRightOfNarrow : 0);
  }

  std::size_t row_end(std::size_t first) const {
    std::size_t end = first + 1;
    while (end < figure_.panels.size() && !figure_.panels[end].starts_row &&
           right_of(first, end) <= total_) {
      ++end;
    }
    return end;
  }

  void measure() {
    const double available = narrow_ ? kNarrow : figure_.max_row_width;
    total_ = narrow_ ? kNarrow : kLeastWidth;
    std::size_t first = 0;
    for (std::size_t p = 0; p < figure_.panels.size(); ++p) {
      if (figure_.panels[p].starts_row) first = p;
      total_ = std::max(total_, right_of(p, p));
      const double row = right_of(first, p);
      if (row <= available) total_ = std::max(total_, row);
    }
  }

  /// Title, label, subtitle and legend. \return y (px) where the panels begin
  double heading() {
    double y = margin_ + 18;
    if (in_page_) svg_.begin_standalone();
    for (const std::string& line : lines_of(figure_.title, total_ - 2 * margin_, 19, true)) {
      svg_.text(margin_, y, line, {19, colour(Role::ink), Svg::Anchor::start, true});
      y += 25;
    }
    if (in_page_) svg_.end_group();
    below_title_ = y - 20;  // top of the label's frame
    y = subtitle(y);
    return figure_.legend.empty() ? y - 8 : legend(y) + 14;
  }

  double subtitle(double y) {
    if (figure_.label.empty() && figure_.subtitle.empty()) return y;
    double x = margin_;
    if (!figure_.label.empty()) {
      const double pill = text_width(figure_.label, 12, true) + 44;
      svg_.rect(x, y - 15, pill, 22, "none", colour(Role::amber), 11);
      svg_.text(x + pill / 2, y, figure_.label,
                {12, colour(Role::amber), Svg::Anchor::middle, true});
      x += pill + 12;
      if (x + text_width(figure_.subtitle, 13) > total_ - margin_) {
        x = margin_;
        y += 24;
      }
    }
    for (const std::string& line : lines_of(figure_.subtitle, total_ - margin_ - x, 13)) {
      svg_.text(x, y, line, {13, colour(Role::soft)});
      y += 18;
    }
    return y + 14;
  }

  /// \return y (px) of the last row's base line
  double legend(double y) {
    double x = margin_;
    for (const LegendEntry& entry : figure_.legend) {
      const std::string label = shortened(entry.label, kLongestEntry);
      const double width = 30 + text_width(label, 13) + 22;
      if (x + width > total_ && x > margin_) {
        x = margin_;
        y += 22;
      }
      draw_symbol(svg_, palette_, entry.shape, entry.role, x + 9, y - 4.5,
                  entry.shape == MarkerShape::dash ? 9 : 6);
      svg_.text(x + 24, y, label, {13, colour(Role::ink)});
      x += width;
    }
    return y;
  }

  double draw_row(std::size_t first, std::size_t last, double y) {
    double x = margin_, tallest = 0, below = 0;
    bool titled = false;
    for (std::size_t p = first; p < last; ++p) {
      tallest = std::max(tallest, figure_.panels[p].height);
      titled = titled || !figure_.panels[p].title.empty();
    }
    const double top = y + (titled ? 44 : 26);
    for (std::size_t p = first; p < last; ++p) {
      const Panel& panel = figure_.panels[p];
      x += left_axis_width(panel);
      const PlacedPanel placed{&panel, x, top, width_of(panel)};
      if (!panel.title.empty()) {
        svg_.text(x, top - 14, fitting(panel.title, placed.width + kGap, 14),
                  {14, colour(Role::ink), Svg::Anchor::start, true});
      }
      below = std::max(below, draw_axes(svg_, placed, palette_));
      draw_marks(svg_, placed, palette_);
      x += placed.width + kGap;
    }
    return top + tallest + below;
  }

  double draw_notes(double y) {
    if (in_page_) svg_.begin_standalone();
    for (const std::string& note : figure_.notes) {
      for (const std::string& line : lines_of(note, total_ - 2 * margin_, 12)) {
        svg_.text(margin_, y, line, {12, colour(Role::soft)});
        y += 17;
      }
    }
    if (in_page_) svg_.end_group();
    return y;
  }

  static constexpr double kRightOfNarrow = 12;  // px, for marks that extend beyond the panel

  const Figure& figure_;
  const Palette& palette_;
  bool in_page_, narrow_;
  double margin_;  ///< px
  Svg svg_;
  double total_ = 0, below_title_ = 0;
};

}  // namespace

std::string figure_svg(const Figure& figure, const Palette& palette, FigurePlacement placement) {
  return Drawing(figure, palette, placement).document();
}

}  // namespace palpate::analysis
