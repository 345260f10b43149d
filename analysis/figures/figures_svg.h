#pragma once
// Figures as SVG, without a browser.

#include <array>
#include <string>

#include "analysis/figures/figures.h"

namespace palpate::analysis {

/// Colours by role: what SVG and CSS read.
using Palette = std::array<std::string, kRoles>;

/// For paper. Okabe & Ito's (2008) colours, some darker: told apart with every common colour
/// vision.
Palette light_palette();
Palette dark_palette();
/// "var(--point)" and so on: a page's style says which.
Palette page_palette();

/// Where a figure stands: in a file of its own, or in a page that has its title above and its notes
/// below.
enum class Stands { alone, in_page };

/// A document with title, label, legend and notes; in a page, title and notes are there for whoever
/// saves the drawing, but not shown.
std::string figure_svg(const Figure& figure, const Palette& palette, Stands stands = Stands::alone);

}  // namespace palpate::analysis
