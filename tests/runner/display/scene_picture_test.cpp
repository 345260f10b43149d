// Pictures of scenes without a display: expected parts are checked at their projected places.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>

#include "runner/display/scene/painter.h"
#include "runner/display/scene/picture.h"
#include "runner/display/scene/scene_drawing.h"
#include "tests/runner/display/kept_fonts.h"

namespace palpate::runner::display {
namespace {

constexpr int kWide = 400, kHigh = 300;

struct Rgb {
  int r = 0, g = 0, b = 0;
};
int difference(const Rgb& a, const Rgb& b) {
  return std::abs(a.r - b.r) + std::abs(a.g - b.g) + std::abs(a.b - b.b);
}
bool reddish(const Rgb& c) { return c.r > c.g + 60 && c.r > c.b + 60; }
bool orange(const Rgb& c) { return c.r > c.b + 60 && c.g > c.b + 20 && c.r > c.g + 25; }
bool bluish(const Rgb& c) { return c.b > c.r + 25; }

/// Draws, and returns the pixel at a point of the scene.
class ScenePictureTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    try {
      painter_ = make_painter(kWide, kHigh);
    } catch (const DisplayError& error) {
      reason_ = error.what();
    }
  }
  static void TearDownTestSuite() { painter_.reset(); }
  void SetUp() override {
    ASSERT_NE(painter_, nullptr) << reason_;
    camera_.resize(kWide, kHigh);
  }

  const std::string& draw(const ScenePicture& picture) {
    painter_->draw(picture, camera_, light_theme());
    return painter_->pixels();
  }
  Rgb at(int x, int y) const {
    if (x < 0 || y < 0 || x >= kWide || y >= kHigh) return {};
    const auto* const p =
        reinterpret_cast<const unsigned char*>(painter_->pixels().data()) + 3 * (y * kWide + x);
    return {p[0], p[1], p[2]};
  }
  Rgb seen(const glm::vec3& point) const {
    const glm::vec2 pixel = camera_.project(point);
    return at(static_cast<int>(pixel.x), static_cast<int>(pixel.y));
  }
  int count(bool (*is)(const Rgb&)) const {
    int out = 0;
    for (int y = 0; y < kHigh; ++y)
      for (int x = 0; x < kWide; ++x) out += is(at(x, y)) ? 1 : 0;
    return out;
  }

  static stimuli::ObjectSpec ball(const Vec3& at, double radius) {
    stimuli::ObjectSpec spec;
    spec.radius = radius;
    spec.pose.position = at;
    return spec;
  }
  static SceneMoment touching(const Vec3& ideal, const Vec3& by) {
    SceneMoment moment;
    moment.sample.probe = {ideal + by, ideal + by + Vec3(0, 0, 0.12)};
    moment.sample.rendering.ideal = {ideal, ideal + Vec3(0, 0, 0.12)};
    moment.sample.rendering.contacts = 1;
    moment.sample.device1 = Vec3(0, 0, 2);
    moment.contacts.push_back({ideal, {0, 0, 2}});
    return moment;
  }
  static SceneMoment away() {
    SceneMoment moment;
    moment.sample.probe = {{0.3, 0, 0.3}, {0.3, 0, 0.4}};
    return moment;
  }

  static std::unique_ptr<ScenePainter> painter_;
  static std::string reason_;
  Camera camera_;
};
std::unique_ptr<ScenePainter> ScenePictureTest::painter_;
std::string ScenePictureTest::reason_;

TEST_F(ScenePictureTest, AnObjectIsSeenWhereItIsProjected) {
  const SceneDrawing drawing({ball({0.05, 0, 0}, 0.02), ball({-0.05, 0, 0}, 0.02)}, {});
  draw(drawing.picture(away(), light_theme(), {}));
  EXPECT_TRUE(bluish(seen({0.05, 0, 0})));
  EXPECT_FALSE(bluish(seen({-0.05, 0, 0}))) << "the second has another colour";
  EXPECT_GT(difference(seen({-0.05, 0, 0}), seen({0, 0, 0.03})), 60) << "nothing between them";
  camera_.orbit(static_cast<float>(M_PI), 0);
  draw(drawing.picture(away(), light_theme(), {}));
  EXPECT_TRUE(bluish(seen({0.05, 0, 0})));
  camera_.pan({80, 0});
  draw(drawing.picture(away(), light_theme(), {}));
  EXPECT_TRUE(bluish(seen({0.05, 0, 0}))) << "moved with the camera";
}

TEST_F(ScenePictureTest, OnlyNonzeroForcesHaveArrows) {
  const SceneDrawing drawing({ball({0, 0, 0}, 0.03)}, {});
  draw(drawing.picture(away(), light_theme(), {}));
  EXPECT_EQ(count(reddish), 0);
  // From the ball's right, where nothing hides it.
  SceneMoment moment = touching({0.03, 0, 0}, {-0.002, 0, 0});
  moment.contacts[0].force = {2, 0, 0};
  draw(drawing.picture(moment, light_theme(), {.metres_per_newton = 0.02}));
  EXPECT_TRUE(reddish(seen({0.05, 0, 0})));
  EXPECT_FALSE(reddish(seen({0.08, 0, 0}))) << "2 N are 40 mm here";
}

TEST_F(ScenePictureTest, TheVirtualToolIsVisibleInsideTheObject) {
  const SceneDrawing drawing({ball({0, 0, 0}, 0.03)}, {});
  draw(drawing.picture(away(), light_theme(), {}));
  EXPECT_EQ(count(orange), 0);
  const SceneMoment moment = touching({0, 0, 0.03}, {0, 0, -0.03});
  ScenePicture picture = drawing.picture(moment, light_theme(), {});
  picture.arrows.clear();
  picture.turns.clear();
  camera_.zoom(3);
  draw(picture);
  EXPECT_TRUE(orange(seen({0, 0, 0.01})));
}

