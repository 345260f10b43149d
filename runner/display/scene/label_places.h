#pragma once

#include <glm/vec2.hpp>
#include <string>
#include <vector>

namespace palpate::runner {

/// A label in a picture. Pixels from the upper left corner.
struct LabelBox {
  glm::vec2 centre{0, 0}, size{0, 0};
  float distance = 0;  ///< of what it names, from the viewer, m
  const std::string* text = nullptr;
  bool shown = true;
};

/// Moves labels so that they lie in the picture and on none of the others, the nearest things'
/// first. Not shown is what names things outside of the picture, and what finds no room.
void place_labels(std::vector<LabelBox>& boxes, const glm::vec2& picture);

}  // namespace palpate::runner
