#include "runner/display/page_layout.h"

#include <pango/pangocairo.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "runner/display/window.h"

namespace palpate {
namespace {

struct Colour {
  double red, green, blue;
};
// Dark and even: a bright screen tires, and a trial must not light up the hand.
constexpr Colour kGround{0.118, 0.137, 0.161};
constexpr Colour kText{0.918, 0.902, 0.863};
constexpr Colour kQuietInk{0.639, 0.663, 0.690};
constexpr Colour kCap{0.184, 0.212, 0.247};
constexpr Colour kCapEdge{0.361, 0.400, 0.443};

constexpr const char* kFonts = "Noto Sans, DejaVu Sans, Sans";
constexpr double kSmallest = 0.45;  // of the normal size; below it text is cut off instead

using Canvas = std::unique_ptr<cairo_t, decltype(&cairo_destroy)>;

struct Unref {
  void operator()(PangoLayout* layout) const { g_object_unref(layout); }
};
using Layout = std::unique_ptr<PangoLayout, Unref>;

std::string valid_utf8(const std::string& text) {
  char* const valid = g_utf8_make_valid(text.data(), static_cast<gssize>(text.size()));
  std::string out = valid;
  g_free(valid);
  return out;
}

void set_colour(cairo_t* canvas, const Colour& colour) {
  cairo_set_source_rgb(canvas, colour.red, colour.green, colour.blue);
}

struct Size {
  double width, height;
};

/// A piece of text, set to a size.
class Words {
 public:
  /// \param size  px, of the letters; \param width  px, to break lines at; 0: none
  Words(cairo_t* canvas, const std::string& text, double size, double width = 0)
      : layout_(pango_cairo_create_layout(canvas)) {
    pango_layout_set_text(layout_.get(), valid_utf8(text).c_str(), -1);
    pango_layout_set_line_spacing(layout_.get(), 1.25F);
    if (width > 0) {
      pango_layout_set_width(layout_.get(), pango_units_from_double(width));
      pango_layout_set_wrap(layout_.get(), PANGO_WRAP_WORD_CHAR);
    }
    set_size(size);
  }

  void set_size(double size) {
    PangoFontDescription* const font = pango_font_description_from_string(kFonts);
    pango_font_description_set_absolute_size(font, pango_units_from_double(size));
    pango_layout_set_font_description(layout_.get(), font);
    pango_font_description_free(font);
  }
  void centre() { pango_layout_set_alignment(layout_.get(), PANGO_ALIGN_CENTER); }
  void cut_at_height(double height) {
    pango_layout_set_height(layout_.get(), pango_units_from_double(height));
    pango_layout_set_ellipsize(layout_.get(), PANGO_ELLIPSIZE_END);
  }
  void cut_at_width(double width) {
    pango_layout_set_width(layout_.get(), pango_units_from_double(width));
    pango_layout_set_ellipsize(layout_.get(), PANGO_ELLIPSIZE_END);
  }
  int lines() const { return pango_layout_get_line_count(layout_.get()); }
  Size size() const {
    PangoRectangle box;
    pango_layout_get_extents(layout_.get(), nullptr, &box);
    return {pango_units_to_double(box.width), pango_units_to_double(box.height)};
  }
  void draw(cairo_t* canvas, double x, double y, const Colour& colour) const {
    set_colour(canvas, colour);
    cairo_move_to(canvas, std::round(x), std::round(y));
    pango_cairo_show_layout(canvas, layout_.get());
  }

 private:
  Layout layout_;
};

void cap(cairo_t* canvas, double x, double y, double width, double height) {
  const double radius = 0.18 * height;
  cairo_new_path(canvas);
  cairo_arc(canvas, x + width - radius, y + radius, radius, -M_PI / 2, 0);
  cairo_arc(canvas, x + width - radius, y + height - radius, radius, 0, M_PI / 2);
  cairo_arc(canvas, x + radius, y + height - radius, radius, M_PI / 2, M_PI);
  cairo_arc(canvas, x + radius, y + radius, radius, M_PI, 3 * M_PI / 2);
  cairo_close_path(canvas);
  set_colour(canvas, kCap);
  cairo_fill_preserve(canvas);
  set_colour(canvas, kCapEdge);
  cairo_set_line_width(canvas, std::max(1.0, 0.035 * height));
  cairo_stroke(canvas);
}

std::string on_the_cap(const std::string& key) {
  if (key.size() == 1 && key[0] >= 'a' && key[0] <= 'z') {
    return {static_cast<char>(key[0] - 'a' + 'A')};
  }
  return key;
}

/// What each key answers, in as many rows as it takes.
class KeyMap {
 public:
  KeyMap(cairo_t* canvas, const Page& page, double unit, double width) : unit_(unit) {
    double right = 0;
    items_.reserve(page.keys.size());
    for (const auto& [key, answer] : page.keys) {
      Item item{
          Words(canvas, on_the_cap(key), 1.15 * unit), Words(canvas, answer, unit), 0, 0, 0, 0};
      item.answer.cut_at_width(std::min(item.answer.size().width + 2, 12 * unit));
      item.cap_width = std::max(kCapHeight * unit, item.key.size().width + 1.2 * unit);
      item.width = std::max(item.cap_width, item.answer.size().width) + 2 * unit;
      if (rows_.empty() || right + item.width > width) {
        rows_.push_back(0);
        right = 0;
      }
      item.row = rows_.size() - 1;
      item.x = right;
      right += item.width;
      rows_.back() = right;
      items_.push_back(std::move(item));
    }
  }

