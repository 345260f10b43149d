#include "runner/display/scene/label_places.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>

namespace palpate::runner {
namespace {

constexpr float kBetween = 2;  // px
constexpr int kMostRows = 6;   // above and below its place

bool overlap(const LabelBox& a, const LabelBox& b) {
  const glm::vec2 apart = glm::abs(a.centre - b.centre);
  const glm::vec2 least = 0.5F * (a.size + b.size) + glm::vec2(kBetween);
  return apart.x < least.x && apart.y < least.y;
}

}  // namespace

void place_labels(std::vector<LabelBox>& boxes, const glm::vec2& picture) {
  std::ranges::stable_sort(boxes, {}, &LabelBox::distance);
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    LabelBox& box = boxes[i];
    const glm::vec2 wanted = box.centre, low = 0.5F * box.size, high = picture - low;
    const bool near_enough = wanted.x >= 0 && wanted.x <= picture.x && wanted.y >= -picture.y / 4 &&
                             wanted.y <= picture.y;
    box.shown = near_enough && low.x <= high.x && low.y <= high.y;
    bool free = false;
    // Above its place, then below, ever farther.
    for (int k = 0; box.shown && !free && k <= 2 * kMostRows; ++k) {
      const int rows = (k + 1) / 2 * (k % 2 == 1 ? -1 : 1);
      const glm::vec2 moved =
          wanted + glm::vec2(0, static_cast<float>(rows) * (box.size.y + kBetween));
      box.centre = glm::clamp(moved, low, high);
      free =
          std::none_of(boxes.begin(), boxes.begin() + static_cast<std::ptrdiff_t>(i),
                       [&](const LabelBox& other) { return other.shown && overlap(box, other); });
    }
    box.shown = box.shown && free;
  }
}

}  // namespace palpate::runner
