#pragma once
// The data of a glTF document: buffers, and what accessors read of them.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "stimuli/mesh_gltf_document.h"
#include "stimuli/vec.h"

namespace palpate::stimuli {

/// \throws GltfRefused, all of it.
class GltfAccessors {
 public:
  explicit GltfAccessors(const GltfDocument& document);

  /// How many values an accessor has. \param number  the value that names the accessor
  std::size_t count(const GltfValue& number) const;
  /// m, as they stand: single precision, glTF's axes.
  std::vector<Vec3> positions(const GltfValue& number) const;
  /// Numbers of vertices. \param vertices  how many there are; all are below it
  std::vector<std::uint32_t> indices(const GltfValue& number, std::size_t vertices) const;

 private:
  struct Values {
    std::string_view data;
    std::size_t count, stride;
  };
  GltfValue accessor(const GltfValue& number) const;
  Values values(const GltfValue& accessor, std::size_t bytes_each) const;
  std::string_view view_of(const GltfValue& accessor, std::size_t bytes_each,
                           std::size_t& stride) const;

  const GltfDocument& document_;
  std::vector<std::string> buffers_;
};

}  // namespace palpate::stimuli
