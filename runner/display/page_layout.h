#pragma once
// A page of the participant's screen as pixels: text in any language through Pango, which finds
// fonts letter by letter and sets right-to-left and joined scripts. Needs no display.

#include <cstdint>
#include <vector>

#include "runner/display/display.h"

namespace palpate::runner {

struct Image {
  int width = 0, height = 0;
  std::vector<std::uint32_t> pixels;  ///< 0xffRRGGBB, rows from the top
};

struct PageSetting {
  double ui_scale = 1;  ///< letters are at least as large as a desktop's with this scale
  int screen = 0;       ///< of a text that takes several, from 0
};

/// The same page gives the same pixels. Text that is no UTF-8 shows a mark where it is broken; a
/// text to read that is too long for the screen goes on on the next; where nobody can turn pages it
/// is set smaller, and at the smallest readable size cut off with an ellipsis.
Image draw_page(const Page& page, int width, int height, const PageSetting& setting = {});

/// How many screens a page takes.
int screens_of(const Page& page, int width, int height, double ui_scale = 1);

/// A flat image in the page's ground colour: between pages, and before the first.
std::uint32_t ground_colour();

}  // namespace palpate::runner
