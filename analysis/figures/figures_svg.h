#pragma once
// Figures as SVG: files, and the same drawings in a page.

#include <string>

#include "analysis/figures/figures.h"
#include "analysis/figures/palette.h"

namespace palpate::analysis {

/// Where a figure stands: in a file of its own; in a page that has its title above and its notes
/// below; or there for a narrow screen, with panels narrower and below each other.
enum class Stands { alone, in_page, in_narrow_page };

/// A document with title, label, legend and notes; in a page, title and notes are there for whoever
/// saves the drawing, but not shown. Marks have their exact numbers as titles; those of one
/// participant are groups with the attribute data-person.
std::string figure_svg(const Figure& figure, const Palette& palette, Stands stands = Stands::alone);

}  // namespace palpate::analysis
