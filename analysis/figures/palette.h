#pragma once
// The colours of figures and pages, by role.

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
/// "var(--point)" and so on: a page's style has the values.
Palette page_palette();

/// The colour of a line among others, point's and ray's first; from the ninth on again.
Role line_role(std::size_t line);

}  // namespace palpate::analysis
