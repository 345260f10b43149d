#pragma once

#include <atomic>

#include "runner/display/mailbox.h"
#include "runner/display/monitors.h"
#include "runner/display/page_layout.h"
#include "runner/display/window.h"

struct GLFWwindow;

namespace palpate::runner {

/// The participant's window. Made, drawn and fed with keys by the display's thread.
class ParticipantWindow final : public ParticipantScreen {
 public:
  /// \throws DisplayError
  ParticipantWindow(const WindowSettings& settings, const Place& place, double ui_scale);
  ParticipantWindow(const ParticipantWindow&) = delete;
  ParticipantWindow& operator=(const ParticipantWindow&) = delete;
  ~ParticipantWindow() override;

  void show(const Page& page) override { pages_.put(page); }
  std::vector<KeyPress> keys() override { return keys_.take(); }
  bool open() const override { return open_.load(); }

  GLFWwindow* handle() const { return window_; }
  /// A key went down, here or in another window; the page says what it means. False: it means
  /// nothing to the page on show.
  bool press(int key, int scancode);
  bool answers(int key, int scancode) const;
  /// Draws what has changed since the last time; does nothing otherwise.
  void draw();
  /// What is on the screen was covered: draw it again.
  void refresh() { stale_ = true; }
  void close() noexcept { open_.store(false); }
  /// Takes it off the screen; nothing may be drawn after that. May throw LostDisplay, which a
  /// destructor must not.
  void destroy();
  /// The display is gone: the destructor must not ask it for anything.
  void abandon() noexcept;

 private:
  void paint(int width, int height);
  /// Within a text that takes several screens. False: there is nothing to turn to.
  bool turn(const std::string& key);

  const WindowSettings& settings_;
  GLFWwindow* window_ = nullptr;
  unsigned texture_ = 0, frame_ = 0;
  const double ui_scale_;
  Page page_;
  int screen_ = 0, screens_ = 1;  ///< of a text
  Image image_;
  bool stale_ = true;  ///< what is on the screen is not what should be
  Mailbox<Page> pages_;
  Inbox<KeyPress> keys_;
  std::atomic<bool> open_{true};
};

}  // namespace palpate::runner
