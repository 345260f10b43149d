#include "runner/display/participant_window.h"

#include <epoxy/gl.h>
#include <pango/pangocairo.h>

#include <cmath>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "runner/display/window.h"

namespace palpate::runner::display {
namespace {

// Text set by Pango, and the colours of the participant's pages.

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

constexpr const char* kFonts = "Noto Sans, DejaVu Sans, Sans";
constexpr double kLineSpacing = 1.25;

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

}  // namespace

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

// After epoxy, which replaces the GL headers.
#include <GLFW/glfw3.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "data/base/text.h"
#include "runner/display/display.h"
#include "runner/display/key_names.h"
#include "runner/display/x11_errors.h"

namespace palpate::runner::display {

// Elements of a participant's page: answer keys, progress bar, checklist, the symbol of the space
// bar. Sizes are in a unit (px) that grows with the page.

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
/// Draws a PNG file as large as fits, at most at twice its size; a note if it is not a PNG file.
void draw_picture(cairo_t* canvas, const std::string& bytes, double middle, double top,
                  double width, double room);
/// Draws the typed text in a field.
void draw_typed(cairo_t* canvas, const std::string& typed, double middle, double top, double unit,
                double width);
double text_width(double width, double unit);
std::string minutes_and_seconds(int seconds);  ///< "0:25"

namespace {

constexpr double kKeycapHeight = 2.3;   // units
constexpr double kSmallestKeys = 0.45;  // of the normal size

void draw_keycap(cairo_t* canvas, double x, double y, double width, double height,
                 const Colour& edge = kKeycapEdge) {
  const double radius = 0.18 * height;
  cairo_new_path(canvas);
  cairo_arc(canvas, x + width - radius, y + radius, radius, -M_PI / 2, 0);
  cairo_arc(canvas, x + width - radius, y + height - radius, radius, 0, M_PI / 2);
  cairo_arc(canvas, x + radius, y + height - radius, radius, M_PI / 2, M_PI);
  cairo_arc(canvas, x + radius, y + radius, radius, M_PI, 3 * M_PI / 2);
  cairo_close_path(canvas);
  set_colour(canvas, kKeycap);
  cairo_fill_preserve(canvas);
  set_colour(canvas, edge);
  cairo_set_line_width(canvas, std::max(1.0, 0.035 * height));
  cairo_stroke(canvas);
}

/// Source from which cairo reads a PNG file.
struct PngBytes {
  const std::string& all;
  std::size_t at = 0;
};

cairo_status_t read_png(void* from, unsigned char* to, unsigned count) {
  auto& bytes = *static_cast<PngBytes*>(from);
  if (bytes.all.size() - bytes.at < count) return CAIRO_STATUS_READ_ERROR;
  std::memcpy(to, bytes.all.data() + bytes.at, count);
  bytes.at += count;
  return CAIRO_STATUS_SUCCESS;
}

std::string keycap_label(const std::string& key) {
  if (key.size() == 1 && key[0] >= 'a' && key[0] <= 'z') {
    return {static_cast<char>(key[0] - 'a' + 'A')};
  }
  return key;
}

}  // namespace

KeyMap::KeyMap(cairo_t* canvas, const Page& page, double unit, double width, double room)
    : unit_(unit),
      chosen_(static_cast<std::size_t>(
          std::find_if(page.keys.begin(), page.keys.end(),
                       [&page](const auto& entry) { return entry.first == page.chosen; }) -
          page.keys.begin())) {
  if (page.keys.empty()) return;
  if (lay_side_by_side(canvas, page, width) && height_ <= room) return;
  for (const double share : {1.0, 0.85, 0.7, 0.55, kSmallestKeys}) {
    unit_ = share * unit;
    for (int columns = 1; columns <= 3; ++columns) {
      if (lay_in_columns(canvas, page, 0.9 * width, room, columns)) return;
    }
  }
  unit_ = unit;
  lay_side_by_side(canvas, page, width);  // no layout fits: cut labels off
}

/// \return  whether it looks right: nothing is cut off, and a question's answers are in one row
bool KeyMap::lay_side_by_side(cairo_t* canvas, const Page& page, double width) {
  constexpr double kRowHeight = 5.2, kWidest = 12;  // units
  items_.clear();
  bool whole = true;
  std::vector<double> rows;  // px; width of each row
  std::vector<std::size_t> row_of;
  for (const auto& [key, answer] : page.keys) {
    Item item{TextBlock(canvas, keycap_label(key), 1.15 * unit_),
              TextBlock(canvas, answer, unit_),
              0,
              0,
              0,
              0,
              0,
              (kKeycapHeight + 0.45) * unit_};
    whole = whole && item.answer.size().width <= kWidest * unit_;
    item.answer.cut_at_width(std::min(item.answer.size().width + 2, kWidest * unit_));
    item.cap_width = std::max(kKeycapHeight * unit_, item.key.size().width + 1.2 * unit_);
    item.width = std::max(item.cap_width, item.answer.size().width) + 2 * unit_;
    if (rows.empty() || rows.back() + item.width > width) rows.push_back(0);
    row_of.push_back(rows.size() - 1);
    item.x = rows.back() + (item.width - item.cap_width) / 2;
    item.answer_x = rows.back() + (item.width - item.answer.size().width) / 2;
    rows.back() += item.width;
    items_.push_back(std::move(item));
  }
  for (std::size_t i = 0; i < items_.size(); ++i) {
    Item& item = items_[i];
    const double top = static_cast<double>(row_of[i]) * kRowHeight * unit_;
    item.x -= rows[row_of[i]] / 2;
    item.answer_x -= rows[row_of[i]] / 2;
    item.y += top;
    item.answer_y += top;
  }
  height_ = (static_cast<double>(rows.size()) * kRowHeight - 0.8) * unit_;
  return whole && (page.kind != Page::Kind::text || rows.size() == 1);
}

/// \return  whether it fits
bool KeyMap::lay_in_columns(cairo_t* canvas, const Page& page, double width, double room,
                            int columns) {
  constexpr double kGap = 0.5;  // units, between two columns
  const std::size_t each = (page.keys.size() + static_cast<std::size_t>(columns) - 1) /
                           static_cast<std::size_t>(columns);
  double cap_width = kKeycapHeight * unit_;
  for (const auto& [key, answer] : page.keys)
    cap_width = std::max(
        cap_width, TextBlock(canvas, keycap_label(key), 1.15 * unit_).size().width + 1.2 * unit_);
  const double text_left = cap_width + 0.8 * unit_;
  const double most = width / columns - text_left - unit_;
  if (most < 6 * unit_ && columns > 1) return false;
  items_.clear();
  height_ = 0;
  double left = 0, y = 0, widest = 0;
  for (std::size_t i = 0; i < page.keys.size(); ++i) {
    if (i > 0 && i % each == 0) {
      left += text_left + widest + unit_;
      y = widest = 0;
    }
    const auto& [key, answer] = page.keys[i];
    Item item{TextBlock(canvas, keycap_label(key), 1.15 * unit_),
              TextBlock(canvas, answer, unit_, std::max(most, unit_)),
              cap_width,
              0,
              left,
              y,
              left + text_left,
              y};
    const Size size = item.answer.size();
    const double high = std::max(kKeycapHeight * unit_, size.height);
    item.y += (high - kKeycapHeight * unit_) / 2;
    item.answer_y += (high - size.height) / 2;
    widest = std::max(widest, size.width);
    height_ = std::max(height_, y + high);
    y += high + kGap * unit_;
    items_.push_back(std::move(item));
  }
  const double all = left + text_left + widest;
  for (Item& item : items_) {
    item.x -= all / 2;
    item.answer_x -= all / 2;
  }
  return height_ <= room && all <= 1.06 * width;
}

void KeyMap::draw(cairo_t* canvas, double middle, double top) const {
  for (const Item& item : items_) {
    const double left = middle + item.x, y = top + item.y;
    const bool chosen = &item == items_.data() + chosen_;
    draw_keycap(canvas, std::round(left), std::round(y), std::round(item.cap_width),
                std::round(kKeycapHeight * unit_), chosen ? kGo : kKeycapEdge);
    const Size key = item.key.size();
    item.key.draw(canvas, left + (item.cap_width - key.width) / 2,
                  y + (kKeycapHeight * unit_ - key.height) / 2, kText);
    item.answer.draw(canvas, middle + item.answer_x, top + item.answer_y, chosen ? kGo : kQuietInk);
  }
}

void draw_picture(cairo_t* canvas, const std::string& bytes, double middle, double top,
                  double width, double room) {
  PngBytes source{bytes};
  const std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)> picture(
      cairo_image_surface_create_from_png_stream(&read_png, &source), &cairo_surface_destroy);
  if (cairo_surface_status(picture.get()) != CAIRO_STATUS_SUCCESS) {
    TextBlock(canvas, "(PNG?)", room / 8).draw(canvas, middle - room / 6, top, kReply);
    return;
  }
  const double wide = cairo_image_surface_get_width(picture.get());
  const double high = cairo_image_surface_get_height(picture.get());
  const double scale = std::min({width / wide, room / high, 2.0});
  cairo_save(canvas);
  cairo_translate(canvas, middle - scale * wide / 2, top + (room - scale * high) / 2);
  cairo_scale(canvas, scale, scale);
  cairo_set_source_surface(canvas, picture.get(), 0, 0);
  cairo_paint(canvas);
  cairo_restore(canvas);
}

void draw_typed(cairo_t* canvas, const std::string& typed, double middle, double top, double unit,
                double width) {
  TextBlock words(canvas, typed + "_", 1.6 * unit);
  // Show the end of the text, where it is being typed.
  std::string shown = typed;
  while (words.size().width > width - unit && shown.size() > 1) {
    shown.erase(0, 1);
    while (!shown.empty() && continues_character(shown[0])) shown.erase(0, 1);
    words = TextBlock(canvas, "\u2026" + shown + "_", 1.6 * unit);
  }
  const double field = std::max(words.size().width + unit, std::min(10 * unit, width));
  draw_keycap(canvas, std::round(middle - field / 2), std::round(top), std::round(field),
              std::round(2.9 * unit));
  words.draw(canvas, middle - words.size().width / 2, top + (2.9 * unit - words.size().height) / 2,
             kText);
}

void draw_continue(cairo_t* canvas, double middle, double top, double unit) {
  const double width = 9 * unit, height = 1.9 * unit;
  draw_keycap(canvas, std::round(middle - width / 2), std::round(top), std::round(width),
              std::round(height));
  set_colour(canvas, kQuietInk);
  cairo_set_line_width(canvas, std::max(1.0, 0.1 * unit));
  // The usual symbol of the space bar, and an arrow to the right.
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

double text_width(double width, double unit) { return std::min(0.84 * width, 38 * unit); }

void draw_progress(cairo_t* canvas, const Page& page, double unit, double width) {
  if (page.trials <= 0 || page.done <= 0) return;
  const double fraction = std::min(1.0, static_cast<double>(page.done) / page.trials);
  const double left = 0.08 * width, all = 0.84 * width, top = 1.2 * unit;
  const TextBlock count(canvas, std::to_string(page.done) + " / " + std::to_string(page.trials),
                        unit);
  const double bar = all - count.size().width - unit;
  for (const auto& [wide, colour] : {std::pair(bar, kKeycap), std::pair(fraction * bar, kGo)}) {
    set_colour(canvas, colour);
    cairo_rectangle(canvas, std::round(left), std::round(top), std::round(wide),
                    std::round(0.3 * unit));
    cairo_fill(canvas);
  }
  count.draw(canvas, left + all - count.size().width, top + 0.15 * unit - count.size().height / 2,
             kQuietInk);
}

std::string minutes_and_seconds(int seconds) {
  const std::string rest = std::to_string(seconds % 60);
  return std::to_string(seconds / 60) + (rest.size() < 2 ? ":0" : ":") + rest;
}

void draw_checklist(cairo_t* canvas, const Checklist& list, double unit, double width, double top,
                    double room) {
  using State = Checklist::Step::State;
  const double line_width = text_width(width, unit), left = (width - line_width) / 2;
  std::size_t due = 0;
  while (due < list.steps.size() && list.steps[due].state != State::now) ++due;
  const std::string of = std::to_string(std::min(due + 1, list.steps.size())) + " / " +
                         std::to_string(list.steps.size());
  TextBlock(canvas, of, 2 * unit).draw(canvas, left, top, kQuietInk);
  double y = top + 4 * unit;
  const double steps = static_cast<double>(list.steps.size()) * 2.2 * unit;
  std::string instruction = list.instruction;
  if (!instruction.empty() && instruction[0] >= 'a' && instruction[0] <= 'z') instruction[0] -= 32;
  const double instructions = std::max(room - 4 * unit - steps - unit, 3 * unit);
  TextBlock how(canvas, instruction, kTextSize * unit, line_width);
  for (double size = kTextSize * unit; how.size().height > instructions && size > unit;) {
    size *= 0.94;
    how.set_size(size);
  }
  how.draw(canvas, left, y, kText);
  y += how.size().height + 2 * unit;  // if not everything fits, the last steps are cut off
  for (const Checklist::Step& step : list.steps) {
    const bool now = step.state == State::now;
    const char* const mark = step.state == State::done       ? "\u2713"
                             : step.state == State::left_out ? "\u2013"
                             : now                           ? "\u25b6"
                                                             : "\u25cb";
    const Colour& colour = step.state == State::done ? kGo : now ? kText : kQuietInk;
    TextBlock(canvas, mark, 1.1 * unit).draw(canvas, left, y, colour);
    TextBlock(canvas, step.words, 1.1 * unit).draw(canvas, left + 2.4 * unit, y, colour);
    y += 2.2 * unit;
  }
}

namespace {

constexpr double kSmallestUnit = 14;  // px, at scale 1
constexpr double kMostKeys = 0.55;    // largest share of the height for the answer keys
constexpr std::size_t kMostScreens = 200;
constexpr double kSmallestSize = 0.45;  // of the normal size; below it text is truncated instead

/// Splits a text between lines into screens, all with the same text size.
std::vector<std::string> split_into_screens(cairo_t* canvas, const std::string& text, double unit,
                                            double width, double room) {
  const std::string valid = valid_utf8(text);
  const TextBlock words(canvas, valid, kTextSize * unit, text_width(width, unit));
  const std::vector<std::size_t> starts = words.line_starts();
  const double line = words.size().height / std::max(words.lines(), 1);
  const auto fit = static_cast<std::size_t>(std::max(1.0, std::floor(room / line)));
  std::vector<std::string> screens;
  for (std::size_t i = 0; i < starts.size() && screens.size() < kMostScreens; i += fit) {
    const std::size_t end = i + fit < starts.size() ? starts[i + fit] : valid.size();
    std::string part = valid.substr(starts[i], end - starts[i]);
    while (!part.empty() && part.back() == '\n') part.pop_back();
    if (!part.empty()) screens.push_back(std::move(part));
  }
  if (screens.empty()) screens.emplace_back();
  return screens;
}

void draw_text(cairo_t* canvas, const std::string& text, double size, double smallest, double width,
               double line_width, double top, double room, const Colour& colour, bool centred) {
  if (text.empty() || room <= 0) return;
  TextBlock words(canvas, text, size, line_width);
  while (words.size().height > room && size > smallest) {
    size *= 0.94;
    words.set_size(size);
  }
  // Pango's height limit ignores the line spacing.
  for (double height = room; words.size().height > room && height > size; height *= 0.94) {
    words.cut_at_height(height);
  }
  if (centred || words.lines() <= 2) words.centre();
  words.draw(canvas, (width - line_width) / 2,
             top + (room - std::min(room, words.size().height)) / 2, colour);
}

/// Positions of a page's elements for a screen size.
class PageLayout {
 public:
  PageLayout(cairo_t* canvas, const Page& page, double width, double height, double ui_scale)
      : canvas_(canvas),
        page_(page),
        width_(width),
        unit_(std::max({2.0, std::min(height / 34, width / 46),
                        std::min({kSmallestUnit * ui_scale, height / 16, width / 20})})),
        keys_(canvas, page, unit_, 0.94 * width, kMostKeys * height) {
    const double margin = 2.5 * unit_;
    const bool continues = page.kind == Page::Kind::text;
    const bool typing = page.typing != Page::Typing::none;
    continue_top_ = height - margin - 1.9 * unit_;
    keys_top_ =
        (continues ? continue_top_ - 2 * unit_ : height - margin - 1.2 * unit_) - keys_.height();
    reply_top_ = (page.keys.empty() ? (continues ? continue_top_ : height - unit_) : keys_top_) -
                 2.4 * unit_;
    top_ = margin + 0.6 * unit_;
    typed_top_ = reply_top_ - (typing ? 4 * unit_ : 0);
    count_top_ = typed_top_ - (page.seconds_left > 0 ? 4.5 * unit_ : 0);
    const double all = count_top_ - margin / 2 - top_;
    picture_ = page.picture ? 0.6 * all : 0;
    picture_top_ = top_;
    top_ += picture_;
    room_ = all - picture_;
  }

  std::vector<std::string> screens() const {
    if (page_.kind != Page::Kind::text) return {page_.text};
    return split_into_screens(canvas_, page_.text, unit_, width_, room_);
  }

  void draw(int screen) const {
    const auto last = static_cast<int>(screens().size()) - 1;
    const bool answers = !page_.keys.empty() && screen >= last;
    if (answers || page_.kind != Page::Kind::text)
      keys_.draw(canvas_, width_ / 2, std::max(keys_top_, 0.0));
    if (page_.picture)
      draw_picture(canvas_, *page_.picture, width_ / 2, picture_top_, text_width(width_, unit_),
                   0.96 * picture_);
    if (page_.typing != Page::Typing::none)
      draw_typed(canvas_, page_.typed, width_ / 2, typed_top_, unit_, text_width(width_, unit_));
    draw_progress(canvas_, page_, unit_, width_);
    if (page_.back)
      TextBlock(canvas_, "\u2190", 1.4 * unit_).draw(canvas_, unit_, continue_top_, kQuietInk);
    if (page_.seconds_left > 0)
      draw_line(minutes_and_seconds(page_.seconds_left), 3 * unit_, count_top_, kQuietInk);
    if (!page_.reply.empty()) draw_line(page_.reply, 1.2 * unit_, reply_top_, kReply);
    if (page_.kind == Page::Kind::text) {
      if (!answers) draw_continue(canvas_, width_ / 2, continue_top_, unit_);
      draw_screen(screen);
    } else if (page_.kind == Page::Kind::checklist) {
      draw_checklist(canvas_, page_.checklist, unit_, width_, top_, room_);
    } else {
      const bool large = page_.kind != Page::Kind::message;
      const double letters = page_.kind == Page::Kind::feedback ? 8 : large ? 2.6 : 1.8;
      draw_text(canvas_, page_.text, letters * unit_, kSmallestSize * unit_, width_,
                text_width(width_, unit_), top_, room_, page_.go ? kGo : kText, large);
    }
  }

 private:
  void draw_line(const std::string& text, double size, double top, const Colour& colour) const {
    TextBlock words(canvas_, text, size);
    while (words.size().width > 0.94 * width_ && size > kSmallestSize * unit_) {
      size *= 0.94;
      words.set_size(size);
    }
    if (words.size().width > 0.94 * width_) words.cut_at_width(0.94 * width_);
    words.draw(canvas_, (width_ - std::min(words.size().width, 0.94 * width_)) / 2, top, colour);
  }

  void draw_screen(int screen) const {
    const std::vector<std::string> all = screens();
    const auto count = static_cast<int>(all.size());
    const int at = std::clamp(screen, 0, count - 1);
    // Align at the top like the other screens, even if the last has only two lines.
    draw_text(canvas_, all[static_cast<std::size_t>(at)], kTextSize * unit_, kSmallestSize * unit_,
              width_, text_width(width_, unit_), top_, room_, kText, false);
    if (count == 1 && page_.parts < 2) return;
    const auto of = [](int one, int total) {
      return std::to_string(one) + " / " + std::to_string(total);
    };
    std::string place = page_.parts > 1 ? of(page_.part, page_.parts) : of(at + 1, count);
    if (page_.parts > 1 && count > 1) place += "  (" + of(at + 1, count) + ")";
    const TextBlock number(canvas_, place, unit_);
    number.draw(canvas_, width_ / 2 + 6 * unit_, continue_top_ + 0.3 * unit_, kQuietInk);
  }

  cairo_t* canvas_;
  const Page& page_;
  double width_, unit_;
  KeyMap keys_;
  double continue_top_ = 0, keys_top_ = 0, reply_top_ = 0, count_top_ = 0, top_ = 0, room_ = 0;
  double typed_top_ = 0, picture_ = 0, picture_top_ = 0;
};

}  // namespace

Image draw_page(const Page& page, int width, int height, const PageOptions& setting) {
  Image image{std::max(width, 1), std::max(height, 1), {}};
  image.pixels.resize(static_cast<std::size_t>(image.width) * image.height);
  const std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)> surface(
      cairo_image_surface_create_for_data(reinterpret_cast<unsigned char*>(image.pixels.data()),
                                          CAIRO_FORMAT_RGB24, image.width, image.height,
                                          4 * image.width),
      &cairo_surface_destroy);
  const Canvas owned(cairo_create(surface.get()), &cairo_destroy);
  set_colour(owned.get(), kGround);
  cairo_paint(owned.get());
  PageLayout(owned.get(), page, image.width, image.height, setting.ui_scale).draw(setting.screen);
  cairo_surface_flush(surface.get());
  for (std::uint32_t& pixel : image.pixels) pixel |= 0xff000000U;
  return image;
}

int screen_count(const Page& page, int width, int height, double ui_scale) {
  if (page.kind != Page::Kind::text) return 1;
  const std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)> surface(
      cairo_image_surface_create(CAIRO_FORMAT_RGB24, 1, 1), &cairo_surface_destroy);
  const Canvas owned(cairo_create(surface.get()), &cairo_destroy);
  const PageLayout frame(owned.get(), page, std::max(width, 1), std::max(height, 1), ui_scale);
  return static_cast<int>(frame.screens().size());
}

