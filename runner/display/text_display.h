#pragma once
// Participant's screen and experimenter's console on one terminal or on pipes, for computers
// without a display. It never names the shape, because the participant may see it.

#include <unistd.h>

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "runner/display/display.h"
#include "runner/display/mailbox.h"
#include "runner/display/terminal.h"
#include "runner/display/window.h"

namespace palpate::runner {

// Participant's screen and console as text, written by the thread of TextDisplay.

/// A text and the file descriptor that it goes to.
struct Output {
  int file = STDOUT_FILENO;
  std::string text;
};

/// Pages of the participant, written when they change.
class TextScreen final : public ParticipantScreen {
 public:
  TextScreen(EventQueue<Output>& out, WakeEvent& wake) : out_(out), wake_(wake) {}

  void show(const Page& page) override;
  std::vector<KeyPress> keys() override { return keys_.take(); }
  bool open() const override { return open_.load(); }

  void press(const KeyPress& press) { keys_.add(press); }
  void close() { open_ = false; }

 private:
  Page last_;  ///< used by the session's thread only
  EventQueue<Output>& out_;
  WakeEvent& wake_;
  EventQueue<KeyPress> keys_;
  std::atomic<bool> open_{true};
};

/// The console: writes what has changed in the state.
class TextConsole final : public ExperimenterConsole {
 public:
  TextConsole(EventQueue<Output>& out, WakeEvent& wake) : out_(out), wake_(wake) {}

  void show(const ConsoleState& state) override;
  std::vector<ConsoleCommand> commands() override { return commands_.take(); }
  std::string name_of(ConsoleCommand::Kind kind) const override;

  void add_command(const ConsoleCommand& command) { commands_.add(command); }

 private:
  EventQueue<Output>& out_;
  WakeEvent& wake_;
  EventQueue<ConsoleCommand> commands_;
  // What was shown last; used by the session's thread only:
  std::size_t messages_shown_ = 0;
  std::string state_, held_by_, instruction_;
  int trial_ = 0;
};

struct TextSettings {
  Clock* clock = nullptr;  ///< time-stamps keys and commands; required; must outlive the display
  /// Called at once, in the display's thread, when the emergency key is pressed; the command
  /// follows through commands().
  std::function<void()> emergency;
};

/// Keys from standard input, pages to standard output, messages to standard error. The end of the
/// input counts as closing the screen. run() must be called by the thread that created it; the
/// destructor restores the terminal.
std::unique_ptr<DisplayLoop> make_text_display(const TextSettings& settings);

}  // namespace palpate::runner