TEST_F(ScenePictureTest, EverySegmentOfTheToolIsDrawn) {
  rendering::Tool tool;
  tool.segments = {
      {{0, 0, 0}, {0, 0, 0.1}}, {{0, 0, 0.1}, {0.03, 0, 0.08}}, {{0, 0, 0}, {-0.03, 0, 0.02}}};
  const SceneDrawing drawing({ball({0, 0, -0.1}, 0.07)}, tool);
  SceneMoment moment;
  moment.sample.probe = {{0, 0, 0}, {0, 0, 0.05}};
  moment.sample.rendering.ideal_side = {1, 0, 0};
  draw(drawing.picture(moment, light_theme(), {}));
  const auto dark = [](const Rgb& c) { return c.r + c.g + c.b < 330; };
  // +z of the stylus is up, +x to the right.
  EXPECT_TRUE(dark(seen({0, 0, 0.07})));
  EXPECT_TRUE(dark(seen({0.015, 0, 0.09})));
  EXPECT_TRUE(dark(seen({-0.015, 0, 0.01})));
  EXPECT_FALSE(dark(seen({0.015, 0, 0.01})));
}

TEST_F(ScenePictureTest, PartsInsideATranslucentObjectAreVisible) {
  SceneDrawing drawing({ball({0, 0, 0}, 0.03)}, {});
  ScenePicture picture = drawing.picture(away(), light_theme(), {});
  picture.objects[0].opacity = 0.25F;
  draw(picture);
  const Rgb empty = seen({0, 0, 0});
  DrawnObject core = picture.objects[0];
  core.place[0][0] = core.place[1][1] = core.place[2][2] = 0.5F;
  core.colour = {0.8F, 0.2F, 0.1F};
  core.opacity = 0.6F;
  core.layer = 1;
  picture.objects.push_back(core);
  draw(picture);
  EXPECT_TRUE(reddish(seen({0, 0, 0})));
  EXPECT_FALSE(reddish(empty));
}

TEST_F(ScenePictureTest, ACutRemovesPartsBehindThePlane) {
  const SceneDrawing drawing({ball({0, 0, 0}, 0.03)}, {});
  ScenePicture picture = drawing.picture(away(), light_theme(), {});
  picture.cut = glm::vec4(-1, 0, 0, 0);  // x < 0 remains
  draw(picture);
  EXPECT_TRUE(bluish(seen({-0.02, 0, 0})));
  picture.cut = glm::vec4(0, 0, 0, -1);  // nothing remains
  draw(picture);
  EXPECT_FALSE(bluish(seen({-0.02, 0, 0})));
}

TEST_F(ScenePictureTest, ThingsCastShadows) {
  const SceneDrawing drawing({ball({0, 0, 0}, 0.03)}, {});
  ScenePicture picture = drawing.picture(away(), light_theme(), {});
  picture.grid = 0;
  draw(picture);
  const glm::vec3 under(0.02, 0.02, -0.03), far(-0.08, -0.05, -0.03);
  EXPECT_LT(seen(under).g + 25, seen(far).g);
  picture.objects.clear();
  draw(picture);
  EXPECT_NEAR(seen(under).g, seen(far).g, 12);
}

TEST_F(ScenePictureTest, TheSameSceneGivesTheSamePixels) {
  const SceneDrawing drawing({ball({0, 0, 0}, 0.03)}, {});
  const SceneMoment moment = touching({0, 0, 0.03}, {0, 0, -0.01});
  const std::string first = draw(drawing.picture(moment, light_theme(), {.labels = true}));
  draw(drawing.picture(away(), light_theme(), {}));
  EXPECT_NE(first, painter_->pixels());
  EXPECT_EQ(first, draw(drawing.picture(moment, light_theme(), {.labels = true})));
}

TEST_F(ScenePictureTest, LabelsAreWritten) {
  const SceneDrawing drawing({ball({0, 0, 0}, 0.03)}, {});
  const std::string without = draw(drawing.picture(away(), light_theme(), {}));
  EXPECT_NE(without, draw(drawing.picture(away(), light_theme(), {.labels = true})));
}

TEST_F(ScenePictureTest, NotANumberIsNotDrawn) {
  const SceneDrawing drawing({ball({0, 0, 0}, 0.03)}, {});
  SceneMoment moment = touching({0, 0, 0.03}, {0, 0, -0.01});
  moment.sample.probe.tip.x = moment.contacts[0].place.z = std::nan("");
  moment.sample.device1.y = INFINITY;
  draw(drawing.picture(moment, light_theme(), {}));
  EXPECT_TRUE(bluish(seen({0, 0, 0})));
  EXPECT_EQ(count(reddish), 0);
}

TEST_F(ScenePictureTest, FilesHaveTheirMagicBytes) {
  const SceneDrawing drawing({ball({0, 0, 0}, 0.03)}, {});
  draw(drawing.picture(away(), light_theme(), {}));
  EXPECT_EQ(painter_->png().substr(1, 3), "PNG");
  painter_->add_to_animation(0);
  draw(drawing.picture(touching({0, 0, 0.03}, {0, 0, 0}), light_theme(), {}));
  painter_->add_to_animation(0.1);
  const std::string webp = painter_->animation(0.2);
  EXPECT_EQ(webp.substr(0, 4), "RIFF");
  EXPECT_NE(webp.find("ANIM"), std::string::npos);
}

}  // namespace
}  // namespace palpate::runner::display