std::uint32_t ground_colour() {
  const auto level = [](double fraction) {
    return static_cast<std::uint32_t>(std::lround(fraction * 255));
  };
  return 0xff000000U | level(kGround.red) << 16 | level(kGround.green) << 8 | level(kGround.blue);
}

ParticipantWindow::ParticipantWindow(const WindowSettings& settings, const WindowGeometry& geometry,
                                     double ui_scale)
    : settings_(settings), window_(make_window(settings.title, geometry)), ui_scale_(ui_scale) {
  glfwSetInputMode(window_, GLFW_CURSOR, GLFW_CURSOR_HIDDEN);
  glGenTextures(1, &texture_);
  glBindTexture(GL_TEXTURE_2D, texture_);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glGenFramebuffers(1, &frame_);
}

ParticipantWindow::~ParticipantWindow() {
  if (window_ != nullptr) destroy();
}

void ParticipantWindow::destroy() {
  glfwDestroyWindow(window_);
  window_ = nullptr;
}

void ParticipantWindow::abandon() noexcept {
  window_ = nullptr;
  open_.store(false);
}

std::string ParticipantWindow::misplaced() const {
  const std::lock_guard lock(place_mutex_);
  return misplaced_;
}

void ParticipantWindow::put_place(bool settled, const std::string& misplaced) {
  {
    const std::lock_guard lock(place_mutex_);
    misplaced_ = misplaced;
  }
  settled_.store(settled);
}

