#pragma once
// Pieces of a page. Sizes in units, px each, that grow with the page.

#include "runner/display/display.h"
#include "runner/display/page_words.h"

namespace palpate::runner {

inline constexpr double kLetters = 1.4;  ///< units: of a text to read

/// What each key answers, in as many rows as it takes.
class KeyMap {
 public:
  KeyMap(cairo_t* canvas, const Page& page, double unit, double width);
  double height() const;
  void draw(cairo_t* canvas, double middle, double top) const;

 private:
  struct Item {
    Words key, answer;
    double cap_width, width, x;
    std::size_t row;
  };
  double unit_;
  std::vector<Item> items_;
  std::vector<double> rows_;  ///< px, how wide each row is
};

/// "Press the space bar to go on", in no language.
void draw_go_on(cairo_t* canvas, double middle, double top, double unit);
/// How far the session is, along the upper edge.
void draw_progress(cairo_t* canvas, const Page& page, double unit, double width);
/// What is done and what is due, a line each, and how to do it.
void draw_checklist(cairo_t* canvas, const Checklist& list, double unit, double width, double top,
                    double room);
double text_width(double width, double unit);
std::string clock_words(int seconds);  ///< "0:25"

}  // namespace palpate::runner
