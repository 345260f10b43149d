#include "runner/display/text_display.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <deque>
#include <string_view>

#include "runner/display/mailbox.h"
#include "runner/display/text_input.h"
#include "stimuli/printable.h"

namespace palpate {
namespace {

using std::chrono::steady_clock;

constexpr std::size_t kWriteAtOnce = 256;  // what a terminal that says it has room takes
constexpr auto kFarewell = std::chrono::milliseconds(300);  // for the last words

/// Keys come as they are pressed, and are not echoed; Ctrl-C still is a signal.
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

struct Words {
  int file = STDOUT_FILENO;
  std::string text;
};

/// Lets a thread that sleeps in poll know.
class Bell {
 public:
  Bell() : file_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {}
  Bell(const Bell&) = delete;
  Bell& operator=(const Bell&) = delete;
  ~Bell() { close(file_); }
  void ring() noexcept {
    const std::uint64_t one = 1;
    // It fails only where it has been rung 2^64 - 2 times already.
    [[maybe_unused]] const ssize_t written = write(file_, &one, sizeof one);
  }
  void answer() noexcept {
    std::uint64_t rung = 0;
    [[maybe_unused]] const ssize_t got = read(file_, &rung, sizeof rung);
  }
  int file() const { return file_; }

 private:
  int file_;
};

class TextScreen final : public ParticipantScreen {
 public:
  TextScreen(Inbox<Words>& out, Bell& bell) : out_(out), bell_(bell) {}

  void show(const Page& page) override {
    std::string text = printable_lines(page.text);
    if (page.kind == Page::Kind::text) text += "\n[space bar: go on]";
    for (const auto& [key, answer] : page.keys) {
      text += text.empty() ? "" : "   ";
      text += printable(key);
      text += ' ';
      text += printable(answer);
    }
    if (text.empty()) return;
    out_.add({STDOUT_FILENO, text + "\n"});
    bell_.ring();
  }
  std::vector<KeyPress> keys() override { return keys_.take(); }
  bool open() const override { return open_.load(); }

  void press(const KeyPress& press) { keys_.add(press); }
  void close() { open_ = false; }

 private:
  Inbox<Words>& out_;
  Bell& bell_;
  Inbox<KeyPress> keys_;
  std::atomic<bool> open_{true};
};

/// Says what has changed.
class TextConsole final : public ExperimenterConsole {
 public:
  TextConsole(Inbox<Words>& out, Bell& bell) : out_(out), bell_(bell) {}

  void show(const ConsoleState& state) override {
    std::string text;
    for (heard_ = std::max(heard_, state.older_messages);
         heard_ < state.older_messages + state.messages.size(); ++heard_) {
      text += "* ";
      text += printable_lines(state.messages[heard_ - state.older_messages]);
      text += '\n';
    }
    if (state.state != state_ || state.trial != trial_ || state.held_by != held_by_) {
      state_ = state.state;
      held_by_ = state.held_by;
      trial_ = state.trial;
      text += status(state);
    }
    if (text.empty()) return;
    out_.add({STDERR_FILENO, text});
    bell_.ring();
  }
  std::vector<ConsoleCommand> commands() override { return commands_.take(); }
  std::string name_of(ConsoleCommand::Kind kind) const override {
    return "':" + std::string(text_command(kind)) + "'";
  }

  void ask(const ConsoleCommand& command) { commands_.add(command); }

 private:
  static std::string status(const ConsoleState& state) {
    std::string text = "[" + state.state;
    if (state.trial > 0) {
      text += ", block " + std::to_string(state.block) + " of " + std::to_string(state.blocks) +
              ", trial " + std::to_string(state.trial) + " of " + std::to_string(state.trials);
    }
    if (state.remaining > 60)
      text += ", " + std::to_string(static_cast<int>(state.remaining / 60)) + " min left";
    if (state.missed_ticks > 0) text += ", " + std::to_string(state.missed_ticks) + " ticks missed";
    if (!state.held_by.empty()) text += ": " + printable(state.held_by);
    return text + "]\n";
  }

