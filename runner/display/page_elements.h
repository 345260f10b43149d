#pragma once
// Elements of a participant's page: answer keys, progress bar, checklist, the symbol of the space
// bar. Sizes are in a unit (px) that grows with the page.

#include <cstddef>
#include <string>
#include <vector>

#include "runner/display/display.h"
#include "runner/display/text_block.h"

namespace palpate::runner::display {

inline constexpr double kTextSize = 1.4;  ///< units; size of a text to read

/// The answer keys with their labels. They stand side by side; if a label would be cut off or there
/// are too many, in up to three columns, made smaller if necessary.
class KeyMap {
 public:
  /// \param room  the height available, px; exceeded only if nothing fits
  KeyMap(cairo_t* canvas, const Page& page, double unit, double width, double room);
  double height() const { return height_; }
  void draw(cairo_t* canvas, double middle, double top) const;

 private:
  struct Item {
    TextBlock key, answer;
    double cap_width, width;
    double x, y;  ///< upper left corner of the key, from the middle and the top
    double answer_x, answer_y;
  };
  bool lay_side_by_side(cairo_t* canvas, const Page& page, double width);
  bool lay_in_columns(cairo_t* canvas, const Page& page, double width, double room, int columns);

  double unit_, height_ = 0;
  std::size_t chosen_;  ///< the answer given before, as an index; past the last: none
  std::vector<Item> items_;
};

/// Draws the space bar with an arrow: "press to continue" without words.
void draw_continue(cairo_t* canvas, double middle, double top, double unit);
/// Draws the session's progress along the upper edge.
void draw_progress(cairo_t* canvas, const Page& page, double unit, double width);
/// Draws the current step's instruction, then a line for each step.
void draw_checklist(cairo_t* canvas, const Checklist& list, double unit, double width, double top,
                    double room);
/// Draws a PNG file as large as fits, at most at `most` times its size; a note if it is not a PNG
/// file.
void draw_picture(cairo_t* canvas, const std::string& bytes, double middle, double top,
                  double width, double room, double most = 2);
/// Draws home as a ring, the target as a disc, where it is shown, and the tip as a dot.
void draw_reach(cairo_t* canvas, const ReachPicture& reach, bool target, double middle, double top,
                double room);
/// Draws the typed text in a field.
void draw_typed(cairo_t* canvas, const std::string& typed, double middle, double top, double unit,
                double width);
double text_width(double width, double unit);
std::string minutes_and_seconds(int seconds);  ///< "0:25"

}  // namespace palpate::runner::display
