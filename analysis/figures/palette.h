#pragma once
// Colours of figures and pages by role.

#include <array>
#include <string>

#include "analysis/figures/figures.h"

namespace palpate::analysis {

/// CSS colours, indexed by Role.
using Palette = std::array<std::string, kRoles>;

/// For print and light pages: the colours of Okabe & Ito (2008), distinguishable with colour vision
/// deficiency, some darker for contrast on white.
Palette light_palette();
Palette dark_palette();
/// CSS variables "var(--point)" ..., whose values are in the style of the page.
Palette page_palette();

/// Colour of line number `line` (from 0) of a figure; repeats after eight.
Role line_role(std::size_t line);

}  // namespace palpate::analysis
