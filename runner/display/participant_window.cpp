#include "runner/display/participant_window.h"

#include <epoxy/gl.h>

// After epoxy, which replaces the GL headers.
#include <GLFW/glfw3.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "data/base/utf8.h"
#include "runner/display/display.h"
#include "runner/display/key_names.h"
#include "runner/display/page_elements.h"
#include "runner/display/seen_painter.h"
#include "runner/display/text_block.h"
#include "runner/display/window.h"
#include "runner/display/x11_errors.h"

namespace palpate::runner::display {
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
  PageLayout(cairo_t* canvas, const Page& page, double width, double height,
             const PageOptions& options)
      : canvas_(canvas),
        page_(page),
        width_(width),
        over_scene_(options.over_scene),
        unit_(std::max({2.0, std::min(height / 34, width / 46),
                        std::min({kSmallestUnit * options.ui_scale, height / 16, width / 20})})),
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
    if (!over_scene_) return draw_content(screen);
    cairo_push_group(canvas_);
    draw_content(screen);
    const std::unique_ptr<cairo_pattern_t, decltype(&cairo_pattern_destroy)> content(
        cairo_pop_group(canvas_), &cairo_pattern_destroy);
    draw_halo(content.get());
    cairo_set_source(canvas_, content.get());
    cairo_paint(canvas_);
  }

 private:
  static constexpr double kWordsAbove = 0.15;  // share of the room

  void draw_content(int screen) const {
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
      const bool above = page_.reach || over_scene_;  // the words stand above a picture
      const double words = above ? kWordsAbove * room_ : room_;
      if (page_.reach)
        draw_reach(canvas_, *page_.reach, page_.go, width_ / 2, top_ + words, room_ - words);
      const bool large = page_.kind != Page::Kind::message;
      const double letters = page_.kind == Page::Kind::feedback && !above ? 8 : large ? 2.6 : 1.8;
      draw_text(canvas_, page_.text, letters * unit_, kSmallestSize * unit_, width_,
                text_width(width_, unit_), top_, words, page_.go ? kGo : kText, large);
    }
  }

  /// Words and keys are read on any scene, and hide no more of it than they need.
  void draw_halo(cairo_pattern_t* content) const {
    constexpr int kDirections = 16;
    const double reach = 0.25 * unit_;
    for (int i = 0; i < kDirections; ++i) {
      const double angle = 2 * std::numbers::pi * i / kDirections;
      for (const double part : {0.5, 1.0}) {
        cairo_save(canvas_);
        cairo_translate(canvas_, part * reach * std::cos(angle), part * reach * std::sin(angle));
        cairo_set_source_rgba(canvas_, kGround.red, kGround.green, kGround.blue, 0.3);
        cairo_mask(canvas_, content);
        cairo_restore(canvas_);
      }
    }
  }

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
  double width_;
  bool over_scene_;
  double unit_;
  KeyMap keys_;
  double continue_top_ = 0, keys_top_ = 0, reply_top_ = 0, count_top_ = 0, top_ = 0, room_ = 0;
  double typed_top_ = 0, picture_ = 0, picture_top_ = 0;
};

}  // namespace

Image draw_page(const Page& page, int width, int height, const PageOptions& setting) {
  Image image{std::max(width, 1), std::max(height, 1), {}};
  image.pixels.resize(static_cast<std::size_t>(image.width) * image.height);
  const std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)> surface(
      cairo_image_surface_create_for_data(
          reinterpret_cast<unsigned char*>(image.pixels.data()),
          setting.over_scene ? CAIRO_FORMAT_ARGB32 : CAIRO_FORMAT_RGB24, image.width, image.height,
          4 * image.width),
      &cairo_surface_destroy);
  const Canvas owned(cairo_create(surface.get()), &cairo_destroy);
  if (!setting.over_scene) {
    set_colour(owned.get(), kGround);
    cairo_paint(owned.get());
  }
  if (const PictureBehind& behind = setting.picture; behind.bytes)
    draw_picture(owned.get(), *behind.bytes, behind.left + behind.width / 2, behind.top,
                 behind.width, behind.height, std::numeric_limits<double>::infinity());
  PageLayout(owned.get(), page, image.width, image.height, setting).draw(setting.screen);
  cairo_surface_flush(surface.get());
  if (setting.over_scene) return image;
  for (std::uint32_t& pixel : image.pixels) pixel |= 0xff000000U;
  return image;
}

