#include "protocols/parse.h"

#include <utility>

#include "stimuli/printable.h"

namespace palpate::protocols {
namespace {

// Keys and names from a file must not break the lines of the list.
std::string list(const std::vector<Fault>& faults) {
  std::string text;
  for (const Fault& fault : faults) {
    text += (text.empty() ? "" : "\n") + stimuli::printable(fault.file);
    // A place that is a line says it itself.
    if (fault.line > 0 && fault.place.front() == '/') (text += ':') += std::to_string(fault.line);
    text += ": " + stimuli::printable(fault.place) + ": " + stimuli::printable(fault.expected);
  }
  return text;
}

}  // namespace

InputError::InputError(std::vector<Fault> faults)
    : std::runtime_error(list(faults)), faults_(std::move(faults)) {}

}  // namespace palpate::protocols
