#pragma once
// The terminal of the text display: its mode, its width, and waking the thread that waits for keys.

#include <sys/eventfd.h>
#include <termios.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <string>

namespace palpate::runner {

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

/// Breaks lines between words where they are longer than the terminal is wide.
/// \param columns  of the terminal; 0: unknown, nothing is broken
std::string wrapped(const std::string& text, std::size_t columns);

/// Width of the terminal that a file descriptor is; 0: it is none, or its width is unknown.
std::size_t columns_of(int file);

}  // namespace palpate::runner
