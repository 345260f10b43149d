#pragma once

#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "protocols/protocol.h"

namespace palpate::protocols {

/// One thing wrong with an input file.
struct Fault {
  std::string file;
  std::string place;     ///< JSON pointer, or "line L, column C" where the text is no JSON
  std::string expected;  ///< what was expected there, and what was found
  int line = 0;          ///< of the text, from 1; 0: unknown
};

/// Every fault that was found in a file; what() lists them all, a line each:
/// "file:line: place: expected" (without ":line" where it is unknown or the place says it).
class InputError : public std::runtime_error {
 public:
  explicit InputError(std::vector<Fault> faults);
  const std::vector<Fault>& faults() const { return faults_; }

 private:
  std::vector<Fault> faults_;
};

/// Bytes of files by name, as a protocol names them.
using StoredFiles = std::map<std::string, std::string>;

/// Reads and checks a protocol, also that its schedule can be built. \throws InputError with every
/// fault.
Protocol parse_protocol(const std::string& path);
/// \param stored  files that it names and that are taken from here; others from the folder of
/// `file_name`
Protocol parse_protocol_text(const std::string& text, const std::string& file_name,
                             const StoredFiles& stored = {});

/// Reads and checks a scene file: {"objects": [...]}. Mesh files are resolved relative to it.
/// \throws InputError with every fault.
std::vector<stimuli::ObjectSpec> parse_scene(const std::string& path);

}  // namespace palpate::protocols
