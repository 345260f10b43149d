#include "stimuli/mesh_faults.h"

#include "stimuli/convex_mesh.h"

namespace palpate::stimuli {
namespace {

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) {
    if (!text.empty()) text += '\n';
    text += line;
  }
  return text;
}

}  // namespace

MeshError::MeshError(std::vector<std::string> faults)
    : std::runtime_error(joined(faults)), faults_(std::move(faults)) {}

MeshFaults::Kind& MeshFaults::entry_of(const char* kind) {
  for (Kind& entry : kinds_) {
    if (entry.name == kind) return entry;
  }
  kinds_.push_back({kind, 0, {}});
  return kinds_.back();
}

std::vector<std::string> MeshFaults::messages() const {
  std::vector<std::string> all;
  for (const Kind& kind : kinds_) {
    all.insert(all.end(), kind.messages.begin(), kind.messages.end());
    if (kind.count > kShown) {
      all.push_back(kind.name + ": " + std::to_string(kind.count - kShown) + " more");
    }
  }
  return all;
}

void MeshFaults::throw_if_any() const {
  if (!empty()) throw MeshError(messages());
}

}  // namespace palpate::stimuli
