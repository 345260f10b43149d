#pragma once
// A page of the participant's screen as pixels: text in any language through Pango, which finds
// fonts letter by letter and sets right-to-left and joined scripts. Needs no display.

#include <cstdint>
#include <vector>

#include "runner/display/display.h"

namespace palpate {

struct Image {
  int width = 0, height = 0;
  std::vector<std::uint32_t> pixels;  ///< 0xffRRGGBB, rows from the top
};

/// The same page gives the same pixels. Text that is no UTF-8 shows a mark where it is broken; text
/// too long for the screen is set smaller, and at the smallest readable size cut off with an
/// ellipsis.
Image draw_page(const Page& page, int width, int height);

/// A flat image in the page's ground colour: between pages, and before the first.
std::uint32_t ground_colour();

}  // namespace palpate
