// The elements of a picture, without drawing it.

#include "runner/display/scene/scene_drawing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <random>

#include "rendering/contact.h"
#include "rendering/renderer.h"
#include "runner/display/scene/camera.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"

namespace palpate::runner::display {
namespace {

using rendering::LineProbe;

rendering::SceneObject object_of(const stimuli::PolygonSoup& soup, const Vec3& at, int index,
                                 double stiffness = 800) {
  rendering::SceneObject out{std::make_shared<const stimuli::ConvexMesh>(soup),
                             {at, Quat(1, 0, 0, 0)},
                             {},
                             index,
                             nullptr};
  out.material.stiffness = stiffness;
  return out;
}

TEST(DrawnMeshTest, RoundSurfacesAreSmoothAndBoxesAreNot) {
  stimuli::ObjectSpec ball;
  ball.radius = 0.02;
  ball.subdivisions = 3;
  for (const DrawnVertex& corner : triangles_of(ball))
    EXPECT_GT(glm::dot(corner.normal, glm::normalize(corner.position)), 0.999F);
  stimuli::ObjectSpec cube;
  cube.shape = stimuli::ShapeKind::cube;
  for (const DrawnVertex& corner : triangles_of(cube)) {
    const glm::vec3 n = glm::abs(corner.normal);
    EXPECT_NEAR(std::max({n.x, n.y, n.z}), 1, 1e-6);
  }
}

TEST(DrawnMeshTest, ALineMeetsASphereWhereItEntersIt) {
  stimuli::ObjectSpec ball;
  ball.radius = 0.05;
  ball.subdivisions = 5;
  const DrawnMesh mesh = triangles_of(ball);
  const auto distance = distance_to(mesh, {0.01F, 0.02F, 1}, {0, 0, -1});
  ASSERT_TRUE(distance);
  EXPECT_NEAR(*distance, 1 - std::sqrt(0.05 * 0.05 - 0.01 * 0.01 - 0.02 * 0.02), 1e-4);
  EXPECT_FALSE(distance_to(mesh, {0.06F, 0, 1}, {0, 0, -1}));
  EXPECT_FALSE(distance_to(mesh, {0, 0, 0}, {0, 0, -1})) << "from inside there is no entry";
}

TEST(CameraTest, FittedPointsAreInThePictureAndFillIt) {
  constexpr std::uint32_t kSeed = 7;
  std::mt19937 generator(kSeed);
  std::uniform_real_distribution<float> any(-1, 1);
  for (int k = 0; k < 200; ++k) {
    Camera camera;
    camera.resize(640, k % 2 == 0 ? 360 : 900);
    camera.look_from(3 * any(generator), 1.4F * any(generator));
    std::vector<glm::vec3> points;
    points.reserve(12);
    const float size = std::pow(10.0F, any(generator));
    for (int i = 0; i < 12; ++i)
      points.emplace_back(size * any(generator), 2 * size * any(generator),
                          0.3F * size * any(generator) + 1);
    camera.fit(points);
    glm::vec2 low(1e9F), high(-1e9F);
    for (const glm::vec3& point : points) {
      low = glm::min(low, camera.project(point));
      high = glm::max(high, camera.project(point));
    }
    const float height = k % 2 == 0 ? 360 : 900;
    EXPECT_GE(low.x, 0);
    EXPECT_GE(low.y, 0);
    EXPECT_LE(high.x, 640);
    EXPECT_LE(high.y, height);
    EXPECT_GT(std::max((high.x - low.x) / 640, (high.y - low.y) / height), 0.8F);
  }
}

TEST(CameraTest, UnprojectIsTheInverseOfProject) {
  Camera camera;
  camera.resize(300, 200);
  camera.look_from(0.7F, -0.3F);
  camera.pan({20, -30});
  const glm::vec3 point(0.03F, -0.02F, 0.05F);
  EXPECT_LT(glm::distance(camera.unproject(camera.project(point), point), point), 1e-5F);
}

/// The forces at the places sum to the force on the hand, whatever the scene.
TEST(ContactPlacesTest, TheirForcesSumToTheForceOnTheHand) {
  const auto check = [](const rendering::Scene& scene, const std::vector<LineProbe>& path,
                        int least) {
    rendering::RenderState state = scene.initial_state();
    int most = 0;
    for (const LineProbe& probe : path) {
      const rendering::Rendering r = rendering::ray_renderer().tick(scene, state, probe, 0.001);
      const auto places = contact_places(scene, state, r);
      EXPECT_EQ(static_cast<int>(places.size()), r.contacts);
      Vec3 sum(0), torque(0);
      for (const servo::ContactPlace& place : places) {
        sum += place.force;
        torque += glm::cross(place.place - probe.tip, place.force);
      }
      EXPECT_LT(glm::distance(sum, r.force), 1e-12);
      EXPECT_LT(glm::distance(torque, r.torque), 1e-12);
      most = std::max(most, r.contacts);
    }
    EXPECT_GE(most, least);
  };
  std::vector<LineProbe> path;
  for (double y = 0.04; y > 0.022; y -= 0.0005)
    path.push_back({{-0.06, y, 0}, {0.07, y + 0.001, 0}});
  check(rendering::Scene({object_of(stimuli::cube(0.05), {0, 0, 0}, 0)}), path, 1);
  check(rendering::Scene({object_of(stimuli::cube(0.05), {-0.04, 0, 0}, 0),
                          object_of(stimuli::icosphere(0.025, 3), {0.04, 0, 0}, 1)}),
        path, 2);
  check(rendering::Scene({object_of(stimuli::cube(0.05), {-0.025, 0, 0}, 0),
                          object_of(stimuli::box({0.05, 0.049, 0.03}), {0.025, 0, 0}, 0, 500)}),
        path, 1);
}

TEST(TorqueTest, DevicesEqualContactsExceptTorsion) {
  const rendering::Scene scene({object_of(stimuli::cube(0.05), {0, 0, 0}, 0)});
  rendering::RenderState state = scene.initial_state();
  SceneMoment moment;
  for (double y = 0.04; y > 0.023; y -= 0.0005) {
    moment.sample.probe = {{0.0, y, 0.01}, {0.09, y + 0.06, 0.02}};
    moment.sample.rendering =
        rendering::ray_renderer().tick(scene, state, moment.sample.probe, 0.001);
  }
  const rendering::Rendering& r = moment.sample.rendering;
  ASSERT_GT(r.contacts, 0);
  moment.sample.device1 = r.device1;
  moment.sample.device2 = r.device2;
  const LineProbe& probe = moment.sample.probe;
  const Vec3 hand = 0.5 * (probe.tip + probe.tail), axis = glm::normalize(probe.tail - probe.tip);
  const Vec3 whole = r.torque + glm::cross(probe.tip - hand, r.force);
  EXPECT_LT(glm::distance(torque_on_hand(moment), whole - glm::dot(whole, axis) * axis), 1e-12);
}

TEST(TorqueTest, TheArcIsProportionalAndItsScaleIsStated) {
  stimuli::ObjectSpec ball;
  ball.radius = 0.03;
  const SceneDrawing drawing({ball}, {});
  SceneMoment moment;
  moment.sample.probe = {{0, 0, 0}, {0.2, 0, 0}};
  const auto sweep = [&](double newton, const SceneDrawingSettings& looks) {
    moment.sample.device1 = {0, 0, -newton};  // 0.1 m from the middle, like the other
    moment.sample.device2 = {0, 0, newton};
    const ScenePicture picture = drawing.picture(moment, light_theme(), looks);
    return picture.turns.empty() ? 0 : picture.turns[0].sweep;
  };
  const SceneDrawingSettings looks{.radians_per_newton_metre = 10};
  EXPECT_NEAR(sweep(1, looks), 2, 1e-5);  // 0.2 N m
  EXPECT_NEAR(sweep(0.5, looks), 1, 1e-5);
  EXPECT_EQ(sweep(0.0001, looks), 0) << "too small to be seen";
  EXPECT_LT(sweep(100, looks), 6) << "no more than a turn";
  // The largest torque of a device, 6 N at the ends of a stylus of 0.12 m, is about half a turn.
  moment.sample.probe.tail = {0.12, 0, 0};
  EXPECT_NEAR(sweep(3, {}), 2.9, 0.3);
  const auto [arrow, turn] =
      drawing.scale_words({.metres_per_newton = 0.01, .radians_per_newton_metre = 10});
  EXPECT_EQ(arrow, "2 N: 20 mm");
  EXPECT_EQ(turn, "500 mN m: 286 degrees");
}

TEST(SceneDrawingTest, ALabelStandsJustAboveItsObject) {
  stimuli::ObjectSpec plate;
  plate.shape = stimuli::ShapeKind::box;
  plate.size = {0.3, 0.3, 0.02};
  plate.pose.position = {0.1, 0, 0.05};
  const SceneDrawing drawing({plate}, {});
  const ScenePicture picture = drawing.picture({}, light_theme(), {.labels = true});
  ASSERT_EQ(picture.labels.size(), 1U);
  EXPECT_NEAR(picture.labels[0].at.x, 0.1, 1e-6);
  EXPECT_NEAR(picture.labels[0].at.z, 0.06 + 0.06 * drawing.size(), 1e-6);
}

TEST(SceneDrawingTest, LayersLieInsideOfATranslucentSkin) {
  stimuli::ObjectSpec spec;
  spec.pose.position = {0.01, 0.02, 0.03};
  rendering::SceneObject surface = object_of(stimuli::icosphere(0.03, 3), spec.pose.position, 0);
  rendering::SceneObject layer = object_of(stimuli::icosphere(0.02, 3), spec.pose.position, 0);
  layer.layer = 1;
  SceneDrawing drawing({spec}, {});
  const ScenePicture before = drawing.picture({}, light_theme(), {});
  ASSERT_EQ(before.objects.size(), 1U);
  EXPECT_EQ(before.objects[0].opacity, 1);
  drawing.add_compiled(rendering::Scene({surface, layer}));
  const ScenePicture after = drawing.picture({}, light_theme(), {});
  ASSERT_EQ(after.objects.size(), 2U);
  EXPECT_LT(after.objects[0].opacity, 1);
  EXPECT_EQ(after.objects[1].layer, 1);
  for (const DrawnVertex& corner : *after.objects[1].mesh) {
    const glm::vec4 world = after.objects[1].place * glm::vec4(corner.position, 1);
    EXPECT_NEAR(glm::distance(glm::vec3(world), glm::vec3(spec.pose.position)), 0.02, 1e-6);
  }
}

TEST(SceneDrawingTest, AMovedObjectIsDrawnAndHitWhereItIs) {
  stimuli::ObjectSpec spec;
  spec.radius = 0.02;
  const SceneDrawing drawing({spec}, {});
  SceneMoment moment;
  moment.poses = {{{0.1, 0, 0}, Quat(1, 0, 0, 0)}};
  const ScenePicture picture = drawing.picture(moment, light_theme(), {});
  EXPECT_NEAR(picture.objects[0].place[3].x, 0.1, 1e-6);
  EXPECT_FALSE(drawing.hit({0, 0, 1}, {0, 0, -1}, moment.poses));
  const auto hit = drawing.hit({0.1F, 0, 1}, {0, 0, -1}, moment.poses);
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->place.z, 0.02, 1e-4);
  EXPECT_TRUE(drawing.hit({0, 0, 1}, {0, 0, -1}));
}

}  // namespace
}  // namespace palpate::runner::display
