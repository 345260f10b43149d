// Height profiles: values, derivatives, means over windows, and what a ball feels of them.

#include "stimuli/texture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <stdexcept>
#include <string>

#include "data/base/random.h"

namespace palpate::stimuli {
namespace {

using Kind = TextureSpec::Kind;

TextureSpec spec(Kind kind, double period = 0.002, double depth = 0.0004) {
  TextureSpec out;
  out.kind = kind;
  out.period = period;
  out.depth = depth;
  return out;
}

/// All kinds but images, and one of each way to feel them.
std::vector<Texture> textures() {
  TextureSpec turned = spec(Kind::sine);
  turned.direction = glm::normalize(Vec3(1, 2, -1));
  turned.phase = 40;
  TextureSpec ball = spec(Kind::trapezoid);
  ball.ramp = 0.0004;
  ball.tip_radius = 0.001;
  TextureSpec flanks = spec(Kind::trapezoid);
  flanks.ramp = 0.0004;
  TextureSpec around = spec(Kind::sine);
  around.around = true;
  TextureSpec cones = spec(Kind::cones);
  cones.jitter = 0.5;
  cones.ramp = 0.0005;
  cones.seed = 3;
  TextureSpec noise = spec(Kind::noise);
  noise.seed = 4;
  std::vector<Texture> out;
  for (const TextureSpec& one : {turned, ball, flanks, around, cones, noise})
    out.emplace_back(one, 0.02);
  return out;
}

TEST(Texture, SineHasCrestsAtItsOrigin) {
  const Texture texture(spec(Kind::sine));
  EXPECT_EQ(texture.mean_height(0, 0).height, 0);
  EXPECT_DOUBLE_EQ(texture.mean_height(0.5, 0).height, -0.0004);
  EXPECT_NEAR(texture.greatest_slope(), std::numbers::pi * 0.0004 / 0.002, 1e-12);
  const double kappa = 0.0002 * std::pow(2 * std::numbers::pi / 0.002, 2);
  EXPECT_NEAR(texture.greatest_curvature(), kappa, 1e-9 * kappa);
  EXPECT_DOUBLE_EQ(texture.cycles({0.003, 5, 7}), 1.5);
}

TEST(Texture, DerivativesEqualDifferencesOfHeight) {
  Random random(5);
  constexpr double kStep = 1e-7;  // m
  for (const Texture& texture : textures()) {
    for (int i = 0; i < 200; ++i) {
      const Vec3 place(0.02 * (random.unit() - 0.3), 0.02 * (random.unit() - 0.3),
                       0.02 * random.unit());
      const Vec3 a = glm::normalize(Vec3(random.normal(), random.normal(), random.normal()));
      const Vec3 b = glm::normalize(Vec3(random.normal(), random.normal(), random.normal()));
      const Vec3 window = i % 2 == 0 ? Vec3(0) : 0.003 * b;
      const auto at = [&](const Vec3& there) { return texture.mean_height(there, window, a, b); };
      const PlaneHeight here = at(place), after = at(place + kStep * a),
                        before = at(place - kStep * a);
      EXPECT_NEAR(here.slope[0], (after.height - before.height) / (2 * kStep),
                  1e-6 + kStep * texture.greatest_curvature());
      EXPECT_LE(here.height, 1e-6);
      EXPECT_GE(here.height, -0.00041);
      if (texture.is_linear() && texture.depth() == 0.0004 && i % 7 == 0) {
        // Second derivatives of cubics jump at the table's values.
        EXPECT_NEAR(here.bend[1],
                    (at(place + kStep * b).slope[0] - at(place - kStep * b).slope[0]) / (2 * kStep),
                    0.02 * texture.greatest_curvature() + 0.02 * std::abs(here.bend[1]) + 200);
      }
    }
  }
}

TEST(Texture, MeanOverAWindowIsTheIntegral) {
  TextureSpec flanks = spec(Kind::trapezoid), ball = spec(Kind::sine);
  flanks.ramp = 0.0004;
  ball.tip_radius = 0.001;
  for (const TextureSpec& one : {spec(Kind::sine), flanks, ball}) {
    const Texture texture(one);
    for (const double span : {0.01, 0.3, 1.0, 2.7}) {
      const double middle = 0.23;
      constexpr int kPieces = 200'000;
      double sum = 0;
      for (int i = 0; i < kPieces; ++i)
        sum += texture.mean_height(middle + span * ((i + 0.5) / kPieces - 0.5), 0).height / kPieces;
      EXPECT_NEAR(texture.mean_height(middle, span).height, sum, 2e-13);
    }
  }
}

TEST(Texture, BallInAValleyIsMoreCurved) {
  TextureSpec one = spec(Kind::sine);
  one.tip_radius = 0.00025;
  const Texture texture(one);
  const double kappa = 0.0002 * std::pow(2 * std::numbers::pi / 0.002, 2);
  const double expected = 1 / (1 / kappa - one.tip_radius);
  EXPECT_NEAR(expected, 3897, 1);
  EXPECT_NEAR(texture.mean_height(0.5, 0).curvature / (0.002 * 0.002), expected, 1e-3 * expected);
  EXPECT_NEAR(texture.mean_height(0, 0).height - texture.mean_height(0.5, 0).height, 0.0004, 1e-12);
}

TEST(Texture, BallHangsBetweenTheRimsOfAGroove) {
  TextureSpec one = spec(Kind::trapezoid, 0.002, 0.0004);
  one.ramp = 1e-7;
  one.ridge = 0.001 - 2e-7;  // the groove is 1 mm wide between its rims
  one.tip_radius = 0.001;
  const double w = 0.001 + 2e-7, r = one.tip_radius;
  // The table's values are 0.49 um apart, and the ball's slope at the rims is 0.58.
  EXPECT_NEAR(-Texture(one).mean_height(0.5, 0).height, r - std::sqrt(r * r - w * w / 4), 3e-7);
}

TEST(Texture, FrameChangesNoHeight) {
  const Pose frame{{0.001, -0.003, 0.002}, glm::normalize(Quat(0.3, 0.5, -0.2, 0.7))};
  for (const Texture& texture : textures()) {
    const Texture seen = texture.in_frame(frame);
    const Vec3 there(0.004, 0.003, -0.001);
    const Vec3 place = frame.orientation * there + frame.position;
    const Vec3 axis(1, 0, 0);
    const PlaneHeight a = texture.mean_height(place, Vec3(0), frame.orientation * axis, axis);
    const PlaneHeight b = seen.mean_height(there, Vec3(0), axis, axis);
    EXPECT_NEAR(a.height, b.height, 1e-12);
    EXPECT_NEAR(a.slope[0], b.slope[0], 1e-8);
    EXPECT_TRUE(texture.same_as(texture));
    EXPECT_FALSE(texture.same_as(seen));
  }
}

TEST(Texture, RidgesAroundAnAxisAreWhole) {
  TextureSpec one = spec(Kind::sine, 0.0021, 0.0004);
  one.around = true;
  const Texture texture(one, 0.02);  // 59.84 periods round it
  EXPECT_DOUBLE_EQ(texture.period(), 2 * std::numbers::pi * 0.02 / 60);
  const Vec3 x(1, 0, 0);
  const auto height = [&](double turn, double r) {
    return texture.mean_height(Vec3(r * std::cos(turn), r * std::sin(turn), 0.01), Vec3(0), x, x)
        .height;
  };
  EXPECT_NEAR(height(0, 0.02), 0, 1e-15);
  EXPECT_NEAR(height(std::numbers::pi / 60, 0.02), -0.0004, 1e-15);
  EXPECT_NEAR(height(std::numbers::pi / 60, 0.005), -0.0001, 1e-15);
}

TEST(Texture, TilesRepeatAndFollowTheirSeeds) {
  for (const Kind kind : {Kind::cones, Kind::noise}) {
    TextureSpec one = spec(kind);
    one.seed = 7;
    if (kind == Kind::cones) one.jitter = 1;
    const Texture texture(one), again(one);
    one.seed = 8;
    const Texture other(one);
    EXPECT_TRUE(texture.same_as(again));
    EXPECT_FALSE(texture.same_as(other));
    const Vec3 x(1, 0, 0), place(0.0123, 0.0045, 0);
    const double side = tile_side(one);
    EXPECT_NEAR(texture.mean_height(place, Vec3(0), x, x).height,
                texture.mean_height(place + Vec3(side, -2 * side, 0.3), Vec3(0), x, x).height,
                1e-12);
  }
}

TEST(Texture, NoiseFillsItsDepth) {
  TextureSpec one = spec(Kind::noise);
  double height = 0;
  const std::vector<double> heights = tile_heights(one, tile_side(one), height);
  const auto [low, high] = std::minmax_element(heights.begin(), heights.end());
  EXPECT_DOUBLE_EQ(*low, -one.depth);
  EXPECT_DOUBLE_EQ(*high, 0);
  EXPECT_EQ(height, 0.032);
}

/// 2 x 1 grey values, 255 and 0.
std::string two_pixels() {
  constexpr std::array<unsigned char, 68> kBytes = {
      137, 80, 78,  71, 13,  10, 26, 10,  0,   0,  0,   13,  73,  72,  68, 82, 0,
      0,   0,  2,   0,  0,   0,  1,  8,   0,   0,  0,   0,   209, 73,  32, 86, 0,
      0,   0,  11,  73, 68,  65, 84, 120, 156, 99, 248, 207, 0,   0,   2,  1,  1,
      0,   50, 186, 43, 146, 0,  0,  0,   0,   73, 69,  78,  68,  174, 66, 96, 130};
  return {kBytes.begin(), kBytes.end()};
}

TEST(Texture, WhiteOfAnImageIsACrest) {
  TextureSpec one = spec(Kind::image);
  one.file_bytes = std::make_shared<const std::string>(two_pixels());
  double height = 0;
  const std::vector<double> heights = tile_heights(one, tile_side(one), height);
  EXPECT_EQ(height, 0.001);
  EXPECT_EQ(heights[10], 0);
  EXPECT_EQ(heights[500], -one.depth);
  one.file_bytes = std::make_shared<const std::string>("no picture");
  EXPECT_THROW(Texture{one}, std::invalid_argument);
  one.file_bytes = nullptr;
  EXPECT_THROW(Texture{one}, std::invalid_argument);
}

TEST(Texture, FlanksThatDoNotFitAreRefused) {
  TextureSpec one = spec(Kind::trapezoid);
  one.ridge = 0.0015;
  one.ramp = 0.0003;
  EXPECT_THROW(Texture{one}, std::invalid_argument);
}

}  // namespace
}  // namespace palpate::stimuli
