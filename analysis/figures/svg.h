#pragma once
// Writes SVG 1.1 text: colours, the elements that figures need, and whole figures.

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "analysis/figures/figures.h"

namespace palpate::analysis {

/// CSS colours of figures and pages, indexed by Role.
using Palette = std::array<std::string, kRoles>;

/// For print and light pages: the colours of Okabe & Ito (2008), distinguishable with colour vision
/// deficiency, some darker for contrast on white.
Palette light_palette();
Palette dark_palette();
/// CSS variables "var(--point)" ..., defined in the style of the page.
Palette page_palette();

/// Colour of line number `line` (from 0) of a figure; repeats after eight.
Role line_role(std::size_t line);

/// An SVG document under construction. Lengths in px, y down. Texts are escaped here.
class Svg {
 public:
  enum class Anchor { start, middle, end };
  struct TextStyle {
    double size = 13;  ///< px
    std::string_view colour = "#1f2328";
    Anchor anchor = Anchor::start;
    bool bold = false;
    double rotation = 0;  ///< degrees, clockwise, about the anchor
  };

  void line(double x1, double y1, double x2, double y2, std::string_view colour, double width = 1,
            double opacity = 1);
  void rect(double x, double y, double width, double height, std::string_view fill,
            std::string_view stroke = "none", double corner = 0);
  void circle(double x, double y, double radius, std::string_view fill, double opacity = 1);
  void square(double x, double y, double half, std::string_view fill, double opacity = 1);
  void diamond(double x, double y, double half, std::string_view stroke,
               std::string_view fill = "#ffffff");
  void triangle(double x, double y, double half, bool up, std::string_view fill);
  /// area: closed and filled polygon; path: open line. x and y have the same size.
  void area(const std::vector<double>& x, const std::vector<double>& y, std::string_view fill,
            double opacity, std::string_view stroke, double width);
  void path(const std::vector<double>& x, const std::vector<double>& y, std::string_view stroke,
            double width, double opacity, bool dashed = false);
  void text(double x, double y, std::string_view text, const TextStyle& style);
  /// Elements up to end_group() have the tooltip `title` and belong to `participant` (attribute
  /// data-person); either may be empty.
  void begin_group(std::string_view title, std::string_view participant = {});
  /// Elements up to end_group() belong to the standalone file only; a page has them as HTML beside
  /// the drawing.
  void begin_standalone();
  void end_group();

  /// Draws the elements of another drawing over these.
  void append(const Svg& other) { body_ += other.body_; }

  struct Part {
    double left = 0, right = 0, top = 0, bottom = 0;  ///< px
  };

  /// The document. In a page it scales with the width, down to 65 % (legible text) and up to 100 %.
  /// \param id starts the ids of title and description: unique within a page
  /// \param shown the part shown in a page; the attribute data-whole has the whole view box, for
  /// saving
  std::string document(double width, double height, std::string_view title,
                       std::string_view description, std::string_view id = "figure",
                       const std::optional<Part>& shown = std::nullopt) const;

 private:
  std::string body_;
};

/// Estimated width of a text, px, by the widths of DejaVu Sans (an upper bound for the fonts used).
double text_width(std::string_view text, double size, bool bold = false);
/// The text, cut with an ellipsis if it is wider than `width` px.
std::string fitting(std::string_view text, double width, double size);
/// The text in lines of at most `width` px.
std::vector<std::string> lines_of(std::string_view text, double width, double size,
                                  bool bold = false);

/// standalone: a separate file, with title and notes; in_page: the HTML page shows title and notes;
/// in_narrow_page: the same for narrow screens, with narrower panels stacked vertically.
enum class FigurePlacement { standalone, in_page, in_narrow_page };

/// In a page, title and notes are outside the visible part (viewBox) and used when the drawing is
/// saved. Marks have a <title> (tooltip) with their numbers; marks of one participant are a <g>
/// with the attribute data-person.
std::string figure_svg(const Figure& figure, const Palette& palette,
                       FigurePlacement placement = FigurePlacement::standalone);

}  // namespace palpate::analysis
