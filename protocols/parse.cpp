#include "protocols/parse.h"

#include <utility>

namespace palpate {
namespace {

/// Keys and names from a file must not break the lines of the list or reach a terminal as commands.
std::string printable(std::string text) {
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  }
  return text;
}

std::string list(const std::vector<Fault>& faults) {
  std::string text;
  for (const Fault& fault : faults) {
    text += (text.empty() ? "" : "\n") + fault.file;
    // A place that is a line says it itself.
    if (fault.line > 0 && fault.place.front() == '/') (text += ':') += std::to_string(fault.line);
    text += ": " + printable(fault.place) + ": " + printable(fault.expected);
  }
  return text;
}

}  // namespace

InputError::InputError(std::vector<Fault> faults)
    : std::runtime_error(list(faults)), faults_(std::move(faults)) {}

}  // namespace palpate
