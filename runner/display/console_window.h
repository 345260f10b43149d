#pragma once

#include <memory>

#include "runner/display/console_view.h"
#include "runner/display/mailbox.h"
#include "runner/display/participant_window.h"

struct GLFWwindow;
struct ImGuiContext;

namespace palpate::runner {

/// The experimenter's window. Made and drawn by the display's thread.
class ConsoleWindow final : public ExperimenterConsole {
 public:
  /// Keys that answer go to the participant whichever window has the keyboard, but while a note is
  /// being written; the numeric pad always does. \throws DisplayError
  ConsoleWindow(const WindowSettings& settings, const Places& places,
                ParticipantWindow& participant);
  ConsoleWindow(const ConsoleWindow&) = delete;
  ConsoleWindow& operator=(const ConsoleWindow&) = delete;
  ~ConsoleWindow() override;

  void show(const ConsoleState& state) override { states_.put(state); }
  std::vector<ConsoleCommand> commands() override { return commands_.take(); }

  std::string name_of(ConsoleCommand::Kind kind) const override;

  GLFWwindow* handle() const { return window_; }
  void draw();
  /// From a key of either window or a button. \param text  as ConsoleCommand::text
  void ask(ConsoleCommand::Kind kind, std::string text = {});
  /// As the participant's window.
  void destroy();
  void abandon() noexcept { window_ = nullptr; }

 private:
  struct Release {
    int key, scancode, mods;
  };
  static void on_key(GLFWwindow* window, int key, int scancode, int action, int mods);
  static void on_button(GLFWwindow* window, int button, int action, int mods);
  static void on_letter(GLFWwindow* window, unsigned letter);
  static void on_pointer(GLFWwindow* window, double x, double y);

  const WindowSettings& settings_;
  ParticipantWindow& participant_;
  GLFWwindow* window_ = nullptr;
  ImGuiContext* context_ = nullptr;
  std::unique_ptr<ConsoleView> view_;
  double pointer_y_ = -1;               ///< px, of the window; below 0: never there
  bool swallow_letter_ = false;         ///< the next one came from the numeric pad
  std::vector<int> fresh_keys_;         ///< went down since the last frame
  std::vector<Release> late_releases_;  ///< of these
  Mailbox<ConsoleState> states_;
  Inbox<ConsoleCommand> commands_;
};

}  // namespace palpate::runner
