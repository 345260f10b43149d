#include "runner/display/scene/gl_text.h"

#include <epoxy/gl.h>
#include <pango/pangocairo.h>

#include <cmath>
#include <cstddef>
#include <cstring>
#include <glm/vec3.hpp>
#include <memory>
#include <vector>

#include "runner/display/scene/shaders.h"

namespace palpate::runner::display {
namespace {

/// A line of text as an image, set by Pango.
struct TextImage {
  int width = 0, height = 0;        ///< px
  std::vector<unsigned char> bgra;  ///< premultiplied, rows from the top
};

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

/// \param size  px, of the font. \param halo  colour around the letters, so that they are readable
/// on any background
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

}  // namespace

GlText::GlText() : program_(shaders::kTextVertex, shaders::kTextFragment) {
  glGenVertexArrays(1, &nothing_);
}

GlText::~GlText() {
  for (const auto& [text, known] : known_) glDeleteTextures(1, &known.texture);
  glDeleteVertexArrays(1, &nothing_);
}

void GlText::begin(const glm::vec2& picture, double size, const Theme& theme) {
  if (size != size_ || &theme != theme_) {
    for (const auto& [text, known] : known_) glDeleteTextures(1, &known.texture);
    known_.clear();
  }
  picture_ = picture;
  size_ = size;
  theme_ = &theme;
  for (auto& [text, known] : known_) known.used = false;
  glDisable(GL_DEPTH_TEST);
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  program_.use();
  program_.set("picture", picture_);
  program_.set("text", 0);
  glBindVertexArray(nothing_);
}

const GlText::Known& GlText::known(const std::string& text) {
  Known& out = known_[text];
  out.used = true;
  if (out.texture != 0) return out;
  const TextImage image = text_image(text, size_, theme_->text, theme_->halo);
  out.size = {image.width, image.height};
  glGenTextures(1, &out.texture);
  glBindTexture(GL_TEXTURE_2D, out.texture);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, image.width, image.height, 0, GL_BGRA, GL_UNSIGNED_BYTE,
               image.bgra.data());
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  return out;
}

void GlText::draw(const std::string& text, const glm::vec2& at, TextAnchor anchor) {
  if (text.empty()) return;
  const Known& image = known(text);
  glm::vec2 corner = at;
  if (anchor == TextAnchor::left) corner.y -= image.size.y / 2;
  if (anchor == TextAnchor::centre) corner -= 0.5F * image.size;
  if (anchor == TextAnchor::lower_left) corner.y -= image.size.y;
  program_.set("corner", glm::vec2(std::round(corner.x), std::round(corner.y)));
  program_.set("size", image.size);
  glBindTexture(GL_TEXTURE_2D, image.texture);
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
}

void GlText::end() {
  for (auto it = known_.begin(); it != known_.end();) {
    if (it->second.used) {
      ++it;
      continue;
    }
    glDeleteTextures(1, &it->second.texture);
    it = known_.erase(it);
  }
  glDisable(GL_BLEND);
}

}  // namespace palpate::runner::display
