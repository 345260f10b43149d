#pragma once
// Reading of protocols and scenes, with every fault and its location.

#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "protocols/protocol.h"
#include "protocols/scene_spec.h"

namespace palpate::protocols {

/// One fault of an input file.
struct Fault {
  std::string file;
  /// JSON pointer, or "line L, column C" where the text is not JSON; "": the file as a whole
  std::string location;
  std::string expected;  ///< expected and found value
  int line = 0;          ///< of the text, from 1; 0: unknown
};

/// Every fault that was found in a file; what() lists them all, a line each:
/// "file:line: location: expected" (without ":line" where it is unknown or the location says it).
class InputError : public std::runtime_error {
 public:
  explicit InputError(std::vector<Fault> faults);
  const std::vector<Fault>& faults() const { return faults_; }

 private:
  std::vector<Fault> faults_;
};

/// Contents of files by the name that a protocol gives them.
using StoredFiles = std::map<std::string, std::string>;

/// Reads and checks a protocol, also that its schedule can be built. \throws InputError with every
/// fault.
Protocol parse_protocol(const std::string& path);
enum class OtherFiles { read, refuse };
/// \param stored  contents of the files that the protocol names
/// \param others  files that are not stored: read from the folder of `file_name`, or a fault
Protocol parse_protocol_text(const std::string& text, const std::string& file_name,
                             const StoredFiles& stored = {}, OtherFiles others = OtherFiles::read);

/// The text of a scene file; of a mesh file that of a scene which holds this mesh alone.
std::string read_scene_text(const std::string& path);

/// Reads and checks a scene file: {"objects": [...], "tool": ..., "reach": ...}. Mesh files are
/// resolved relative to it. A mesh file is read as a scene of one object.
/// \throws InputError with every fault.
SceneSpec parse_scene(const std::string& path);
/// \param file_name  named in faults; mesh files are in its folder
SceneSpec parse_scene_text(const std::string& text, const std::string& file_name);

}  // namespace palpate::protocols
