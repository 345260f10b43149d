#include "runner/commands/shared/stop_signal.h"

#include <csignal>

namespace palpate::runner {
namespace {

std::atomic<bool> stop_asked{false};  // a signal handler can reach nothing else

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

}  // namespace palpate::runner
