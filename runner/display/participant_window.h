#pragma once
// The participant's screen as a window.

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "runner/display/display.h"
#include "runner/display/mailbox.h"
#include "runner/display/seen.h"
#include "runner/display/window.h"
#include "runner/display/window_layout.h"

namespace palpate::runner::display {

struct Image {
  int width = 0, height = 0;
  /// 0xffRRGGBB, rows from the top; over a scene with alpha, premultiplied.
  std::vector<std::uint32_t> pixels;
};

/// A picture file behind a page's words. px, of the rectangle in which it is as large as fits.
struct PictureBehind {
  std::shared_ptr<const std::string> bytes{};  ///< PNG; null: none
  double left = 0, top = 0, width = 0, height = 0;
  bool operator==(const PictureBehind&) const = default;
};

struct PageOptions {
  double ui_scale = 1;      ///< text is at least as large as a desktop's with this scale
  int screen = 0;           ///< screen of a long text, from 0
  bool over_scene = false;  ///< what is behind it shows through, between words and keys
  PictureBehind picture{};
};

/// Draws a page of the participant's screen into an image, without a display. Pango sets the text:
/// it finds a font for every character and handles right-to-left and joined scripts. Deterministic.
/// Invalid UTF-8 is shown as a replacement character. A long text to read continues on further
/// screens; other texts are set smaller and, at the smallest readable size, end in an ellipsis.
Image draw_page(const Page& page, int width, int height, const PageOptions& setting = {});

/// Number of screens that a page takes.
int screen_count(const Page& page, int width, int height, double ui_scale = 1);

/// The background colour of pages, 0xffRRGGBB.
std::uint32_t ground_colour();

}  // namespace palpate::runner::display

struct GLFWwindow;

namespace palpate::runner::display {

class SeenPainter;

/// The participant's window. Created, drawn and given its keys by the display's thread.
class ParticipantWindow final : public ParticipantScreen {
 public:
  /// \throws DisplayError
  ParticipantWindow(const WindowSettings& settings, const WindowGeometry& geometry,
                    double ui_scale);
  ParticipantWindow(const ParticipantWindow&) = delete;
  ParticipantWindow& operator=(const ParticipantWindow&) = delete;
  ~ParticipantWindow() override;

  void show(const Page& page) override { pages_.put(page); }
  void see(const std::shared_ptr<const SeenTrial>& trial) override;
  void follow(const servo::Sample& sample) override;
  std::vector<SeenFrame> frames() override { return frames_.take(); }
  std::vector<KeyPress> keys() override { return keys_.take(); }
  bool open() const override { return open_.load(); }
  bool settled() const override { return settled_.load(); }
  std::string misplaced() const override;
  /// Sets the results of settled() and misplaced(). Called by the display's thread.
  void put_place(bool settled, const std::string& misplaced);

  GLFWwindow* handle() const { return window_; }
  /// A key was pressed, here or in the console. \return false: the key has no name
  bool handle_key(int key, int scancode);
  bool is_answer_key(int key, int scancode) const;
  bool typing() const { return page_.typing != Page::Typing::none; }
  /// A character of a typed answer was entered, here or in the console.
  void handle_character(unsigned character);
  /// The wheel was turned. \param up  notches, negative: down
  void handle_wheel(double up);
  /// Adds a key by its name that was pressed on a gamepad or pedal.
  void press(const std::string& key) { keys_.add({key, settings_.clock->now_ns()}); }
  /// Redraws if anything has changed since the last call.
  void draw();
  /// Makes the next draw() repaint a window that was uncovered.
  void refresh() { needs_redraw_ = true; }
  void close() noexcept { open_.store(false); }
  /// Destroys the window; do not draw afterwards. Unlike the destructor it may throw DisplayLost.
  void destroy();
  /// The display is lost: the destructor must not use it.
  void abandon() noexcept;

 private:
  void paint(int width, int height);
  void paint_seen(int width, int height, bool changed);
  PictureBehind picture_behind(const SeenPainter& painter, std::int64_t now, int width,
                               int height) const;
  void begin_seeing(std::shared_ptr<const SeenTrial> trial);
  /// Turns to another screen of a long text. \return false: the key does not turn, or there is no
  /// such screen.
  bool turn_page(const std::string& key);
  /// Handles keys that write no character, and the numeric pad, while an answer is typed.
  bool handle_typing(int key, int scancode);

  const WindowSettings& settings_;
  GLFWwindow* window_ = nullptr;
  unsigned texture_ = 0, frame_ = 0;
  const double ui_scale_;
  Page page_;
  int screen_ = 0, screens_ = 1;  ///< current screen of a text, and their count
  Image image_;
  bool needs_redraw_ = true;  ///< the window does not show image_
  Mailbox<Page> pages_;
  Mailbox<std::shared_ptr<const SeenTrial>> to_see_;
  std::optional<SeenMoment> last_moment_;  ///< of the session's thread
  SeenTrail trail_;
  std::unique_ptr<SeenPainter> painter_;  ///< once anything is seen
  std::optional<SeenScene> scene_;        ///< none: nothing is seen
  PictureBehind behind_;                  ///< as drawn last
  EventQueue<SeenFrame> frames_;
  EventQueue<KeyPress> keys_;
  bool ignore_character_ = false;  ///< skip the next one: its key was handled already
  double wheel_ = 0;               ///< fraction of a notch, carried over
  std::atomic<bool> open_{true}, settled_{false};
  mutable std::mutex place_mutex_;
  std::string misplaced_;
};

}  // namespace palpate::runner::display
