#include "runner/display/page_elements.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "data/base/utf8.h"
#include "runner/display/key_names.h"

namespace palpate::runner::display {
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
                  double width, double room, double most) {
  PngBytes source{bytes};
  const std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)> picture(
      cairo_image_surface_create_from_png_stream(&read_png, &source), &cairo_surface_destroy);
  if (cairo_surface_status(picture.get()) != CAIRO_STATUS_SUCCESS) {
    TextBlock(canvas, "(PNG?)", room / 8).draw(canvas, middle - room / 6, top, kReply);
    return;
  }
  const double wide = cairo_image_surface_get_width(picture.get());
  const double high = cairo_image_surface_get_height(picture.get());
  const double scale = std::min({width / wide, room / high, most});
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

void draw_reach(cairo_t* canvas, const ReachPicture& reach, bool target, double middle, double top,
                double room) {
  if (!(room > 0) || !(reach.extent > 0)) return;
  constexpr double kTipShare = 0.012;  // of the room
  const double scale = 0.5 * room / reach.extent, middle_up = top + room / 2;
  const auto circle = [&](const Vec3& place, double radius) {
    const Vec3 from_home = place - reach.home;
    cairo_new_sub_path(canvas);
    cairo_arc(canvas, middle + scale * from_home.x, middle_up - scale * from_home[reach.up], radius,
              0, 2 * std::numbers::pi);
  };
  set_colour(canvas, kQuietInk);
  cairo_set_line_width(canvas, std::max(1.0, 0.004 * room));
  circle(reach.home, scale * reach.home_radius);
  cairo_stroke(canvas);
  if (target) {
    set_colour(canvas, kGo);
    circle(reach.target, scale * reach.target_radius);
    cairo_fill(canvas);
  }
  set_colour(canvas, kText);
  circle(reach.tip, std::max(2.0, kTipShare * room));
  cairo_fill(canvas);
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

}  // namespace palpate::runner::display
