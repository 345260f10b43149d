// Up in the world is up in the picture, and the stylus follows the pointer. The tests check drawn
// pixels, not the camera's own projection. The view of a live session has the same camera, ground
// and light (runner/display/scene_view.h).

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "runner/devices/mouse.h"
#include "runner/display/scene/painter.h"
#include "runner/display/scene/scene_drawing.h"
#include "runner/display/scene_view.h"

namespace palpate::runner::display {
namespace {

constexpr int kAcross = 320, kTall = 240;
constexpr double kStylus = 0.12;  // m

using Wanted = bool (*)(int red, int green, int blue);

bool blue_ball(int red, int, int blue) { return blue > red + 25; }
bool dark_stylus(int red, int green, int blue) { return red + green + blue < 330; }

class UprightPictureTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { painter_ = make_painter(kAcross, kTall); }
  static void TearDownTestSuite() { painter_.reset(); }
  void SetUp() override { camera_.resize(kAcross, kTall); }

  /// Mean column and row of the pixels of a colour; none: fewer than 20.
  std::optional<glm::vec2> middle_of(const ScenePicture& picture, Wanted wanted) {
    painter_->draw(picture, camera_, light_theme());
    const auto* pixel = reinterpret_cast<const unsigned char*>(painter_->pixels().data());
    glm::vec2 sum(0);
    int count = 0;
    for (int row = 0; row < kTall; ++row) {
      for (int column = 0; column < kAcross; ++column, pixel += 3) {
        if (!wanted(pixel[0], pixel[1], pixel[2])) continue;
        sum += glm::vec2(column, row);
        ++count;
      }
    }
    if (count < 20) return std::nullopt;
    return sum / static_cast<float>(count);
  }

  static SceneDrawing one_ball(const Vec3& at) {
    stimuli::ObjectSpec spec;
    spec.radius = 0.02;
    spec.pose.position = at;
    return SceneDrawing({spec}, {});
  }
  /// Without a stylus, which would hide the objects.
  static ScenePicture bare(const SceneDrawing& drawing, const SceneMoment& moment = {}) {
    ScenePicture out = drawing.picture(moment, light_theme(), {});
    out.rods.clear();
    out.balls.clear();
    out.grid = 0;
    return out;
  }

