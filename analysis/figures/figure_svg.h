#pragma once
// Draws a Figure as an SVG document, for a file or within an HTML page.

#include <string>

#include "analysis/figures/figures.h"
#include "analysis/figures/svg.h"

namespace palpate::analysis {

/// standalone: a separate file, with title and notes; in_page: the HTML page shows title and notes;
/// in_narrow_page: the same for narrow screens, with narrower panels stacked vertically.
enum class FigurePlacement { standalone, in_page, in_narrow_page };

/// In a page, title and notes are outside the visible part (viewBox) and used when the drawing is
/// saved. Marks have a <title> (tooltip) with their numbers; marks of one participant are a <g>
/// with the attribute data-person.
std::string figure_svg(const Figure& figure, const Palette& palette,
                       FigurePlacement placement = FigurePlacement::standalone);

}  // namespace palpate::analysis
