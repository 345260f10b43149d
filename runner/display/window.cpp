#include "runner/display/window.h"

#include <epoxy/gl.h>
// After epoxy, which replaces the GL headers.
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "data/base/text.h"
#include "runner/display/console_view.h"
#include "runner/display/console_words.h"
#include "runner/display/fonts.h"
#include "runner/display/joystick.h"
#include "runner/display/key_names.h"
#include "runner/display/mailbox.h"
#include "runner/display/monitors.h"
#include "runner/display/participant_window.h"
#include "runner/display/window_layout.h"
#include "runner/display/x11_errors.h"

namespace palpate::runner::display {
namespace {

/// The experimenter's window. Made and drawn by the display's thread.
class ConsoleWindow final : public ExperimenterConsole {
 public:
  /// Answer keys go to the participant's screen whichever window has the keyboard focus, except
  /// while a note is being typed; those of the numeric pad always do. \throws DisplayError
  ConsoleWindow(const WindowSettings& settings, const WindowLayout& layout,
                ParticipantWindow& participant);
  ConsoleWindow(const ConsoleWindow&) = delete;
  ConsoleWindow& operator=(const ConsoleWindow&) = delete;
  ~ConsoleWindow() override;

  void show(const ConsoleState& state) override { states_.put(state); }
  std::vector<ConsoleCommand> commands() override { return commands_.take(); }

  std::string name_of(ConsoleCommand::Kind kind) const override;
  std::string places() const override;
  /// Sets the result of places(). Called by the display's thread.
  void put_places(std::string note);
  /// One monitor shows both windows, or no longer does.
  void share(bool shared) { view_->share(shared); }
  /// Height of the emergency button with its margin, px.
  float emergency_height() const { return view_->emergency_height(); }
  /// Asks the experimenter whether to end the session.
  void ask_to_end() { view_->ask_to_end(); }
  bool asks_to_end() const { return view_->asks_to_end(); }

  GLFWwindow* handle() const { return window_; }
  void draw();
  /// Queues a command from a key of either window or a button. \param text  ConsoleCommand::text
  void send_command(ConsoleCommand::Kind kind, std::string text = {});
  /// As in ParticipantWindow.
  void destroy();
  void abandon() noexcept { window_ = nullptr; }

 private:
  struct Release {
    int key, scancode, mods;
  };
  static void on_key(GLFWwindow* window, int key, int scancode, int action, int mods);
  static void on_button(GLFWwindow* window, int button, int action, int mods);
  static void on_character(GLFWwindow* window, unsigned character);
  static void on_pointer(GLFWwindow* window, double x, double y);

