#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "runner/display/scene/scene_drawing.h"

namespace palpate::runner::display {
namespace {

const glm::vec2 kPicture(640, 360);

/// By definition: their rectangles have no pixel in common.
bool share_a_pixel(const LabelBox& a, const LabelBox& b) {
  const glm::vec2 low_a = a.centre - 0.5F * a.size, high_a = a.centre + 0.5F * a.size;
  const glm::vec2 low_b = b.centre - 0.5F * b.size, high_b = b.centre + 0.5F * b.size;
  return low_a.x < high_b.x && low_b.x < high_a.x && low_a.y < high_b.y && low_b.y < high_a.y;
}

TEST(LabelPlaces, LabelsWithRoomStayInPlace) {
  std::vector<LabelBox> boxes{{{100, 100}, {60, 14}, 1}, {{100, 130}, {60, 14}, 2}};
  place_labels(boxes, kPicture);
  EXPECT_EQ(boxes[0].centre, glm::vec2(100, 100));
  EXPECT_EQ(boxes[1].centre, glm::vec2(100, 130));
}

TEST(LabelPlaces, TheNearerLabelStaysAndTheOtherMoves) {
  std::vector<LabelBox> boxes{{{100, 100}, {60, 14}, 5}, {{110, 102}, {60, 14}, 2}};
  place_labels(boxes, kPicture);
  EXPECT_EQ(boxes[0].distance, 2);
  EXPECT_EQ(boxes[0].centre, glm::vec2(110, 102));
  EXPECT_FALSE(share_a_pixel(boxes[0], boxes[1]));
  EXPECT_TRUE(boxes[1].shown);
  EXPECT_LT(std::abs(boxes[1].centre.y - 100), 35) << "not far from what it names";
}

TEST(LabelPlaces, LabelsStayInsideTheBorder) {
  std::vector<LabelBox> boxes{{{5, 3}, {60, 14}, 1},
                              {{636, 200}, {60, 14}, 2},
                              {{-80, 200}, {60, 14}, 3},
                              {{300, 900}, {60, 14}, 4}};
  place_labels(boxes, kPicture);
  EXPECT_EQ(boxes[0].centre, glm::vec2(30, 7));
  EXPECT_EQ(boxes[1].centre, glm::vec2(610, 200));
  EXPECT_FALSE(boxes[2].shown);
  EXPECT_FALSE(boxes[3].shown);
}

TEST(LabelPlaces, LabelsNeverOverlapNorLeaveThePicture) {
  constexpr std::uint32_t kSeed = 16;
  std::mt19937 random(kSeed);  // NOLINT(cert-msc32-c,cert-msc51-cpp): any sequence will do
  std::uniform_real_distribution<float> any(-0.2F, 1.2F), width(10, 900);
  for (int scene = 0; scene < 300; ++scene) {
    std::vector<LabelBox> boxes(static_cast<std::size_t>(1 + scene % 40));
    for (LabelBox& box : boxes)
      box = {kPicture * glm::vec2(any(random), any(random)),
             {width(random) / (1 + scene % 9), 15},
             any(random)};
    place_labels(boxes, kPicture);
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      if (!boxes[i].shown) continue;
      const glm::vec2 low = boxes[i].centre - 0.5F * boxes[i].size,
                      high = boxes[i].centre + 0.5F * boxes[i].size;
      EXPECT_GE(low.x, -0.01F);
      EXPECT_GE(low.y, -0.01F);
      EXPECT_LE(high.x, kPicture.x + 0.01F);
      EXPECT_LE(high.y, kPicture.y + 0.01F);
      for (std::size_t k = 0; k < i; ++k)
        EXPECT_FALSE(boxes[k].shown && share_a_pixel(boxes[i], boxes[k])) << scene;
    }
  }
}

}  // namespace
}  // namespace palpate::runner::display
