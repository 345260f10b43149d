// Whatever a mesh of tetrahedra holds: it is refused with the reason, or its numbers are finite and
// its tetrahedra name nodes that are there.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "stimuli/convex_mesh.h"
#include "stimuli/solids/gmsh_file.h"
#include "stimuli/solids/solid_mesh.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace palpate::stimuli;
  try {
    const SolidMesh mesh =
        read_gmsh("mesh.msh", std::string(reinterpret_cast<const char*>(data), size));
    if (mesh.tetrahedra.empty()) std::abort();
    for (const auto& node : mesh.nodes) {
      if (!std::isfinite(node.x + node.y + node.z)) std::abort();
    }
    for (const auto& tetrahedron : mesh.tetrahedra) {
      if (std::any_of(tetrahedron.begin(), tetrahedron.end(), [&](auto node) {
            return static_cast<std::size_t>(node) >= mesh.nodes.size();
          }))
        std::abort();
    }
  } catch (const MeshError&) {
  }
  return 0;
}