int screen_count(const Page& page, int width, int height, double ui_scale) {
  if (page.kind != Page::Kind::text) return 1;
  const std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)> surface(
      cairo_image_surface_create(CAIRO_FORMAT_RGB24, 1, 1), &cairo_surface_destroy);
  const Canvas owned(cairo_create(surface.get()), &cairo_destroy);
  const PageLayout frame(owned.get(), page, std::max(width, 1), std::max(height, 1), {ui_scale});
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
    : settings_(settings),
      window_(make_window(settings.title, geometry, settings.quad_buffer)),
      ui_scale_(ui_scale) {
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
  glfwMakeContextCurrent(window_);
  painter_.reset();
  glfwDestroyWindow(window_);
  window_ = nullptr;
}

void ParticipantWindow::abandon() noexcept {
  // Without a display OpenGL must not be called: leak what it holds.
  static_cast<void>(painter_.release());
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

void ParticipantWindow::see(const std::shared_ptr<const SeenTrial>& trial) {
  last_moment_.reset();
  trail_.clear();
  to_see_.put(trial);
}

void ParticipantWindow::follow(const servo::Sample& sample) {
  last_moment_ = moment_of(sample, last_moment_ ? &*last_moment_ : nullptr);
  trail_.add(*last_moment_);
}

void ParticipantWindow::begin_seeing(std::shared_ptr<const SeenTrial> trial) {
  scene_.reset();
  if (trial == nullptr) return;
  glfwMakeContextCurrent(window_);
  if (painter_ == nullptr) painter_ = std::make_unique<SeenPainter>();
  scene_.emplace(std::move(trial));
}

void ParticipantWindow::draw() {
  bool changed = false;
  if (auto page = pages_.take()) {
    if (page->kind != page_.kind || page->text != page_.text || page->part != page_.part)
      screen_ = 0;
    page_ = std::move(*page);
    changed = true;
  }
  int width = 0, height = 0;
  glfwGetFramebufferSize(window_, &width, &height);
  if (width <= 0 || height <= 0 || was_destroyed(window_)) return;
  if (auto trial = to_see_.take()) {
    begin_seeing(std::move(*trial));
    changed = true;
  }
  if (changed) image_ = {};
  if (image_.width != width || image_.height != height) {
    screens_ = screen_count(page_, width, height, ui_scale_);
    screen_ = std::min(screen_, screens_ - 1);
    behind_ = {};
    image_ = draw_page(page_, width, height, {ui_scale_, screen_, scene_.has_value()});
    changed = needs_redraw_ = true;
  }
  if (scene_) {
    paint_seen(width, height, changed);
  } else if (needs_redraw_) {
    paint(width, height);
  }
}

PictureBehind ParticipantWindow::picture_behind(const SeenPainter& painter, std::int64_t now,
                                                int width, int height) const {
  const SeenTrial& trial = scene_->trial();
  const SeenScene::Place place = scene_->picture_place(now);
  const SeenPainter::Part part = painter.screen_part(trial.view, width, height);
  const double wide = double{part.right - part.left} * width,
               high = double{part.above - part.below} * height;
  PictureBehind out;
  out.bytes = trial.seen.file_bytes;
  out.width = 2 * place.half_width * wide;
  out.height = 2 * place.half_height * high;
  out.left = double{part.left} * width + place.x * wide - out.width / 2;
  out.top = (1.0 - part.above) * height + place.y * high - out.height / 2;
  return out;
}

/// Draws the pose of `delay_s` ago, as at the time of the frame.
void ParticipantWindow::paint_seen(int width, int height, bool changed) {
  glfwMakeContextCurrent(window_);
  const std::int64_t now = settings_.clock->now_ns();
  const auto delay = static_cast<std::int64_t>(std::llround(1e9 * scene_->trial().seen.delay));
  const std::optional<SeenMoment> newest = trail_.newest();
  const std::optional<SeenMoment> moment = trail_.at(now - delay);
  SeenPainter::Frame frame{&*scene_, nullptr, now, newest && newest->forces};
  if (moment && newest && is_visible(scene_->trial().seen, *newest)) frame.moment = &*moment;
  PictureBehind behind;
  if (frame.moment != nullptr && scene_->trial().seen.picture)
    behind = picture_behind(*painter_, now, width, height);
  if (behind != behind_) {
    behind_ = behind;
    image_ = draw_page(page_, width, height, {ui_scale_, screen_, true, behind_});
    changed = true;
  }
  painter_->paint(frame, image_, changed, width, height);
  glfwSwapBuffers(window_);
  glFinish();
  needs_redraw_ = false;
  if (frame.moment != nullptr) frames_.add({settings_.clock->now_ns(), moment->time_ns, delay});
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
