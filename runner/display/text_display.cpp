#include "runner/display/text_display.h"

#include <poll.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <deque>
#include <string_view>
#include <utility>

#include "runner/display/terminal.h"
#include "runner/display/text_input.h"
#include "runner/display/text_screens.h"
#include "stimuli/text.h"

namespace palpate::runner {
namespace {

using std::chrono::steady_clock;

constexpr std::size_t kMaxWrite = 256;  // bytes; poll() promises that a terminal takes these
constexpr auto kFlushTime = std::chrono::milliseconds(300);  // for what is left to write at the end

class TextDisplay final : public DisplayLoop {
 public:
  explicit TextDisplay(const TextSettings& settings) : settings_(settings) {
    print(std::string("Text display: keys answer; ") + text_commands_help());
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
    const auto deadline = steady_clock::now() + kFlushTime;
    collect();
    while (!pending_.empty() && steady_clock::now() < deadline) step(20);
  }

  void end() noexcept override {
    ended_ = true;
    wake_.signal();
  }

 private:
  void print(const std::string& text) { out_.add({STDERR_FILENO, text}); }

  void collect() {
    for (Output& output : out_.take()) {
      if (output.text.front() != '\r') {
        output.text = wrapped(output.text, columns_of(output.file));
        // A command that is being typed is written again below the new text.
        if (terminal_.on() && !input_.line().empty())
          output.text = "\r\x1b[K" + output.text + stimuli::printable(input_.line());
      }
      pending_.push_back(std::move(output));
    }
  }

  /// Waits for a key, for text to write, or until it can be written.
  void step(int timeout_ms) {
    collect();
    std::array<pollfd, 3> files = {{{wake_.file(), POLLIN, 0},
                                    {input_ended_ ? -1 : STDIN_FILENO, POLLIN, 0},
                                    {pending_.empty() ? -1 : pending_.front().file, POLLOUT, 0}}};
    if (poll(files.data(), files.size(), timeout_ms) < 0) return;  // a signal
    if (files[0].revents != 0) wake_.clear();
    if (files[1].revents != 0) read_input();
    if (files[2].revents != 0) write_output();
  }

  void read_input() {
    std::array<char, 512> bytes{};
    const ssize_t got = read(STDIN_FILENO, bytes.data(), bytes.size());
    const std::int64_t now = settings_.clock->now_ns();
    if (got < 0 && (errno == EINTR || errno == EAGAIN)) return;
    if (got <= 0) {
      input_ended_ = true;
      screen_.close();
      return;
    }
    const std::string before = input_.line();
    for (const TextInput::Event& event :
         input_.feed({bytes.data(), static_cast<std::size_t>(got)}, now)) {
      dispatch(event);
    }
    if (terminal_.on() && input_.line() != before) {
      print("\r\x1b[K" + stimuli::printable(input_.line()) + (input_.line().empty() ? "\n" : ""));
    }
  }

  void dispatch(const TextInput::Event& event) {
    if (const auto* press = std::get_if<KeyPress>(&event)) {
      screen_.press(*press);
    } else if (const auto* command = std::get_if<ConsoleCommand>(&event)) {
      if (command->kind == ConsoleCommand::Kind::emergency_zero && settings_.emergency)
        settings_.emergency();
      console_.add_command(*command);
    } else {
      print(text_commands_help());
    }
  }

  void write_output() {
    Output& output = pending_.front();
    const std::string_view now = std::string_view(output.text).substr(0, kMaxWrite);
    const ssize_t written = write(output.file, now.data(), now.size());
    if (written < 0 && (errno == EINTR || errno == EAGAIN)) return;
    // On an error (closed pipe) the text is dropped.
    output.text.erase(0, written < 0 ? output.text.size() : static_cast<std::size_t>(written));
    if (output.text.empty()) pending_.pop_front();
  }

  const TextSettings settings_;
  RawTerminal terminal_;
  WakeEvent wake_;
  EventQueue<Output> out_;
  std::deque<Output> pending_;
  TextScreen screen_{out_, wake_};
  TextConsole console_{out_, wake_};
  TextInput input_;
  bool input_ended_ = false;
  std::atomic<bool> ended_{false};
};

}  // namespace

std::unique_ptr<DisplayLoop> make_text_display(const TextSettings& settings) {
  return std::make_unique<TextDisplay>(settings);
}

}  // namespace palpate::runner
