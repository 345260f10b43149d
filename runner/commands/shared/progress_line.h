#pragma once

#include <string>

namespace palpate::runner {

/// ns, of a steady clock.
double now_ns();

/// One line on a terminal: what is done, and how long the rest will take. Gone at the end.
class ProgressLine {
 public:
  explicit ProgressLine(std::string what);
  ~ProgressLine() { clear(); }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  /// Something else begins.
  void begin(std::string what);
  /// \param done  0 to 1; the first call may be beyond 0, where an earlier run has got
  void show(double done);
  void clear();
  /// Whether anybody sees it.
  bool on_terminal() const { return on_terminal_; }

 private:
  std::string what_;
  bool on_terminal_;
  double start_ = 0, shown_ = 0;  // ns
  double first_ = -1;             // done at the start; negative: not known yet
};

}  // namespace palpate::runner
