// Patches that a way may enter, against one plane after the other.

#include "rendering/near_patches.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <vector>

#include "data/base/random.h"

namespace palpate::rendering {
namespace {

class PlainPatches {
 public:
  void add(const SurfacePatch& patch, const PatchPlane& plane) { all_.push_back({patch, plane}); }
  std::vector<std::uint32_t> entered(const Vec3& from, const Vec3& to, double error,
                                     double time) const {
    std::vector<std::uint32_t> out;
    for (const auto& [patch, plane] : all_) {
      const double above = glm::dot(plane.normal, from) - plane.depth,
                   under = plane.depth - glm::dot(plane.normal, to);
      if (above >= -error && under >= -error && above - error <= time * (above + under + 2 * error))
        out.push_back(patch.side);
    }
    return out;
  }

 private:
  struct Near {
    SurfacePatch patch;
    PatchPlane plane;
  };
  std::vector<Near> all_;
};

TEST(NearPatches, GivesThoseOfOnePlaneAfterTheOther) {
  Random random(19);
  const auto any = [&] { return Vec3(random.normal(), random.normal(), random.normal()); };
  std::size_t found = 0;
  for (int list = 0; list < 2000; ++list) {
    NearPatches near;
    PlainPatches plain;
    const auto count = static_cast<std::uint32_t>(list % 4 == 0 ? list % 13 : 100 * random.unit());
    for (std::uint32_t i = 0; i < count; ++i) {
      PatchPlane plane{glm::normalize(any()), 0.3 * random.normal()};
      if (i % 7 == 3) plane = {};               // not known
      if (i % 5 == 2) plane = {Vec3(0, 0, 1)};  // through the start
      const SurfacePatch patch{i << 2, 0, false, SurfacePatch::Kind::face};
      near.add(patch, plane);
      plain.add(patch, plane);
    }
    const Vec3 from = list % 3 == 0 ? Vec3(0) : 0.3 * any(), to = 0.3 * any();
    const double error = list % 2 == 0 ? 1e-12 : 0.0;
    PatchHit first;
    if (list % 5 == 0) first.time = random.unit();
    std::vector<std::uint32_t> sides;
    near.for_each_entered(from, to, error, first,
                          [&](const SurfacePatch& patch) { sides.push_back(patch.side); });
    ASSERT_EQ(sides, plain.entered(from, to, error, first.time)) << "list " << list;
    found += sides.size();
  }
  EXPECT_GT(found, 10'000u);
}

TEST(NearPatches, LeavesOutPlanesEnteredAfterAHit) {
  NearPatches near;
  for (std::uint32_t i = 0; i < kMostPatches; ++i)
    near.add({i << 2, 0, false, SurfacePatch::Kind::face}, {Vec3(0, 0, 1), -1e-3 * i});
  PatchHit first;
  std::size_t looked = 0;
  near.for_each_entered({}, {0, 0, -1}, 0, first, [&](const SurfacePatch& patch) {
    ++looked;
    if (!first.hit()) first = {patch, 1e-3 * patch.triangle()};
  });
  EXPECT_GE(looked, 1u);
  EXPECT_LE(looked, 4u) << "those that are looked at together";
}

}  // namespace
}  // namespace palpate::rendering
