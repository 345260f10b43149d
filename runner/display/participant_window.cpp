#include "runner/display/participant_window.h"

#include <epoxy/gl.h>

#include "data/base/text.h"
// After epoxy, which replaces the GL headers.
#include <GLFW/glfw3.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "runner/display/key_names.h"
#include "runner/display/x11_errors.h"

namespace palpate::runner {

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
  // The answers are shown below the last screen: until then nobody has read what they are about.
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

}  // namespace palpate::runner
