#include <algorithm>

#include "protocols/json_document.h"
#include "protocols/parse.h"
#include "protocols/parse_body.h"
#include "protocols/parse_object.h"
#include "protocols/parse_tool.h"

namespace palpate::protocols {

SceneSpec parse_scene(const std::string& path) {
  return parse_scene_text(read_text_file(path), path);
}

SceneSpec parse_scene_text(const std::string& text, const std::string& path) {
  constexpr std::size_t kMaxObjects = 1000;
  FaultList faults(path);
  const nlohmann::json root = read_json(text, faults);
  ObjectReader reader(root, "", faults);
  reader.member("$schema");
  SceneSpec scene;
  if (const auto* const list = reader.array("objects", 1, kMaxObjects, Presence::required)) {
    for (std::size_t i = 0; i < list->size(); ++i) {
      ObjectReader object((*list)[i], child_pointer("/objects", i), faults);
      scene.objects.push_back(read_object(object, stimuli::Material{}, {folder_of(path)}));
      object.refuse_unknown_keys();
    }
  }
  read_tool(reader, scene.tool);
  check_radius(reader, scene.tool,
               std::any_of(scene.objects.begin(), scene.objects.end(),
                           [](const auto& object) { return object.soft.has_value(); }));
  read_reach(reader, scene.reach);
  read_gravity(reader, scene.gravity);
  reader.refuse_unknown_keys();
  faults.throw_if_any();
  return scene;
}

}  // namespace palpate::protocols
