#include "stimuli/orientation.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace palpate::stimuli {
namespace {

TEST(UniformRotation, GivesTheSameBitsOnEveryCompiler) {
  constexpr std::uint64_t kSeed = 7;
  Random random(kSeed);
  const Quat first = uniform_rotation(random), second = uniform_rotation(random);
  EXPECT_EQ(first.w, 0x1.bd988d9d86a2cp-2);
  EXPECT_EQ(first.x, -0x1.2a260959ce800p-3);
  EXPECT_EQ(first.y, 0x1.c5ad67a5f1a38p-1);
  EXPECT_EQ(first.z, -0x1.0c76aae28393cp-4);
  EXPECT_EQ(second.w, 0x1.ca8fcd9b10f50p-2);
  EXPECT_EQ(second.x, -0x1.5c7d25291ff10p-2);
  EXPECT_EQ(second.y, 0x1.b5e9dfa8b4601p-2);
  EXPECT_EQ(second.z, -0x1.6a50434ef6cfap-1);
  // Its first draw is negative: the quaternion is negated.
  constexpr std::uint64_t kSeedOfNegated = 3;
  Random other(kSeedOfNegated);
  const Quat third = uniform_rotation(other);
  EXPECT_EQ(third.w, 0x1.cb5051b91b9a6p-1);
  EXPECT_EQ(third.x, -0x1.2eef64fb71834p-2);
  EXPECT_EQ(third.y, -0x1.a0c3ef089847dp-4);
  EXPECT_EQ(third.z, 0x1.3f7d7e9023c4fp-2);
}

TEST(UniformRotation, IsUnitWithPositiveRealPart) {
  constexpr std::uint64_t kSeed = 3;
  Random random(kSeed);
  for (int i = 0; i < 10000; ++i) {
    const Quat q = uniform_rotation(random);
    EXPECT_GE(q.w, 0);
    EXPECT_NEAR(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z, 1, 4e-15);
  }
}

constexpr int kDraws = 64000;

template <std::size_t kCells>
double chi_square(const std::array<int, kCells>& counts) {
  const double expected = static_cast<double>(kDraws) / kCells;
  double sum = 0;
  for (const int count : counts) sum += (count - expected) * (count - expected) / expected;
  return sum;
}

// Share of a turn, in cells.
std::size_t azimuth_cell(double x, double y, std::size_t cells) {
  const double turn = std::atan2(y, x) / (2 * std::numbers::pi) + 0.5;
  return std::min(cells - 1, static_cast<std::size_t>(turn * static_cast<double>(cells)));
}

TEST(UniformRotation, TurnsAnAxisToEveryDirectionEquallyOften) {
  for (const Vec3& axis : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(0.6, 0, 0.8)}) {
    constexpr std::uint64_t kSeed = 5;
    Random random(kSeed);
    std::array<int, 64> counts{};  // equal areas: 8 slices in z, 8 sectors
    for (int i = 0; i < kDraws; ++i) {
      const Vec3 p = uniform_rotation(random) * axis;
      const auto slice = std::min<std::size_t>(7, static_cast<std::size_t>((p.z + 1) * 4));
      ++counts.at(8 * slice + azimuth_cell(p.x, p.y, 8));
    }
    EXPECT_LT(chi_square(counts), 103.4);  // 63 degrees of freedom, p = 0.001
  }
}

// The direction of one axis can be uniform without the rotation being so: the turn about it must
// be uniform as well.
TEST(UniformRotation, TurnsAboutAnAxisEquallyOften) {
  constexpr std::uint64_t kSeed = 6;
  Random random(kSeed);
  std::array<int, 16> counts{};
  for (int i = 0; i < kDraws; ++i) {
    const Quat q = uniform_rotation(random);
    ++counts.at(azimuth_cell(q.w, q.z, 32) % 16);  // half the angle of twist about z, q = -q
  }
  EXPECT_LT(chi_square(counts), 37.7);  // 15 degrees of freedom, p = 0.001
}

// The angle a of a uniform rotation has the distribution (a - sin a) / pi.
TEST(UniformRotation, HasTheAnglesOfHaarMeasure) {
  constexpr std::uint64_t kSeed = 8;
  Random random(kSeed);
  std::array<int, 20> counts{};
  for (int i = 0; i < kDraws; ++i) {
    const double angle = 2 * std::acos(std::min(1.0, uniform_rotation(random).w));
    const double share = (angle - std::sin(angle)) / std::numbers::pi;
    ++counts.at(std::min<std::size_t>(19, static_cast<std::size_t>(share * 20)));
  }
  EXPECT_LT(chi_square(counts), 43.8);  // 19 degrees of freedom, p = 0.001
}

}  // namespace
}  // namespace palpate::stimuli
