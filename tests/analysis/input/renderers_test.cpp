// Which renderers are compared, and how they are named.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "analysis/input/trials.h"

namespace palpate::analysis {
namespace {

TEST(RendererPairs, EachIsComparedWithTheFirst) {
  const auto pairs = renderer_pairs({"point", "ray", "tube"});
  ASSERT_EQ(pairs.size(), 2U);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    EXPECT_EQ(pairs[i].reference, "point");
    EXPECT_EQ(pairs[i].reference_at, 0U);
    EXPECT_EQ(pairs[i].renderer_at, i + 1);
    EXPECT_TRUE(pairs[i].in_data());
  }
  EXPECT_TRUE(pairs[0].is_ray_minus_point());
  EXPECT_FALSE(pairs[1].is_ray_minus_point());
  EXPECT_EQ(difference_name(pairs[1]), "tube − point");
  EXPECT_FALSE(renderer_pairs({"ray", "point"})[0].is_ray_minus_point());
}

TEST(RendererPairs, ASingleRendererHasNothingToCompareWith) {
  const RendererPair ray = renderer_pairs({"ray"}).at(0), point = renderer_pairs({"point"}).at(0),
                     other = renderer_pairs({"tube"}).at(0);
  EXPECT_FALSE(ray.in_data());
  EXPECT_EQ(ray.reference, "point");
  EXPECT_EQ(ray.renderer, "ray");
  EXPECT_FALSE(ray.reference_at);
  EXPECT_EQ(ray.renderer_at, 0U);
  EXPECT_FALSE(point.in_data());
  EXPECT_EQ(point.reference, "point");
  EXPECT_EQ(point.reference_at, 0U);
  EXPECT_EQ(point.renderer, "ray");
  EXPECT_FALSE(other.in_data());
  EXPECT_EQ(other.reference, "tube");
  EXPECT_EQ(other.renderer, "another renderer");
  EXPECT_TRUE(renderer_pairs({}).empty());
}

TEST(RendererNames, HaveAnArticleWhereEnglishWantsOne) {
  EXPECT_EQ(with_article("point"), "the point");
  EXPECT_EQ(with_article("ray"), "the ray");
  EXPECT_EQ(with_article("tip2"), "tip2");
}

}  // namespace
}  // namespace palpate::analysis
