#pragma once

#include <string>

namespace palpate {

/// ns, of a steady clock.
double now_ns();

/// One line on a terminal: what is done, and how long the rest will take. Gone at the end.
class ProgressLine {
 public:
  explicit ProgressLine(std::string what);
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  /// \param done  0 to 1
  void show(double done);

 private:
  std::string what_;
  bool on_terminal_;
  double start_, shown_ = 0;
};

}  // namespace palpate
