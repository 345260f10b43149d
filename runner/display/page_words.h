#pragma once
// Text of a page through Pango, and the colours of pages.

#include <pango/pangocairo.h>

#include <memory>
#include <string>
#include <vector>

namespace palpate::runner {

struct Colour {
  double red, green, blue;
};
// Dark and even: a bright screen tires, and a trial must not light up the hand.
inline constexpr Colour kGround{0.118, 0.137, 0.161};
inline constexpr Colour kText{0.918, 0.902, 0.863};
inline constexpr Colour kQuietInk{0.639, 0.663, 0.690};
inline constexpr Colour kCap{0.184, 0.212, 0.247};
inline constexpr Colour kCapEdge{0.361, 0.400, 0.443};
inline constexpr Colour kGo{0.47, 0.78, 0.55};
inline constexpr Colour kReply{0.97, 0.78, 0.26};

using Canvas = std::unique_ptr<cairo_t, decltype(&cairo_destroy)>;

struct Unref {
  void operator()(PangoLayout* layout) const { g_object_unref(layout); }
};
using Layout = std::unique_ptr<PangoLayout, Unref>;

std::string valid_utf8(const std::string& text);

void set_colour(cairo_t* canvas, const Colour& colour);

struct Size {
  double width, height;
};

/// A piece of text, set to a size.
class Words {
 public:
  /// \param size  px, of the letters; \param width  px, to break lines at; 0: none
  Words(cairo_t* canvas, const std::string& text, double size, double width = 0);

  void set_size(double size);
  void centre() { pango_layout_set_alignment(layout_.get(), PANGO_ALIGN_CENTER); }
  void cut_at_height(double height);
  void cut_at_width(double width);
  int lines() const { return pango_layout_get_line_count(layout_.get()); }
  /// Where each line begins, bytes of the text.
  std::vector<std::size_t> line_starts() const;
  Size size() const;
  void draw(cairo_t* canvas, double x, double y, const Colour& colour) const;

 private:
  Layout layout_;
};

}  // namespace palpate::runner
