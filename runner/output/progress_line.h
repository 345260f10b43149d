#pragma once
// Progress of a long command, on a terminal only, and its end by Ctrl-C.

#include <atomic>
#include <string>

namespace palpate::runner::output {

/// For Ctrl-C during a long command: from now on the first SIGINT (Ctrl-C) or SIGTERM only sets the
/// returned flag, so that the command can end cleanly; a second one ends the program as usual.
const std::atomic<bool>& catch_stop_signals();

/// ns, of a steady clock.
double now_ns();

/// A progress line on a terminal: percentage and time left. Erased at the end.
class ProgressLine {
 public:
  explicit ProgressLine(std::string what);
  ~ProgressLine() { clear(); }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  /// Starts another task.
  void begin(std::string what);
  /// \param done  0 to 1; a resumed task starts above 0
  void show(double done);
  void clear();
  /// Whether it is shown.
  bool on_terminal() const { return on_terminal_; }

 private:
  std::string what_;
  bool on_terminal_;
  double start_ = 0, shown_ = 0;  // ns
  double first_ = -1;             // `done` at the first call; negative: none yet
};

}  // namespace palpate::runner::output