  static std::unique_ptr<ScenePainter> painter_;
  Camera camera_;
};
std::unique_ptr<ScenePainter> UprightPictureTest::painter_;

// World frame: x right, y away from the user, z up.
TEST_F(UprightPictureTest, TheAxesOfTheWorldPointAsDocumented) {
  camera_.look_from(0, 0.5F);
  const auto seen_at = [&](const Vec3& at) {
    SceneMoment moment;
    moment.poses = {{at, Quat(1, 0, 0, 0)}};
    const auto middle = middle_of(bare(one_ball({0, 0, 0}), moment), blue_ball);
    EXPECT_TRUE(middle);
    return middle.value_or(glm::vec2(0));
  };
  const glm::vec2 here = seen_at({0, 0, 0});
  const glm::vec2 right = seen_at({0.04, 0, 0}) - here;
  EXPECT_GT(right.x, 20);
  EXPECT_NEAR(right.y, 0, 2);
  const glm::vec2 above = seen_at({0, 0, 0.04}) - here;
  EXPECT_NEAR(above.x, 0, 2);
  EXPECT_LT(above.y, -20);
  const glm::vec2 away = seen_at({0, 0.04, 0}) - here;
  EXPECT_NEAR(away.x, 0, 2);
  EXPECT_LT(away.y, -5) << "what is farther away is seen higher, from above";
}

TEST_F(UprightPictureTest, UpIsUpFromEverySide) {
  for (const float yaw : {-2.5F, -1.0F, 0.0F, 0.6F, 1.6F, 3.0F}) {
    for (const float pitch : {-1.2F, 0.0F, 0.4F, 1.2F}) {
      camera_.look_from(yaw, pitch);
      const auto low = middle_of(bare(one_ball({0, 0, -0.02})), blue_ball);
      const auto high = middle_of(bare(one_ball({0, 0, 0.03})), blue_ball);
      ASSERT_TRUE(low && high) << yaw << ' ' << pitch;
      EXPECT_LT(high->y, low->y - 5) << yaw << ' ' << pitch;
      EXPECT_NEAR(high->x, low->x, 2) << yaw << ' ' << pitch;
    }
  }
}

TEST_F(UprightPictureTest, TheGroundAndItsShadowsLieBelowTheObjects) {
  // A ball, and another high above it: the ground touches the lower one's lowest point.
  stimuli::ObjectSpec low, high;
  low.radius = high.radius = 0.02;
  low.pose.position = {0.03, 0, 0.01};
  high.pose.position = {-0.03, 0, 0.05};
  const SceneDrawing drawing({low, high}, {});
  ScenePicture picture = bare(drawing);
  EXPECT_NEAR(picture.ground, -0.01, 1e-4);
  // Hovering objects are drawn above the world's floor, unless it is far away.
  EXPECT_EQ(bare(one_ball({0, 0, 0.035})).ground, 0);
  EXPECT_NEAR(bare(one_ball({0, 0, 0.3})).ground, 0.28, 1e-4);
  camera_.look_from(0.3F, 0.5F);
  const auto brightness = [&](const glm::vec3& place) {
    const glm::vec2 pixel = camera_.project(place);
    const auto* const p = reinterpret_cast<const unsigned char*>(painter_->pixels().data()) +
                          3 * (static_cast<int>(pixel.y) * kAcross + static_cast<int>(pixel.x));
    return static_cast<int>(p[1]);
  };
  painter_->draw(picture, camera_, light_theme());
  const int under = brightness({0.03F, -0.012F, -0.01F}),
            open = brightness({0.03F, -0.08F, -0.01F});
  EXPECT_LT(under + 15, open) << "the shadow under the ball";
}

/// Place at which the stylus is drawn once the device has followed the pointer.
class PointerOnScreenTest : public UprightPictureTest {
 protected:
  std::optional<glm::vec2> stylus_after(PointerControl& control, devices::MouseStylus& device,
                                        const PointerMotion& pointer) {
    control.step(pointer, camera_,
                 [](const glm::vec3&, const glm::vec3&) { return std::optional<glm::vec3>(); });
    SceneMoment moment;
    for (int tick = 0; tick < 3000; ++tick) moment.sample.probe = device.read().stylus;
    ScenePicture picture = drawing_.picture(moment, light_theme(), {});
    picture.objects.clear();
    picture.grid = 0;
    picture.caption.clear();
    // The tip's end only: the tail is often outside the picture.
    for (DrawnRod& rod : picture.rods) {
      rod.to = rod.from + 0.1F * (rod.to - rod.from);
      rod.radius = 0.004F;
    }
    return middle_of(picture, dark_stylus);
  }

  SceneDrawing drawing_ = one_ball({0, 0, 0});
};

TEST_F(PointerOnScreenTest, StylusFollowsThePointer) {
  for (const float yaw : {-2.2F, 0.0F, 0.5F, 1.6F}) {
    for (const float pitch : {0.0F, 0.4F, 1.0F}) {
      camera_.look_from(yaw, pitch);
      devices::MouseStylus device(kStylus, 1000);
      PointerControl control(device, WorkspaceMap());
      PointerMotion pointer;
      pointer.over = true;
      const auto go_to = [&](const glm::vec2& at) {
        pointer.moved = at - pointer.at;
        pointer.at = at;
        return stylus_after(control, device, pointer);
      };
      const auto start = go_to({160, 120}), up = go_to({160, 80}), right = go_to({210, 80});
      ASSERT_TRUE(start && up && right) << yaw << ' ' << pitch;
      EXPECT_NEAR(up->y - start->y, -40, 8) << yaw << ' ' << pitch;
      EXPECT_NEAR(up->x - start->x, 0, 8) << yaw << ' ' << pitch;
      EXPECT_NEAR(right->x - up->x, 50, 10) << yaw << ' ' << pitch;
      EXPECT_NEAR(right->y - up->y, 0, 8) << yaw << ' ' << pitch;
    }
  }
}

}  // namespace
}  // namespace palpate::runner::display
