#include "protocols/json_document.h"
#include "protocols/parse.h"
#include "protocols/parse_object.h"

namespace palpate::protocols {

std::vector<stimuli::ObjectSpec> parse_scene(const std::string& path) {
  constexpr std::size_t kMaxObjects = 1000;
  FaultList faults(path);
  const nlohmann::json root = read_json(read_text_file(path), faults);
  ObjectReader scene(root, "", faults);
  scene.member("$schema");
  std::vector<stimuli::ObjectSpec> objects;
  if (const auto* const list = scene.array("objects", 1, kMaxObjects, Presence::required)) {
    for (std::size_t i = 0; i < list->size(); ++i) {
      ObjectReader object((*list)[i], child_pointer("/objects", i), faults);
      objects.push_back(read_object(object, stimuli::Material{}, {folder_of(path)}));
      object.refuse_unknown_keys();
    }
  }
  scene.refuse_unknown_keys();
  faults.throw_if_any();
  return objects;
}

}  // namespace palpate::protocols
