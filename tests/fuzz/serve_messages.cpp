// Whatever a client of palpate serve says: a message within its limits, or a refusal with reasons
// that is a message itself.

#include <cstdint>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>

#include "runner/serve/messages.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  namespace runner = palpate::runner;
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    const runner::serve::Message message = runner::serve::parse_message(text);
    const bool in_range = message.id >= 0 && message.rate >= 0 && message.rate <= 1000 &&
                          message.code >= 0 && message.code <= 255 && message.fields.size() <= 9 &&
                          message.trial.value_or(1) >= 1 && message.t_ns.value_or(0) >= 0;
    if (!in_range) std::abort();
  } catch (const runner::serve::MessageRefused& error) {
    if (error.why().empty()) std::abort();
    const auto said = nlohmann::json::parse(runner::serve::refused(error.id(), error.why()));
    if (said["ok"] != false || said["error"]["code"].get<std::string>().empty()) std::abort();
  }
  return 0;
}
