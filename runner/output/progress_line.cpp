#include "runner/output/progress_line.h"

#include <unistd.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <iostream>
#include <utility>

namespace palpate::runner::output {
namespace {

std::atomic<bool> stop_asked{false};  // a signal handler needs a global

void ask_to_stop(int) { stop_asked = true; }

}  // namespace

const std::atomic<bool>& catch_stop_signals() {
  struct sigaction action = {};
  action.sa_handler = ask_to_stop;
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  return stop_asked;
}

double now_ns() {
  return std::chrono::duration<double, std::nano>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

ProgressLine::ProgressLine(std::string what) : on_terminal_(isatty(STDERR_FILENO) == 1) {
  begin(std::move(what));
}

void ProgressLine::begin(std::string what) {
  what_ = std::move(what);
  start_ = now_ns();
  first_ = -1;
}

void ProgressLine::show(double done) {
  const double now = now_ns();
  if (first_ < 0) {  // a resumed task's earlier part took no time now
    first_ = done;
    start_ = now;
  }
  if (!on_terminal_ || now - shown_ < 2e8) return;
  shown_ = now;
  const double gone = (now - start_) / 1e9, since = done - first_;
  std::cerr << "\r\033[K" << what_ << ": " << std::lround(100 * done) << " %";
  if (since > 0.02) std::cerr << ", about " << std::lround(gone / since * (1 - done)) << " s left";
  std::cerr << std::flush;
}

void ProgressLine::clear() {
  if (shown_ > 0) std::cerr << "\r\033[K" << std::flush;
  shown_ = 0;
}

}  // namespace palpate::runner::output
