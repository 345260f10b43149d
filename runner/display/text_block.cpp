#include "runner/display/text_block.h"

#include <set>
#include <string>
#include <vector>

#include "runner/display/participant_window.h"

namespace palpate::runner::display {
namespace {

constexpr const char* kFonts = "Noto Sans, DejaVu Sans, Sans";
constexpr double kLineSpacing = 1.25;

}  // namespace

std::string valid_utf8(const std::string& text) {
  char* const valid = g_utf8_make_valid(text.data(), static_cast<gssize>(text.size()));
  std::string out = valid;
  g_free(valid);
  return out;
}

void set_colour(cairo_t* canvas, const Colour& colour) {
  cairo_set_source_rgb(canvas, colour.red, colour.green, colour.blue);
}

TextBlock::TextBlock(cairo_t* canvas, const std::string& text, double size, double width)
    : layout_(pango_cairo_create_layout(canvas)) {
  pango_layout_set_text(layout_.get(), valid_utf8(text).c_str(), -1);
  pango_layout_set_line_spacing(layout_.get(), kLineSpacing);
  if (width > 0) {
    pango_layout_set_width(layout_.get(), pango_units_from_double(width));
    pango_layout_set_wrap(layout_.get(), PANGO_WRAP_WORD_CHAR);
  }
  set_size(size);
}

void TextBlock::set_size(double size) {
  PangoFontDescription* const font = pango_font_description_from_string(kFonts);
  pango_font_description_set_absolute_size(font, pango_units_from_double(size));
  pango_layout_set_font_description(layout_.get(), font);
  pango_font_description_free(font);
}

void TextBlock::cut_at_height(double height) {
  pango_layout_set_height(layout_.get(), pango_units_from_double(height));
  pango_layout_set_ellipsize(layout_.get(), PANGO_ELLIPSIZE_END);
}

void TextBlock::cut_at_width(double width) {
  pango_layout_set_width(layout_.get(), pango_units_from_double(width));
  pango_layout_set_ellipsize(layout_.get(), PANGO_ELLIPSIZE_END);
}

std::vector<std::size_t> TextBlock::line_starts() const {
  std::vector<std::size_t> starts;
  for (int i = 0; i < lines(); ++i) {
    const PangoLayoutLine* const line = pango_layout_get_line_readonly(layout_.get(), i);
    starts.push_back(static_cast<std::size_t>(line->start_index));
  }
  return starts;
}

Size TextBlock::size() const {
  PangoRectangle box;
  pango_layout_get_extents(layout_.get(), nullptr, &box);
  return {pango_units_to_double(box.width), pango_units_to_double(box.height)};
}

void TextBlock::draw(cairo_t* canvas, double x, double y, const Colour& colour) const {
  set_colour(canvas, colour);
  cairo_move_to(canvas, std::round(x), std::round(y));
  pango_cairo_show_layout(canvas, layout_.get());
}

std::string missing_letters(const std::vector<std::string>& texts) {
  const std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)> surface(
      cairo_image_surface_create(CAIRO_FORMAT_A8, 1, 1), &cairo_surface_destroy);
  const Canvas canvas(cairo_create(surface.get()), &cairo_destroy);
  const Layout layout(pango_cairo_create_layout(canvas.get()));
  std::set<gunichar> asked, missing;
  std::string shown;
  for (const std::string& text : texts) {
    const std::string valid = valid_utf8(text);
    for (const char* at = valid.c_str(); *at != 0; at = g_utf8_next_char(at)) {
      const gunichar letter = g_utf8_get_char(at);
      if (!g_unichar_isgraph(letter) || !asked.insert(letter).second) continue;
      const std::string one(at, static_cast<std::size_t>(g_utf8_next_char(at) - at));
      pango_layout_set_text(layout.get(), one.c_str(), -1);
      if (pango_layout_get_unknown_glyphs_count(layout.get()) == 0) continue;
      if (missing.insert(letter).second && missing.size() <= 10) shown += one;
    }
  }
  if (missing.empty()) return {};
  return "the participant would see boxes instead of " + std::to_string(missing.size()) +
         " characters of the protocol's texts, which are in no installed font (" + shown +
         (missing.size() > 10 ? "...)" : ")") +
         ": install one that has them, for example the package fonts-noto-core or fonts-noto-cjk";
}

}  // namespace palpate::runner::display
