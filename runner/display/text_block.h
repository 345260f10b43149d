#pragma once
// Text set by Pango, and the colours of the participant's pages.

#include <pango/pangocairo.h>

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace palpate::runner::display {

struct Colour {
  double red, green, blue;
};
// Dark: a bright screen tires the eyes and would light up the hand during a trial.
inline constexpr Colour kGround{0.118, 0.137, 0.161};
inline constexpr Colour kText{0.918, 0.902, 0.863};
inline constexpr Colour kQuietInk{0.639, 0.663, 0.690};
inline constexpr Colour kKeycap{0.184, 0.212, 0.247};
inline constexpr Colour kKeycapEdge{0.361, 0.400, 0.443};
inline constexpr Colour kGo{0.47, 0.78, 0.55};
inline constexpr Colour kReply{0.97, 0.78, 0.26};

using Canvas = std::unique_ptr<cairo_t, decltype(&cairo_destroy)>;

struct Unref {
  void operator()(PangoLayout* layout) const { g_object_unref(layout); }
};
using Layout = std::unique_ptr<PangoLayout, Unref>;

struct Size {
  double width, height;
};

/// A block of text, laid out.
class TextBlock {
 public:
  /// \param size  of the font, px; \param width  of a line, px; 0: unlimited
  TextBlock(cairo_t* canvas, const std::string& text, double size, double width = 0);

  void set_size(double size);
  void centre() { pango_layout_set_alignment(layout_.get(), PANGO_ALIGN_CENTER); }
  void cut_at_height(double height);
  void cut_at_width(double width);
  int lines() const { return pango_layout_get_line_count(layout_.get()); }
  /// Byte offsets of the lines in the text.
  std::vector<std::size_t> line_starts() const;
  Size size() const;
  void draw(cairo_t* canvas, double x, double y, const Colour& colour) const;

 private:
  Layout layout_;
};

/// The text, with a mark in place of what is not UTF-8.
std::string valid_utf8(const std::string& text);

void set_colour(cairo_t* canvas, const Colour& colour);

}  // namespace palpate::runner::display
