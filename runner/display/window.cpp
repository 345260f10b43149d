#include "runner/display/window.h"

#include <epoxy/gl.h>
// After epoxy, which replaces the GL headers.
#include <GLFW/glfw3.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <optional>

#include "runner/display/console_window.h"
#include "runner/display/joystick.h"
#include "runner/display/key_names.h"
#include "runner/display/participant_window.h"
#include "runner/display/window_layout.h"
#include "runner/display/window_placing.h"
#include "runner/display/x11_errors.h"

namespace palpate::runner::display {
namespace {

constexpr double kFrame = 1.0 / 60;      // s, between frames of the console
constexpr double kJoystickPoll = 0.002;  // s: GLFW has no events for its buttons

double seconds() {
  const auto since = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double>(since).count();
}

class GlfwLibrary {
 public:
  GlfwLibrary() {
    if (glfwInit() == GLFW_FALSE) throw DisplayError("no graphical display: " + glfw_reason());
  }
  GlfwLibrary(const GlfwLibrary&) = delete;
  GlfwLibrary& operator=(const GlfwLibrary&) = delete;
  ~GlfwLibrary() {
    if (!closed_) glfwTerminate();
  }
  void close() {
    glfwTerminate();
    closed_ = true;
  }
  void abandon() { closed_ = true; }

 private:
  bool closed_ = false;
};

class Windows final : public DisplayLoop {
 public:
  explicit Windows(const WindowSettings& settings)
      : settings_(settings),
        layout_(lay_out_windows(settings_)),
        participant_(settings_, layout_.participant, layout_.participant_scale),
        console_(settings_, layout_, participant_),
        placing_(participant_.handle(), console_.handle(), layout_),
        joystick_(settings_.joystick.empty() ? nullptr : make_joystick()),
        joystick_keys_(settings_.joystick) {
    GLFWwindow* const window = participant_.handle();
    glfwSetWindowUserPointer(window, this);
    glfwSetKeyCallback(window, &Windows::on_participant_key);
    glfwSetCharCallback(window, [](GLFWwindow* from, unsigned character) {
      static_cast<Windows*>(glfwGetWindowUserPointer(from))
          ->participant_.handle_character(character);
    });
    glfwSetScrollCallback(window, [](GLFWwindow* from, double, double up) {
      static_cast<Windows*>(glfwGetWindowUserPointer(from))->participant_.handle_wheel(up);
    });
    glfwSetWindowRefreshCallback(window, [](GLFWwindow* from) {
      static_cast<Windows*>(glfwGetWindowUserPointer(from))->participant_.refresh();
    });
    flag_when_destroyed(window, window_gone_);
    flag_when_destroyed(console_.handle(), window_gone_);
    handle_display_errors();
    glfwShowWindow(console_.handle());
    glfwShowWindow(window);  // last, so that it has the keyboard focus
  }

  ParticipantScreen& participant() override { return participant_; }
  ExperimenterConsole& console() override { return console_; }

  std::string warning() const override {
    if (!layout_.shared) return {};
    std::string text =
        settings_.mouse != nullptr
            ? "one monitor: the user of the mouse sees the shape, as this device requires"
            : "one monitor: the console hides shape and scene until you show "
              "them; a second monitor keeps them out of the participant's sight";
    if (settings_.full_screen)
      text += "; --full-screen needs a second monitor: the windows stand side by side";
    return text;
  }

  std::string unreadable() const override { return missing_letters(settings_.texts); }

  void run() override {
    try {
      while (!ended_.load() && !window_gone_) {
        if (connection_lost()) throw DisplayLost();
        step();
      }
      if (window_gone_) participant_.close();
      // Not in destructors: these calls throw if the display is lost.
      console_.destroy();
      participant_.destroy();
      library_.close();
    } catch (const DisplayLost&) {
      participant_.abandon();
      console_.abandon();
      library_.abandon();
    } catch (...) {
      participant_.close();
      throw;
    }
  }

  void end() noexcept override { ended_.store(true); }

 private:
  void step() {
    const double started = seconds();
    participant_.draw();
    console_.draw();
    // After a slow frame (software rendering) wait as long as it took, to leave half of the time.
    const double drawn = seconds();
    const double next = std::max(started + kFrame, 2 * drawn - started);
    glfwPollEvents();
    placing_.step(drawn, console_.emergency_height());
    const std::optional<WindowPlaces> moved = placing_.moved_to();
    console_.put_places(moved ? to_note(*moved) : "");
    for (double now = seconds(); now < next && !ended_.load(); now = seconds()) {
      glfwWaitEventsTimeout(joystick_ ? std::min(next - now, kJoystickPoll) : next - now);
      poll_joystick();
    }
    if (glfwWindowShouldClose(participant_.handle()) != 0) participant_.close();
    if (glfwWindowShouldClose(console_.handle()) != 0) {
      glfwSetWindowShouldClose(console_.handle(), GLFW_FALSE);
      console_.send_command(ConsoleCommand::Kind::quit);
    }
  }

  void poll_joystick() {
    if (!joystick_) return;
    for (const std::string& key : joystick_keys_.pressed(joystick_->read())) {
      if (key == "escape") {
        console_.send_command(ConsoleCommand::Kind::emergency_zero, "the joystick");
      } else {
        participant_.press(key);
      }
    }
  }

  static void on_participant_key(GLFWwindow* window, int key, int scancode, int action, int) {
    auto& self = *static_cast<Windows*>(glfwGetWindowUserPointer(window));
    // Let Backspace repeat while held down.
    if (action == GLFW_REPEAT && key == GLFW_KEY_BACKSPACE && self.participant_.typing())
      self.participant_.handle_key(key, scancode);
    if (action != GLFW_PRESS) return;
    const bool answer = self.participant_.is_answer_key(key, scancode);
    if (key == GLFW_KEY_F12 || (key == GLFW_KEY_ESCAPE && !answer)) {
      self.console_.send_command(ConsoleCommand::Kind::emergency_zero, emergency_key_name(key));
    }
    self.participant_.handle_key(key, scancode);
  }

  const WindowSettings settings_;
  bool window_gone_ = false;  ///< must outlive the library
  GlfwLibrary library_;
  const WindowLayout layout_;
  ParticipantWindow participant_;
  ConsoleWindow console_;
  WindowPlacing placing_;
  std::unique_ptr<Joystick> joystick_;  ///< null: the protocol maps none
  JoystickKeys joystick_keys_;
  std::atomic<bool> ended_{false};
};

}  // namespace

std::unique_ptr<DisplayLoop> make_windows(const WindowSettings& settings) {
  return std::make_unique<Windows>(settings);
}

}  // namespace palpate::runner::display