  const WindowSettings& settings_;
  ParticipantWindow& participant_;
  GLFWwindow* window_ = nullptr;
  ImGuiContext* context_ = nullptr;
  std::unique_ptr<ConsoleView> view_;
  double pointer_y_ = -1;          ///< px, in the window; negative: not in it yet
  bool ignore_character_ = false;  ///< the next character is an answer typed on the numeric pad
  std::vector<int> fresh_keys_;    ///< pressed since the last frame
  std::vector<Release> late_releases_;  ///< of fresh_keys_, passed on after the frame
  Mailbox<ConsoleState> states_;
  EventQueue<ConsoleCommand> commands_;
  mutable std::mutex places_mutex_;
  std::string places_;
};

ConsoleWindow::ConsoleWindow(const WindowSettings& settings, const WindowLayout& layout,
                             ParticipantWindow& participant)
    : settings_(settings),
      participant_(participant),
      window_(make_window(settings.title + " - console", layout.console)) {
  context_ = begin_imgui(window_, settings.texts, static_cast<float>(layout.console_scale));
  glfwSetWindowUserPointer(window_, this);
  glfwSetKeyCallback(window_, &ConsoleWindow::on_key);
  glfwSetCharCallback(window_, &ConsoleWindow::on_character);
  glfwSetCursorPosCallback(window_, &ConsoleWindow::on_pointer);
  glfwSetMouseButtonCallback(window_, &ConsoleWindow::on_button);
  view_ = std::make_unique<ConsoleView>(settings, layout.shared);
}

ConsoleWindow::~ConsoleWindow() {
  if (window_ == nullptr) {
    // Without a display OpenGL and GLFW must not be called: leak what they hold.
    static_cast<void>(view_.release());
    return;
  }
  destroy();
}

void ConsoleWindow::destroy() {
  glfwMakeContextCurrent(window_);
  view_.reset();
  end_imgui(context_);
  glfwDestroyWindow(window_);
  window_ = nullptr;
}

std::string ConsoleWindow::name_of(ConsoleCommand::Kind kind) const {
  return "'" + std::string(button_label(kind)) + "'";
}

std::string ConsoleWindow::places() const {
  const std::lock_guard lock(places_mutex_);
  return places_;
}

void ConsoleWindow::put_places(std::string note) {
  const std::lock_guard lock(places_mutex_);
  places_ = std::move(note);
}

void ConsoleWindow::send_command(ConsoleCommand::Kind kind, std::string text) {
  const std::int64_t now = settings_.clock->now_ns();
  if (kind == ConsoleCommand::Kind::emergency_zero && settings_.emergency) settings_.emergency();
  commands_.add({kind, std::move(text), now});
}

void ConsoleWindow::on_key(GLFWwindow* window, int key, int scancode, int action, int mods) {
  auto& self = *static_cast<ConsoleWindow*>(glfwGetWindowUserPointer(window));
  const bool typing = ImGui::GetIO().WantTextInput;
  const bool answer = on_keypad(key) && self.participant_.is_answer_key(key, scancode);
  self.ignore_character_ = answer;
  if (action == GLFW_PRESS) {
    if (key == GLFW_KEY_F12 || key == GLFW_KEY_ESCAPE) {
      self.send_command(ConsoleCommand::Kind::emergency_zero, emergency_key_name(key));
    } else if (answer || !typing) {
      self.participant_.handle_key(key, scancode);
    }
  }
  if (answer) return;
  // Dear ImGui samples keys once a frame: a key pressed and released between two frames is released
  // after the next one.
  if (action == GLFW_PRESS) self.fresh_keys_.push_back(key);
  if (action == GLFW_RELEASE &&
      std::count(self.fresh_keys_.begin(), self.fresh_keys_.end(), key) > 0) {
    self.late_releases_.push_back({key, scancode, mods});
  } else {
    ImGui_ImplGlfw_KeyCallback(window, key, scancode, action, mods);
  }
}

void ConsoleWindow::on_character(GLFWwindow* window, unsigned character) {
  auto& self = *static_cast<ConsoleWindow*>(glfwGetWindowUserPointer(window));
  if (!ImGui::GetIO().WantTextInput) self.participant_.handle_character(character);
  if (!self.ignore_character_) ImGui_ImplGlfw_CharCallback(window, character);
}

void ConsoleWindow::on_pointer(GLFWwindow* window, double, double y) {
  auto& self = *static_cast<ConsoleWindow*>(glfwGetWindowUserPointer(window));
  self.pointer_y_ = y;
  self.view_->highlight_emergency(self.view_->in_emergency_button(static_cast<float>(y)));
}

void ConsoleWindow::on_button(GLFWwindow* window, int button, int action, int mods) {
  auto& self = *static_cast<ConsoleWindow*>(glfwGetWindowUserPointer(window));
  // In the event callback, not in a frame of Dear ImGui, where a drag or an input field could hold
  // the pointer and a slow frame would delay it.
  if (action == GLFW_PRESS &&
      self.view_->in_emergency_button(static_cast<float>(self.pointer_y_))) {
    self.send_command(ConsoleCommand::Kind::emergency_zero, "the EMERGENCY button");
    return;
  }
  // Without a window manager nothing else moves the keyboard focus on a click.
  if (action == GLFW_PRESS && glfwGetWindowAttrib(window, GLFW_FOCUSED) == GLFW_FALSE) {
    glfwFocusWindow(window);
  }
  ImGui_ImplGlfw_MouseButtonCallback(window, button, action, mods);
}

void ConsoleWindow::draw() {
  const double now = static_cast<double>(settings_.clock->now_ns()) * 1e-9;
  if (auto state = states_.take()) view_->update(std::move(*state), now);
  int width = 0, height = 0;
  glfwGetFramebufferSize(window_, &width, &height);
  if (width <= 0 || height <= 0 || was_destroyed(window_)) return;
  glfwMakeContextCurrent(window_);
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
  const auto held = [&](int left, int right) {
    for (GLFWwindow* const window : {window_, participant_.handle()}) {
      if (glfwGetKey(window, left) == GLFW_PRESS || glfwGetKey(window, right) == GLFW_PRESS) {
        return true;
      }
    }
    return false;
  };
  const Modifiers modifiers{held(GLFW_KEY_LEFT_CONTROL, GLFW_KEY_RIGHT_CONTROL),
                            held(GLFW_KEY_LEFT_SHIFT, GLFW_KEY_RIGHT_SHIFT)};
  for (ConsoleCommand& command : view_->draw(now, modifiers)) {
    send_command(command.kind, std::move(command.text));
  }
  fresh_keys_.clear();
  for (const Release& up : late_releases_) {
    ImGui_ImplGlfw_KeyCallback(window_, up.key, up.scancode, GLFW_RELEASE, up.mods);
  }
  late_releases_.clear();
  ImGui::Render();
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  glViewport(0, 0, width, height);
  glClearColor(0, 0, 0, 1);
  glClear(GL_COLOR_BUFFER_BIT);
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
  glfwSwapBuffers(window_);
}

constexpr double kFrame = 1.0 / 60;      // s, between frames of the console
constexpr double kJoystickPoll = 0.002;  // s: GLFW has no events for its buttons

double seconds() {
  const auto since = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double>(since).count();
}

class GlfwLibrary {
 public:
  GlfwLibrary() {
    if (!start_glfw()) throw DisplayError("no graphical display: " + glfw_reason());
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
        placing_(participant_.handle(), console_.handle(), settings_, layout_),
        lit_(layout_.participant.full_screen),
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
      lit_.end();
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
    report_place();
    const std::optional<WindowPlaces> moved = placing_.moved_to();
    console_.put_places(moved ? to_note(*moved) : "");
    for (double now = seconds(); now < next && !ended_.load(); now = seconds()) {
      glfwWaitEventsTimeout(joystick_ ? std::min(next - now, kJoystickPoll) : next - now);
      poll_joystick();
    }
    ask_before_closing();
  }

