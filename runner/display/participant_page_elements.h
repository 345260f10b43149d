#pragma once
// Elements of a participant's page: answer keys, progress bar, checklist, the sign for the space
// bar. Sizes are in a unit (px) that grows with the page.

#include "runner/display/display.h"
#include "runner/display/pango_text.h"

namespace palpate::runner {

inline constexpr double kTextSize = 1.4;  ///< units, of a text to read

/// The answer keys with their labels: side by side, or, where a label would be cut off or there are
/// too many, one below the other in up to three columns, smaller where they must be.
class KeyMap {
 public:
  /// \param room  px, the height that it may have where that is possible at all
  KeyMap(cairo_t* canvas, const Page& page, double unit, double width, double room);
  double height() const { return height_; }
  void draw(cairo_t* canvas, double middle, double top) const;

 private:
  struct Item {
    TextBlock key, answer;
    double cap_width, width;
    double x, y;  ///< of the key's left upper edge, from the middle and the top
    double answer_x, answer_y;
  };
  bool lay_side_by_side(cairo_t* canvas, const Page& page, double width);
  bool lay_in_columns(cairo_t* canvas, const Page& page, double width, double room, int columns);

  double unit_, height_ = 0;
  std::vector<Item> items_;
};

/// A picture of the space bar with an arrow: "press to go on" without words.
void draw_go_on(cairo_t* canvas, double middle, double top, double unit);
/// Progress of the session, along the upper edge.
void draw_progress(cairo_t* canvas, const Page& page, double unit, double width);
/// The current step's instruction, then a line for each step.
void draw_checklist(cairo_t* canvas, const Checklist& list, double unit, double width, double top,
                    double room);
/// A PNG file, as large as it fits, not enlarged beyond twice its size; a note where it is none.
void draw_picture(cairo_t* canvas, const std::string& bytes, double middle, double top,
                  double width, double room);
/// What is being typed, in a field.
void draw_typed(cairo_t* canvas, const std::string& typed, double middle, double top, double unit,
                double width);
double text_width(double width, double unit);
std::string minutes_and_seconds(int seconds);  ///< "0:25"

}  // namespace palpate::runner