bool ParticipantWindow::is_answer_key(int key, int scancode) const {
  const std::string name = match_key(key_names(key, scancode), page_.keys);
  return std::any_of(page_.keys.begin(), page_.keys.end(),
                     [&](const auto& entry) { return entry.first == name; });
}

bool ParticipantWindow::handle_typing(int key, int scancode) {
  const std::int64_t now = settings_.clock->now_ns();
  const std::string name = on_keypad(key) ? keypad_character(key) : "";
  ignore_character_ = !name.empty();
  if (ignore_character_) keys_.add({name, now});
  const std::vector<std::string> names = key_names(key, scancode);
  const bool writes = names.empty() || names[0] == "space" || names[0].size() < 2 ||
                      static_cast<unsigned char>(names[0][0]) >= 0x80;
  if (ignore_character_ || writes) return !names.empty();
  keys_.add({names[0], now});
  return true;
}

void ParticipantWindow::handle_character(unsigned character) {
  if (page_.typing == Page::Typing::none) return;
  if (std::exchange(ignore_character_, false) || character < ' ' || character == 0x7f) return;
  keys_.add({character == ' ' ? "space" : utf8(character), settings_.clock->now_ns()});
}

void ParticipantWindow::handle_wheel(double up) {
  if (!page_.wheel || !std::isfinite(up)) return;
  wheel_ += std::clamp(up, -10.0, 10.0);
  for (; wheel_ >= 1; wheel_ -= 1) press("wheel up");
  for (; wheel_ <= -1; wheel_ += 1) press("wheel down");
}

