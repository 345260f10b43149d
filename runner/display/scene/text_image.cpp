#include "runner/display/scene/text_image.h"

#include <pango/pangocairo.h>

#include <cmath>
#include <cstddef>
#include <cstring>
#include <memory>

namespace palpate::runner {
namespace {

constexpr const char* kLabelFont = "Noto Sans, DejaVu Sans, Sans Medium";
constexpr double kHaloWidth = 0.22, kHaloOpacity = 0.75;  // of the font's size

struct ReleaseObject {
  void operator()(PangoLayout* layout) const { g_object_unref(layout); }
  void operator()(PangoFontDescription* font) const { pango_font_description_free(font); }
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
  void operator()(cairo_t* canvas) const { cairo_destroy(canvas); }
  void operator()(char* text) const { g_free(text); }
};
template <class T>
using Owned = std::unique_ptr<T, ReleaseObject>;

Owned<PangoLayout> laid_out(cairo_t* canvas, const std::string& text, double size) {
  Owned<PangoLayout> layout(pango_cairo_create_layout(canvas));
  const Owned<char> valid(g_utf8_make_valid(text.data(), static_cast<gssize>(text.size())));
  pango_layout_set_text(layout.get(), valid.get(), -1);
  const Owned<PangoFontDescription> font(pango_font_description_from_string(kLabelFont));
  pango_font_description_set_absolute_size(font.get(), pango_units_from_double(size));
  pango_layout_set_font_description(layout.get(), font.get());
  return layout;
}

}  // namespace

TextImage text_image(const std::string& text, double size, const glm::vec3& colour,
                     const glm::vec3& halo) {
  const double border = std::ceil(kHaloWidth * size);
  const Owned<cairo_surface_t> probe(cairo_image_surface_create(CAIRO_FORMAT_ARGB32, 1, 1));
  const Owned<cairo_t> measure(cairo_create(probe.get()));
  PangoRectangle box;
  pango_layout_get_pixel_extents(laid_out(measure.get(), text, size).get(), nullptr, &box);
  TextImage out;
  out.width = box.width + static_cast<int>(2 * border);
  out.height = box.height + static_cast<int>(2 * border);
  const Owned<cairo_surface_t> surface(
      cairo_image_surface_create(CAIRO_FORMAT_ARGB32, out.width, out.height));
  const Owned<cairo_t> canvas(cairo_create(surface.get()));
  const Owned<PangoLayout> layout = laid_out(canvas.get(), text, size);
  cairo_move_to(canvas.get(), border, border);
  pango_cairo_layout_path(canvas.get(), layout.get());
  cairo_set_line_join(canvas.get(), CAIRO_LINE_JOIN_ROUND);
  cairo_set_line_width(canvas.get(), kHaloWidth * size);
  cairo_set_source_rgba(canvas.get(), halo.x, halo.y, halo.z, kHaloOpacity);
  cairo_stroke_preserve(canvas.get());
  cairo_set_source_rgb(canvas.get(), colour.x, colour.y, colour.z);
  cairo_fill(canvas.get());
  cairo_surface_flush(surface.get());
  const auto row = static_cast<std::size_t>(out.width) * 4;
  out.bgra.resize(row * static_cast<std::size_t>(out.height));
  const unsigned char* const data = cairo_image_surface_get_data(surface.get());
  const auto stride = static_cast<std::size_t>(cairo_image_surface_get_stride(surface.get()));
  for (std::size_t y = 0; data != nullptr && y < static_cast<std::size_t>(out.height); ++y)
    std::memcpy(&out.bgra[y * row], data + y * stride, row);
  return out;
}

}  // namespace palpate::runner
