#include "tests/fuzz/mesh.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const palpate::testing::InputFile file("mesh.ply");
  palpate::testing::feel_mesh_file(file.write(data, size));
  return 0;
}
