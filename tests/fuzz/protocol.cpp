// Whatever a protocol file holds: every fault is named, or it has a schedule.

#include <cstdlib>
#include <string>

#include "protocols/parse.h"
#include "protocols/schedule.h"
#include "protocols/session_plan.h"
#include "protocols/tasks/block_order.h"

using palpate::protocols::Protocol;

namespace {

void check(const palpate::protocols::Trial& trial, const Protocol& protocol) {
  if (trial.stimulus < 0 || static_cast<std::size_t>(trial.stimulus) >= protocol.stimuli.size())
    std::abort();
}

/// A session of tasks ends, whatever is answered.
void check_tasks(const Protocol& protocol) {
  for (const palpate::protocols::TaskBlock& block : protocol.blocks) {
    if (palpate::protocols::most_trials_of(block) > 2'000) return;
  }
  palpate::protocols::SessionPlan plan(protocol, 1, 1);
  const std::size_t most = plan.size();
  for (std::size_t i = 0; !plan.finished(); ++i) {
    if (i > most) std::abort();
    plan.answered({.correct = i % 3 != 0, .success = i % 3 != 0});
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    const Protocol protocol = palpate::protocols::parse_protocol_text(text, "input.json");
    if (!protocol.blocks.empty()) {
      check_tasks(protocol);
      return 0;
    }
    if (palpate::protocols::main_trials(protocol) > 20'000) return 0;
    for (const palpate::protocols::Trial& trial : palpate::protocols::schedule(protocol, 1))
      check(trial, protocol);
  } catch (const palpate::protocols::InputError& error) {
    if (error.faults().empty() || std::string(error.what()).find("input.json") == std::string::npos)
      std::abort();
  }
  return 0;
}
