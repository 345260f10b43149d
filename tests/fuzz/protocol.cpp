// Whatever a protocol file holds: every fault is named, or it has a schedule.

#include <cstdlib>
#include <string>

#include "protocols/parse.h"
#include "protocols/schedule.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    const palpate::protocols::Protocol protocol =
        palpate::protocols::parse_protocol_text(text, "input.json");
    if (palpate::protocols::main_trials(protocol) > 20'000) return 0;
    for (const palpate::protocols::Trial& trial : palpate::protocols::schedule(protocol, 1)) {
      if (trial.stimulus < 0 ||
          static_cast<std::size_t>(trial.stimulus) >= protocol.stimuli.size()) {
        std::abort();
      }
    }
  } catch (const palpate::protocols::InputError& error) {
    if (error.faults().empty() || std::string(error.what()).find("input.json") == std::string::npos)
      std::abort();
  }
  return 0;
}
