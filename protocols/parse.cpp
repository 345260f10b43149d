#include "protocols/parse.h"

#include <utility>

#include "stimuli/text.h"

namespace palpate::protocols {
namespace {

// Keys and names from a file must not add lines to the list.
std::string list(const std::vector<Fault>& faults) {
  std::string text;
  for (const Fault& fault : faults) {
    text += (text.empty() ? "" : "\n") + stimuli::printable(fault.file);
    // A location that is a line says it itself.
    if (fault.line > 0 && fault.location.front() == '/')
      (text += ':') += std::to_string(fault.line);
    text += ": " + stimuli::printable(fault.location) + ": " + stimuli::printable(fault.expected);
  }
  return text;
}

}  // namespace

InputError::InputError(std::vector<Fault> faults)
    : std::runtime_error(list(faults)), faults_(std::move(faults)) {}

}  // namespace palpate::protocols