  /// The console asks, where nothing covers the emergency button. Closing a window again while it
  /// asks ends the session.
  void ask_before_closing() {
    const bool participant = glfwWindowShouldClose(participant_.handle()) != 0;
    const bool console = glfwWindowShouldClose(console_.handle()) != 0;
    if (!participant && !console) return;
    if (!console_.asks_to_end()) {
      for (GLFWwindow* const window : {participant_.handle(), console_.handle()})
        glfwSetWindowShouldClose(window, GLFW_FALSE);
      console_.ask_to_end();
      glfwRequestWindowAttention(console_.handle());
      return;
    }
    if (participant) participant_.close();
    if (console) {
      glfwSetWindowShouldClose(console_.handle(), GLFW_FALSE);
      console_.send_command(ConsoleCommand::Kind::quit);
    }
  }

  void report_place() {
    console_.share(placing_.shared());
    participant_.put_place(placing_.settled(), placing_.misplaced());
    if (placing_.misplaced() == reported_) return;
    reported_ = placing_.misplaced();
    if (!reported_.empty()) std::fprintf(stderr, "%s\n", printable_lines(reported_).c_str());
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
  std::string reported_;  ///< WindowPlacing::misplaced()
  LitScreens lit_;
  std::unique_ptr<Joystick> joystick_;  ///< null: the protocol maps none
  JoystickKeys joystick_keys_;
  std::atomic<bool> ended_{false};
};

}  // namespace

std::unique_ptr<DisplayLoop> make_windows(const WindowSettings& settings) {
  return std::make_unique<Windows>(settings);
}

}  // namespace palpate::runner::display
