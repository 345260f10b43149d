#pragma once
// store_child (store_child.cpp) with its output on a pipe, so that tests can kill it.

#include <sys/types.h>

#include <string>
#include <vector>

namespace palpate::data::testing {

class ChildProcess {
 public:
  explicit ChildProcess(const std::vector<std::string>& arguments);
  ~ChildProcess();  ///< kills it
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  pid_t pid() const { return pid_; }
  std::string read_line();               ///< waits; "" at the end of its output
  std::vector<std::string> read_rest();  ///< whole lines until the pipe closes
  void kill();                           ///< SIGKILL, and waits; no effect if already waited for
  /// Waits for its end. \return the exit status, or minus the signal.
  int wait();

 private:
  pid_t pid_ = -1;
  int output_ = -1;
  int status_ = 0;
};

}  // namespace palpate::data::testing
