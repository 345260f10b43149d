#include "runner/display/participant_page.h"

#include <algorithm>
#include <cmath>

#include "runner/display/participant_page_elements.h"

namespace palpate::runner {
namespace {

constexpr double kSmallestUnit = 14;  // px, at scale 1
constexpr double kMostKeys = 0.55;    // of the height, for the answer keys
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
    const bool goes_on = page.kind == Page::Kind::text;
    const bool typing = page.typing != Page::Typing::none;
    go_on_top_ = height - margin - 1.9 * unit_;
    keys_top_ = (goes_on ? go_on_top_ - 2 * unit_ : height - margin - 1.2 * unit_) - keys_.height();
    reply_top_ =
        (page.keys.empty() ? (goes_on ? go_on_top_ : height - unit_) : keys_top_) - 2.4 * unit_;
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
    if (page_.seconds_left > 0)
      draw_line(minutes_and_seconds(page_.seconds_left), 3 * unit_, count_top_, kQuietInk);
    if (!page_.reply.empty()) draw_line(page_.reply, 1.2 * unit_, reply_top_, kReply);
    if (page_.kind == Page::Kind::text) {
      if (!answers) draw_go_on(canvas_, width_ / 2, go_on_top_, unit_);
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
    // Not centred, like the other screens, even if the last has only two lines.
    draw_text(canvas_, all[static_cast<std::size_t>(at)], kTextSize * unit_, kSmallestSize * unit_,
              width_, text_width(width_, unit_), top_, room_, kText, false);
    if (count == 1 && page_.parts < 2) return;
    const auto of = [](int one, int total) {
      return std::to_string(one) + " / " + std::to_string(total);
    };
    std::string place = page_.parts > 1 ? of(page_.part, page_.parts) : of(at + 1, count);
    if (page_.parts > 1 && count > 1) place += "  (" + of(at + 1, count) + ")";
    const TextBlock number(canvas_, place, unit_);
    number.draw(canvas_, width_ / 2 + 6 * unit_, go_on_top_ + 0.3 * unit_, kQuietInk);
  }

  cairo_t* canvas_;
  const Page& page_;
  double width_, unit_;
  KeyMap keys_;
  double go_on_top_ = 0, keys_top_ = 0, reply_top_ = 0, count_top_ = 0, top_ = 0, room_ = 0;
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

}  // namespace palpate::runner