  Inbox<Words>& out_;
  Bell& bell_;
  Inbox<ConsoleCommand> commands_;
  // Of what was shown last; the session's thread's own:
  std::size_t heard_ = 0;
  std::string state_, held_by_;
  int trial_ = 0;
};

class TextDisplay final : public DisplayLoop {
 public:
  explicit TextDisplay(const TextSettings& settings) : settings_(settings) {
    say(std::string("Text display: keys answer; ") + text_commands_help());
  }

  ParticipantScreen& participant() override { return screen_; }
  ExperimenterConsole& console() override { return console_; }

  void run() override {
    while (!ended_.load()) step(-1);
    const auto give_up = steady_clock::now() + kFarewell;
    collect();
    while (!pending_.empty() && steady_clock::now() < give_up) step(20);
  }

  void end() noexcept override {
    ended_ = true;
    bell_.ring();
  }

 private:
  void say(const std::string& text) { out_.add({STDERR_FILENO, text}); }

  void collect() {
    for (Words& words : out_.take()) pending_.push_back(std::move(words));
  }

  /// Waits for a key, for something to be said, or for room to say it.
  void step(int timeout_ms) {
    collect();
    std::array<pollfd, 3> files = {{{bell_.file(), POLLIN, 0},
                                    {heard_end_ ? -1 : STDIN_FILENO, POLLIN, 0},
                                    {pending_.empty() ? -1 : pending_.front().file, POLLOUT, 0}}};
    if (poll(files.data(), files.size(), timeout_ms) < 0) return;  // a signal
    if (files[0].revents != 0) bell_.answer();
    if (files[1].revents != 0) listen();
    if (files[2].revents != 0) speak();
  }

  void listen() {
    std::array<char, 512> bytes{};
    const ssize_t got = read(STDIN_FILENO, bytes.data(), bytes.size());
    const std::int64_t now = settings_.clock->now_ns();
    if (got < 0 && (errno == EINTR || errno == EAGAIN)) return;
    if (got <= 0) {
      heard_end_ = true;
      screen_.close();
      return;
    }
    const std::string before = input_.line();
    for (const TextInput::Event& event :
         input_.feed({bytes.data(), static_cast<std::size_t>(got)}, now)) {
      take(event);
    }
    if (terminal_.on() && input_.line() != before) {
      say("\r\x1b[K" + printable(input_.line()) + (input_.line().empty() ? "\n" : ""));
    }
  }

  void take(const TextInput::Event& event) {
    if (const auto* press = std::get_if<KeyPress>(&event)) {
      screen_.press(*press);
    } else if (const auto* command = std::get_if<ConsoleCommand>(&event)) {
      if (command->kind == ConsoleCommand::Kind::emergency_zero && settings_.emergency)
        settings_.emergency();
      console_.ask(*command);
    } else {
      say(text_commands_help());
    }
  }

  void speak() {
    Words& words = pending_.front();
    const std::string_view now = std::string_view(words.text).substr(0, kWriteAtOnce);
    const ssize_t written = write(words.file, now.data(), now.size());
    if (written < 0 && (errno == EINTR || errno == EAGAIN)) return;
    // Where nobody can hear it, it need not be said.
    words.text.erase(0, written < 0 ? words.text.size() : static_cast<std::size_t>(written));
    if (words.text.empty()) pending_.pop_front();
  }

  const TextSettings settings_;
  RawTerminal terminal_;
  Bell bell_;
  Inbox<Words> out_;
  std::deque<Words> pending_;
  TextScreen screen_{out_, bell_};
  TextConsole console_{out_, bell_};
  TextInput input_;
  bool heard_end_ = false;
  std::atomic<bool> ended_{false};
};

}  // namespace

std::unique_ptr<DisplayLoop> make_text_display(const TextSettings& settings) {
  return std::make_unique<TextDisplay>(settings);
}

}  // namespace palpate