bool ParticipantWindow::handle_key(int key, int scancode) {
  if (page_.typing != Page::Typing::none) return handle_typing(key, scancode);
  const std::int64_t now = settings_.clock->now_ns();
  const std::string name = match_key(key_names(key, scancode), page_.keys);
  if (name.empty()) return false;
  if (turn_page(name)) return true;
  // The answers are shown below the last screen. Before that the participant has not read the whole
  // question.
  const bool unread = page_.kind == Page::Kind::text && screen_ + 1 < screens_;
  if (unread && is_answer_key(key, scancode)) return true;
  keys_.add({name, now});
  return true;
}

bool ParticipantWindow::turn_page(const std::string& key) {
  if (page_.kind != Page::Kind::text) return false;
  int to = screen_;
  if (key == "space" || key == "enter" || key == "right") ++to;
  if (key == "left" || key == "backspace") --to;
  if (to == screen_ || to < 0 || to >= screens_) return false;
  screen_ = to;
  image_ = {};
  needs_redraw_ = true;
  return true;
}

void ParticipantWindow::draw() {
  if (auto page = pages_.take()) {
    if (page->kind != page_.kind || page->text != page_.text || page->part != page_.part)
      screen_ = 0;
    page_ = std::move(*page);
    needs_redraw_ = true;
    image_ = {};
  }
  int width = 0, height = 0;
  glfwGetFramebufferSize(window_, &width, &height);
  if (width <= 0 || height <= 0 || was_destroyed(window_)) return;
  if (image_.width != width || image_.height != height) {
    screens_ = screen_count(page_, width, height, ui_scale_);
    screen_ = std::min(screen_, screens_ - 1);
    image_ = draw_page(page_, width, height, {ui_scale_, screen_});
    needs_redraw_ = true;
  }
  if (needs_redraw_) paint(width, height);
}

void ParticipantWindow::paint(int width, int height) {
  glfwMakeContextCurrent(window_);
  glBindTexture(GL_TEXTURE_2D, texture_);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB8, width, height, 0, GL_BGRA, GL_UNSIGNED_BYTE,
               image_.pixels.data());
  glBindFramebuffer(GL_READ_FRAMEBUFFER, frame_);
  glFramebufferTexture2D(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture_, 0);
  // Flipped: image rows start at the top, OpenGL's at the bottom.
  glBlitFramebuffer(0, 0, width, height, 0, height, width, 0, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  glfwSwapBuffers(window_);
  needs_redraw_ = false;
}

}  // namespace palpate::runner::display
