#pragma once
// Participant's screen and experimenter's console on one terminal or on pipes, for computers
// without a display. It never names the shape, because the participant may see it.

#include <sys/eventfd.h>
#include <termios.h>
#include <unistd.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "runner/display/display.h"
#include "runner/display/mailbox.h"
#include "runner/display/window.h"

namespace palpate::runner::display {

/// Puts the terminal into character mode without echo; Ctrl-C still sends a signal.
class RawTerminal {
 public:
  RawTerminal() : on_(isatty(STDIN_FILENO) == 1 && tcgetattr(STDIN_FILENO, &before_) == 0) {
    if (!on_) return;
    termios raw = before_;
    raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
    raw.c_cc[VMIN] = 1;
    raw.c_cc[VTIME] = 0;
    tcsetattr(STDIN_FILENO, TCSANOW, &raw);
  }
  RawTerminal(const RawTerminal&) = delete;
  RawTerminal& operator=(const RawTerminal&) = delete;
  ~RawTerminal() {
    if (on_) tcsetattr(STDIN_FILENO, TCSANOW, &before_);
  }
  bool on() const { return on_; }

 private:
  termios before_{};
  bool on_;
};

/// Wakes a thread that waits in poll().
class WakeEvent {
 public:
  WakeEvent() : file_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {}
  WakeEvent(const WakeEvent&) = delete;
  WakeEvent& operator=(const WakeEvent&) = delete;
  ~WakeEvent() { close(file_); }
  void signal() noexcept {
    const std::uint64_t one = 1;
    // Fails only when the counter overflows; it is set then anyway.
    [[maybe_unused]] const ssize_t written = write(file_, &one, sizeof one);
  }
  void clear() noexcept {
    std::uint64_t count = 0;
    [[maybe_unused]] const ssize_t got = read(file_, &count, sizeof count);
  }
  int file() const { return file_; }

 private:
  int file_;
};

/// Breaks lines that are longer than the terminal's width, between words.
/// \param columns  width of the terminal; 0: unknown, no line is broken
std::string wrapped(const std::string& text, std::size_t columns);

/// Width of the terminal at a file descriptor; 0: not a terminal, or its width is unknown.
std::size_t columns_of(int file);

/// Parses terminal input: single keys are answers, a line that begins with ':' is a command, Escape
/// and F12 are emergency keys, and so is Alt with any key.
class TextInput {
 public:
  struct Unknown {
    std::string line;
  };
  using Event = std::variant<KeyPress, ConsoleCommand, Unknown>;

  /// \param bytes  bytes that arrived together at `time_ns`
  std::vector<Event> feed(std::string_view bytes, std::int64_t time_ns);
  /// The command line being typed, with its colon; empty: none.
  const std::string& line() const { return line_; }

 private:
  std::size_t escape(std::string_view rest, std::int64_t time_ns, std::vector<Event>& out);
  void letter(const std::string& text, std::int64_t time_ns, std::vector<Event>& out);
  void end_line(std::int64_t time_ns, std::vector<Event>& out);

  std::string line_;
  std::string partial_;  ///< an incomplete UTF-8 sequence
};

/// A text, written by the thread of TextDisplay, and the file descriptor to write it to.
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

/// The console: writes the changes of the state.
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
  // Shown last; used by the session's thread only:
  std::size_t messages_shown_ = 0;
  std::string state_, held_by_, instruction_;
  int trial_ = 0;
};

struct TextSettings {
  servo::Clock* clock =
      nullptr;  ///< time-stamps keys and commands; required; must outlive the display
  /// Called at once, in the display's thread, when the emergency key is pressed; the command
  /// follows through commands().
  std::function<void()> emergency;
};

/// Keys from standard input, pages to standard output, messages to standard error. The end of the
/// input counts as closing the screen. run() must be called by the thread that created it; the
/// destructor restores the terminal.
std::unique_ptr<DisplayLoop> make_text_display(const TextSettings& settings);

}  // namespace palpate::runner::display