  double height() const {
    return items_.empty() ? 0 : (static_cast<double>(rows_.size()) * kRowHeight - 0.8) * unit_;
  }

  void draw(cairo_t* canvas, double middle, double top) const {
    for (const Item& item : items_) {
      const double centre = middle - rows_[item.row] / 2 + item.x + item.width / 2;
      const double y = top + static_cast<double>(item.row) * kRowHeight * unit_;
      cap(canvas, std::round(centre - item.cap_width / 2), std::round(y),
          std::round(item.cap_width), std::round(kCapHeight * unit_));
      const Size key = item.key.size(), answer = item.answer.size();
      item.key.draw(canvas, centre - key.width / 2, y + (kCapHeight * unit_ - key.height) / 2,
                    kText);
      item.answer.draw(canvas, centre - answer.width / 2, y + (kCapHeight + 0.45) * unit_,
                       kQuietInk);
    }
  }

 private:
  static constexpr double kCapHeight = 2.3, kRowHeight = 5.2;  // in units

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
void draw_go_on(cairo_t* canvas, double middle, double top, double unit) {
  const double width = 9 * unit, height = 1.9 * unit;
  cap(canvas, std::round(middle - width / 2), std::round(top), std::round(width),
      std::round(height));
  set_colour(canvas, kQuietInk);
  cairo_set_line_width(canvas, std::max(1.0, 0.1 * unit));
  // The bar's usual mark, and an arrow: on.
  const double base = top + 0.62 * height, left = middle - 1.9 * unit;
  cairo_move_to(canvas, left, base - 0.35 * unit);
  cairo_line_to(canvas, left, base);
  cairo_line_to(canvas, left + 1.6 * unit, base);
  cairo_line_to(canvas, left + 1.6 * unit, base - 0.35 * unit);
  const double line = top + height / 2, tip = middle + 2 * unit;
  cairo_move_to(canvas, tip - 1.6 * unit, line);
  cairo_line_to(canvas, tip, line);
  cairo_move_to(canvas, tip - 0.45 * unit, line - 0.4 * unit);
  cairo_line_to(canvas, tip, line);
  cairo_line_to(canvas, tip - 0.45 * unit, line + 0.4 * unit);
  cairo_stroke(canvas);
}

void draw_text(cairo_t* canvas, const Page& page, double unit, double width, double top,
               double room) {
  if (page.text.empty() || room <= 0) return;
  const bool large = page.kind == Page::Kind::feedback;
  double size = (large ? 2.6 : 1.4) * unit;
  Words words(canvas, page.text, size, std::min(0.84 * width, 38 * unit));
  // A screenful is set smaller step by step rather than cut.
  while (words.size().height > room && size > kSmallest * unit) {
    size *= 0.94;
    words.set_size(size);
  }
  // Pango's limit of height knows nothing of the space between lines.
  for (double height = room; words.size().height > room && height > size; height *= 0.94) {
    words.cut_at_height(height);
  }
  if (large || words.lines() <= 2) words.centre();
  words.draw(canvas, width / 2 - std::min(0.84 * width, 38 * unit) / 2,
             top + (room - std::min(room, words.size().height)) / 2, kText);
}

}  // namespace

Image draw_page(const Page& page, int width, int height) {
  Image image{std::max(width, 1), std::max(height, 1), {}};
  image.pixels.resize(static_cast<std::size_t>(image.width) * image.height);
  const std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)> surface(
      cairo_image_surface_create_for_data(reinterpret_cast<unsigned char*>(image.pixels.data()),
                                          CAIRO_FORMAT_RGB24, image.width, image.height,
                                          4 * image.width),
      &cairo_surface_destroy);
  const Canvas owned(cairo_create(surface.get()), &cairo_destroy);
  cairo_t* const canvas = owned.get();
  set_colour(canvas, kGround);
  cairo_paint(canvas);

  const double w = image.width, h = image.height;
  const double unit = std::max(2.0, std::min(h / 34, w / 46));
  const bool goes_on = page.kind == Page::Kind::text;
  const KeyMap keys(canvas, page, unit, 0.94 * w);
  const double margin = 2.5 * unit;
  const double go_on_top = h - margin - 1.9 * unit;
  const double keys_top =
      (goes_on ? go_on_top - 2 * unit : h - margin - 1.2 * unit) - keys.height();
  keys.draw(canvas, w / 2, std::max(keys_top, 0.0));
  if (goes_on) draw_go_on(canvas, w / 2, go_on_top, unit);
  if (page.kind != Page::Kind::neutral) {
    const double bottom = page.keys.empty() ? (goes_on ? go_on_top : h) : keys_top;
    draw_text(canvas, page, unit, w, margin, bottom - 2 * margin);
  }
  cairo_surface_flush(surface.get());
  for (std::uint32_t& pixel : image.pixels) pixel |= 0xff000000U;
  return image;
}

std::uint32_t ground_colour() {
  const auto level = [](double share) {
    return static_cast<std::uint32_t>(std::lround(share * 255));
  };
  return 0xff000000U | level(kGround.red) << 16 | level(kGround.green) << 8 | level(kGround.blue);
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
  return std::to_string(missing.size()) +
         " letters of the protocol's texts are in no installed font (" + shown +
         (missing.size() > 10 ? "...)" : ")") +
         ": install one that has them, for example the package fonts-noto-core or fonts-noto-cjk";
}

}  // namespace palpate
