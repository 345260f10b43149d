#pragma once

#include <memory>
#include <mutex>
#include <string>

#include "runner/display/console_view.h"
#include "runner/display/mailbox.h"
#include "runner/display/participant_window.h"

struct GLFWwindow;
struct ImGuiContext;

namespace palpate::runner::display {

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
  /// Height of the emergency button with its margin, px.
  float emergency_height() const { return view_->emergency_height(); }

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

}  // namespace palpate::runner::display
