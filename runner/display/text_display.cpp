#include "runner/display/text_display.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <deque>
#include <string_view>
#include <utility>

#include "runner/display/mailbox.h"
#include "runner/display/text_input.h"
#include "stimuli/printable.h"

namespace palpate::runner {
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

/// Breaks lines between words, where they are too long for the terminal.
/// \param columns  of it; few or none: it does not say
std::string wrapped(const std::string& text, std::size_t columns) {
  if (columns < 20) return text;
  std::string out = text;
  std::size_t start = 0, space = 0, column = 0;  // of the line; the last space; letters so far
  for (std::size_t i = 0; i < out.size(); ++i) {
    if ((static_cast<unsigned char>(out[i]) & 0xC0U) == 0x80U) continue;  // within a letter
    if (out[i] == '\n') {
      start = i + 1;
      column = 0;
      continue;
    }
    if (out[i] == ' ') space = i;
    if (++column <= columns || space <= start) continue;
    out[space] = '\n';
    start = space + 1;
    column = 0;
    i = space;
  }
  return out;
}

/// Of the terminal that it is; 0: it is none, or does not say.
std::size_t columns_of(int file) {
  winsize size{};
  return ioctl(file, TIOCGWINSZ, &size) == 0 ? size.ws_col : 0;
}

class TextScreen final : public ParticipantScreen {
 public:
  TextScreen(Inbox<Words>& out, Bell& bell) : out_(out), bell_(bell) {}

  void show(const Page& page) override {
    const Page before = std::exchange(last_, page);
    std::string text;
    if (page.kind != before.kind || page.text != before.text || page.go != before.go ||
        (page.keys.empty() && page.seconds_left > before.seconds_left) || page.kind == kRead) {
      text = words_of(page);
    }
    if (page.reply != before.reply && !page.reply.empty())
      text += (text.empty() ? "" : "\n") + stimuli::printable(page.reply);
    if (text.empty()) return;
    out_.add({STDOUT_FILENO, text + "\n"});
    bell_.ring();
  }
  std::vector<KeyPress> keys() override { return keys_.take(); }
  bool open() const override { return open_.load(); }

  void press(const KeyPress& press) { keys_.add(press); }
  void close() { open_ = false; }

 private:
  static constexpr Page::Kind kRead = Page::Kind::text;

  static std::string words_of(const Page& page) {
    std::string text = stimuli::printable_lines(page.text);
    if (page.kind == Page::Kind::neutral && !page.go) return text;
    if (page.seconds_left > 0) text += "\n[" + std::to_string(page.seconds_left) + " s]";
    if (page.done > 0 && page.kind != Page::Kind::feedback)
      text += "\n[" + std::to_string(page.done) + " of " + std::to_string(page.trials) + "]";
    if (page.kind == kRead) text += "\n[space bar: go on]";
    if (page.kind != Page::Kind::neutral) return text;
    for (const auto& [key, answer] : page.keys) {
      text += text.empty() ? "" : "   ";
      text += stimuli::printable(key);
      text += ' ';
      text += stimuli::printable(answer);
    }
    return text;
  }

  Page last_;  ///< the session's thread's own
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
      text += stimuli::printable_lines(state.messages[heard_ - state.older_messages]);
      text += '\n';
    }
    if (state.checklist.instruction != instruction_) {
      instruction_ = state.checklist.instruction;
      if (!instruction_.empty()) text += step_due(state.checklist);
    }
    if (!state.state.empty() &&
        (state.state != state_ || state.trial != trial_ || state.held_by != held_by_)) {
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
  static std::string step_due(const Checklist& list) {
    std::size_t due = 0;
    while (due < list.steps.size() && list.steps[due].state != Checklist::Step::State::now) ++due;
    std::string text = "* step " + std::to_string(due + 1) + " of " +
                       std::to_string(list.steps.size()) + ": " +
                       stimuli::printable(list.instruction);
    std::string choices;
    for (const auto& [kind, meaning] : list.choices) {
      choices += choices.empty() ? " (" : "; ";
      choices += text_command(kind);
      choices += ": " + meaning;
    }
    return text + choices + (choices.empty() ? "\n" : ")\n");
  }

  static std::string status(const ConsoleState& state) {
    std::string text = "[" + state.state;
    if (state.practice && (state.state == "trial" || state.state == "homing")) text += ", practice";
    if (state.trial > 0) {
      text += ", block " + std::to_string(state.block) + " of " + std::to_string(state.blocks) +
              ", trial " + std::to_string(state.trial) + " of " + std::to_string(state.trials);
    }
    if (state.remaining > 60)
      text += ", " + std::to_string(static_cast<int>(state.remaining / 60)) + " min left";
    if (state.missed_ticks > 0) text += ", " + std::to_string(state.missed_ticks) + " ticks missed";
    if (!state.held_by.empty()) text += ": " + stimuli::printable(state.held_by);
    return text + "]\n";
  }

  Inbox<Words>& out_;
  Bell& bell_;
  Inbox<ConsoleCommand> commands_;
  // Of what was shown last; the session's thread's own:
  std::size_t heard_ = 0;
  std::string state_, held_by_, instruction_;
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
    try {
      while (!ended_.load()) step(-1);
    } catch (...) {
      screen_.close();
      throw;
    }
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
    for (Words& words : out_.take()) {
      if (words.text.front() != '\r') {
        words.text = wrapped(words.text, columns_of(words.file));
        // A command that is being typed stays in one piece, below what came in between.
        if (terminal_.on() && !input_.line().empty())
          words.text = "\r\x1b[K" + words.text + stimuli::printable(input_.line());
      }
      pending_.push_back(std::move(words));
    }
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
      say("\r\x1b[K" + stimuli::printable(input_.line()) + (input_.line().empty() ? "\n" : ""));
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

}  // namespace palpate::runner
