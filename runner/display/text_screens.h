#pragma once
// Participant's screen and console as text, written by the thread of TextDisplay.

#include <unistd.h>

#include <atomic>
#include <string>
#include <vector>

#include "runner/display/display.h"
#include "runner/display/mailbox.h"
#include "runner/display/terminal.h"

namespace palpate::runner {

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

}  // namespace palpate::runner
