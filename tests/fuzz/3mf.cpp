#include "tests/fuzz/mesh.h"
#include "tests/shared/zip_file.h"

// An archive, or the text of a model, around which one is put: its checksums are right.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const palpate::testing::InputFile file("mesh.3mf");
  std::string bytes(reinterpret_cast<const char*>(data), size);
  if (!bytes.starts_with("PK")) {
    bytes = palpate::testing::zip_file(
        {{"_rels/.rels",
          "<Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\">"
          "<Relationship Target=\"a.model\" "
          "Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/>"
          "</Relationships>"},
         {"a.model", bytes}},
        {.deflated = false});
  }
  palpate::testing::feel_mesh_file(
      file.write(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()));
  return 0;
}
