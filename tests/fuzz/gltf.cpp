#include "tests/fuzz/mesh.h"

// Text or binary, as its first bytes say.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const palpate::testing::InputFile file("mesh.gltf");
  palpate::testing::feel_mesh_file(file.write(data, size));
  return 0;
}
