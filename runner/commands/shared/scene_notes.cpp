#include "runner/commands/shared/scene_notes.h"

#include <algorithm>
#include <cstddef>
#include <glm/geometric.hpp>

namespace palpate::runner {

std::vector<std::string> objects_passed_through(const protocols::SceneSpec& scene) {
  const auto is_soft = [](const stimuli::ObjectSpec& object) { return object.soft.has_value(); };
  const bool any_soft = std::any_of(scene.objects.begin(), scene.objects.end(), is_soft);
  std::vector<std::string> notes;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const stimuli::ObjectSpec& object = scene.objects[i];
    const std::string place = "/objects/" + std::to_string(i) + ": ";
    if (object.body && any_soft)
      notes.push_back(place + "moves through soft objects: they touch nothing but the tool");
    const bool falls = object.soft && object.soft->fixed == stimuli::Soft::Fixed::none &&
                       glm::length(scene.gravity) > 0;
    if (falls && scene.objects.size() > 1)
      notes.push_back(place +
                      "is soft, not fixed, and falls through the other objects: soft ones "
                      "touch nothing but the tool");
  }
  return notes;
}

}  // namespace palpate::runner
