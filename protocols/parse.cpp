#include "protocols/parse.h"

#include <utility>

namespace palpate {
namespace {

std::string list(const std::vector<Fault>& faults) {
  std::string text;
  for (const Fault& fault : faults) {
    text += (text.empty() ? "" : "\n") + fault.file;
    // A place that is a line says it itself.
    if (fault.line > 0 && fault.place.front() == '/') (text += ':') += std::to_string(fault.line);
    text += ": " + fault.place + ": " + fault.expected;
  }
  return text;
}

}  // namespace

InputError::InputError(std::vector<Fault> faults)
    : std::runtime_error(list(faults)), faults_(std::move(faults)) {}

}  // namespace palpate
