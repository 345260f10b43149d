#pragma once
// Draws a page of the participant's screen into an image, without a display. Pango sets the text:
// it finds a font for every character and handles right-to-left and joined scripts.

#include <cstdint>
#include <vector>

#include "runner/display/display.h"

namespace palpate::runner {

struct Image {
  int width = 0, height = 0;
  std::vector<std::uint32_t> pixels;  ///< 0xffRRGGBB, rows from the top
};

struct PageOptions {
  double ui_scale = 1;  ///< text is at least as large as a desktop's with this scale
  int screen = 0;       ///< of a text that takes several, from 0
};

/// Deterministic. Invalid UTF-8 is shown as a replacement character. A long text to read continues
/// on further screens; other texts are set smaller and, at the smallest readable size, end in an
/// ellipsis.
Image draw_page(const Page& page, int width, int height, const PageOptions& setting = {});

/// Number of screens that a page takes.
int screen_count(const Page& page, int width, int height, double ui_scale = 1);

/// The background colour of pages, 0xffRRGGBB.
std::uint32_t ground_colour();

}  // namespace palpate::runner
