#include "runner/display/participant_page_elements.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace palpate::runner {
namespace {

constexpr double kKeycapHeight = 2.3, kRowHeight = 5.2;  // units

void draw_keycap(cairo_t* canvas, double x, double y, double width, double height) {
  const double radius = 0.18 * height;
  cairo_new_path(canvas);
  cairo_arc(canvas, x + width - radius, y + radius, radius, -M_PI / 2, 0);
  cairo_arc(canvas, x + width - radius, y + height - radius, radius, 0, M_PI / 2);
  cairo_arc(canvas, x + radius, y + height - radius, radius, M_PI / 2, M_PI);
  cairo_arc(canvas, x + radius, y + radius, radius, M_PI, 3 * M_PI / 2);
  cairo_close_path(canvas);
  set_colour(canvas, kKeycap);
  cairo_fill_preserve(canvas);
  set_colour(canvas, kKeycapEdge);
  cairo_set_line_width(canvas, std::max(1.0, 0.035 * height));
  cairo_stroke(canvas);
}

/// What cairo reads a PNG file from.
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

KeyMap::KeyMap(cairo_t* canvas, const Page& page, double unit, double width) : unit_(unit) {
  double right = 0;
  items_.reserve(page.keys.size());
  for (const auto& [key, answer] : page.keys) {
    Item item{TextBlock(canvas, keycap_label(key), 1.15 * unit),
              TextBlock(canvas, answer, unit),
              0,
              0,
              0,
              0};
    item.answer.cut_at_width(std::min(item.answer.size().width + 2, 12 * unit));
    item.cap_width = std::max(kKeycapHeight * unit, item.key.size().width + 1.2 * unit);
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

double KeyMap::height() const {
  return items_.empty() ? 0 : (static_cast<double>(rows_.size()) * kRowHeight - 0.8) * unit_;
}

void KeyMap::draw(cairo_t* canvas, double middle, double top) const {
  for (const Item& item : items_) {
    const double centre = middle - rows_[item.row] / 2 + item.x + item.width / 2;
    const double y = top + static_cast<double>(item.row) * kRowHeight * unit_;
    draw_keycap(canvas, std::round(centre - item.cap_width / 2), std::round(y),
                std::round(item.cap_width), std::round(kKeycapHeight * unit_));
    const Size key = item.key.size(), answer = item.answer.size();
    item.key.draw(canvas, centre - key.width / 2, y + (kKeycapHeight * unit_ - key.height) / 2,
                  kText);
    item.answer.draw(canvas, centre - answer.width / 2, y + (kKeycapHeight + 0.45) * unit_,
                     kQuietInk);
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
  // The end is what is being typed.
  std::string shown = typed;
  while (words.size().width > width - unit && shown.size() > 1) {
    shown.erase(0, 1);
    while (!shown.empty() && (static_cast<unsigned char>(shown[0]) & 0xC0U) == 0x80U)
      shown.erase(0, 1);
    words = TextBlock(canvas, "\u2026" + shown + "_", 1.6 * unit);
  }
  const double field = std::max(words.size().width + unit, std::min(10 * unit, width));
  draw_keycap(canvas, std::round(middle - field / 2), std::round(top), std::round(field),
              std::round(2.9 * unit));
  words.draw(canvas, middle - words.size().width / 2, top + (2.9 * unit - words.size().height) / 2,
             kText);
}

void draw_go_on(cairo_t* canvas, double middle, double top, double unit) {
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

}  // namespace palpate::runner
