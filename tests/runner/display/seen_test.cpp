// The participant's view beside touch, against the geometry of the station.

#include "runner/display/seen.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "runner/participants/seen_record.h"

namespace palpate::runner::display {
namespace {

constexpr double kWidth = 1280, kHeight = 800;

/// A screen that leans back, off centre, and a scale of the workspace.
SeenTrial trial() {
  SeenTrial out;
  out.view.lower_left = {-0.30, 0.20, -0.15};
  out.view.lower_right = {0.22, 0.25, -0.15};
  const Vec3 across = out.view.lower_right - out.view.lower_left;
  const Vec3 up = glm::normalize(glm::cross(Vec3(0.05, -0.5, 0.1), across));
  out.view.upper_left = out.view.lower_left + 0.325 * (up.z > 0 ? up : -up);
  out.view.eye = {0.05, -0.45, 0.12};
  out.object.shape = stimuli::ShapeKind::cube;
  out.object.edge = 0.05;
  out.seen.object = out.seen.tool = true;
  out.workspace.centre = {0.01, 0.02, -0.03};
  out.workspace.scale = 2;
  return out;
}

/// px, from the upper left corner, of where the line from an eye through a point meets the screen.
glm::dvec2 meets_screen(const SeenTrial& trial, const Vec3& eye, const Vec3& point) {
  const protocols::ViewSpec& view = trial.view;
  const Vec3 x = view.lower_right - view.lower_left, y = view.upper_left - view.lower_left;
  const Vec3 normal = glm::cross(x, y);
  const double share = glm::dot(view.lower_left - eye, normal) / glm::dot(point - eye, normal);
  const Vec3 at = eye + share * (point - eye) - view.lower_left;
  return {glm::dot(at, x) / glm::dot(x, x) * kWidth,
          (1 - glm::dot(at, y) / glm::dot(y, y)) * kHeight};
}

Camera camera_of(const SeenTrial& trial, double right = 0) {
  Camera camera;
  camera.resize(kWidth, kHeight);
  camera.look_through(window_of(trial, right));
  return camera;
}

TEST(Seen, PointLiesWhereItsLineMeetsTheScreen) {
  const SeenTrial seen = trial();
  const Vec3 across = glm::normalize(seen.view.lower_right - seen.view.lower_left);
  for (const double right : {0.0, -0.03, 0.03}) {
    const Camera camera = camera_of(seen, right);
    for (const Vec3& device :
         {Vec3(0, 0, 0), Vec3(0.05, 0.1, -0.04), Vec3(-0.08, -0.1, 0.06), Vec3(0.1, 0.5, 0.1)}) {
      const glm::vec2 drawn = camera.project(glm::vec3(seen.workspace.to_virtual(device)));
      const glm::dvec2 expected = meets_screen(seen, seen.view.eye + right * across, device);
      EXPECT_NEAR(drawn.x, expected.x, 0.01);
      EXPECT_NEAR(drawn.y, expected.y, 0.01);
    }
  }
}

TEST(Seen, DisparityFollowsTheDepthBehindTheScreen) {
  SeenTrial seen;
  seen.view.lower_left = {-0.2, 0, -0.1};
  seen.view.lower_right = {0.2, 0, -0.1};
  seen.view.upper_left = {-0.2, 0, 0.1};
  seen.view.eye = {0, -0.5, 0};
  const double ipd = 0.06, pixel = 0.4 / kWidth;
  for (const double behind : {-0.1, 0.0, 0.1, 0.3}) {
    const glm::vec3 point(0, static_cast<float>(behind), 0);
    const double left = camera_of(seen, -ipd / 2).project(point).x,
                 right = camera_of(seen, ipd / 2).project(point).x;
    EXPECT_NEAR((right - left) * pixel, ipd * behind / (0.5 + behind), 1e-5) << behind;
  }
}

SeenMoment moment(std::int64_t time_ns, const Vec3& tip) {
  SeenMoment out;
  out.time_ns = time_ns;
  out.hand = out.ideal = {tip, tip + Vec3(0, 0, 0.12)};
  out.forces = true;
  return out;
}

TEST(Seen, ToolFollowsGainOffsetAndSurface) {
  SeenTrial seen = trial();
  seen.seen.tool_gain = 1.5;
  seen.seen.tool_offset = {0.01, 0, -0.02};
  SeenMoment at = moment(0, {0.02, -0.01, 0.03});
  const DrawnTool free = drawn_tool(seen, at);
  EXPECT_NEAR(glm::distance(free.stylus.tip, Vec3(0.04, -0.015, 0.025)), 0, 1e-12);
  EXPECT_NEAR(glm::distance(free.stylus.tip, free.stylus.tail), 0.12, 1e-12);
  // In contact it stops at the surface, unless it is drawn where the hand is.
  at.touching = true;
  at.ideal = {at.hand.tip + Vec3(0, 0, 0.002), at.hand.tail + Vec3(0, 0, 0.002)};
  EXPECT_NEAR(drawn_tool(seen, at).stylus.tip.z, 1.5 * 0.032 - 0.02, 1e-12);
  seen.seen.tool_stops = false;
  EXPECT_NEAR(drawn_tool(seen, at).stylus.tip.z, 1.5 * 0.03 - 0.02, 1e-12);
  // Seen compliance: it goes in by force over the seen stiffness.
  seen.seen.tool_gain = 1;
  seen.seen.tool_offset = Vec3(0);
  seen.seen.give_stiffness = 400;
  at.pressing = 1.6;
  EXPECT_NEAR(drawn_tool(seen, at).stylus.tip.z, 0.032 - 0.004, 1e-12);
}

TEST(Seen, ObjectTakesSizeOffsetAndTurn) {
  SeenTrial seen = trial();
  seen.seen.size_ratio = 1.2;
  seen.seen.offset = {0, 0, 0.01};
  seen.seen.turn_deg = 90;
  seen.seen.axis = {0, 0, 1};
  const SeenScene scene(std::make_shared<const SeenTrial>(seen));
  const ScenePicture picture = scene.picture(moment(0, {0, 0, 0.1}), 0);
  ASSERT_EQ(picture.objects.size(), 1U);
  ASSERT_EQ(picture.rods.size(), 1U);
  EXPECT_TRUE(picture.arrows.empty() && picture.balls.empty() && picture.labels.empty());
  glm::vec3 low(1), high(-1);
  for (const DrawnVertex& corner : *picture.objects[0].mesh) {
    const glm::vec3 at(picture.objects[0].place * glm::vec4(corner.position, 1));
    low = glm::min(low, at);
    high = glm::max(high, at);
  }
  EXPECT_NEAR(high.x - low.x, 0.06, 1e-6);
  EXPECT_NEAR(high.z, 0.04, 1e-6);
  const Pose pose = drawn_pose(seen, 0);
  EXPECT_NEAR(glm::distance(pose.orientation * Vec3(1, 0, 0), Vec3(0, 1, 0)), 0, 1e-12);
}

TEST(Seen, SurfaceGivesWayUnderTheTip) {
  SeenTrial seen = trial();
  seen.seen.give_stiffness = 500;
  const SeenScene scene(std::make_shared<const SeenTrial>(seen));
  SeenMoment at = moment(0, {0, 0, 0.023});
  at.touching = true;
  at.contact = {0, 0, 0.025};
  at.normal = {0, 0, 1};
  at.pressing = 2;
  const auto lowest_of_top = [&](const ScenePicture& picture) {
    float lowest = 1;
    for (const DrawnVertex& corner : *picture.objects[0].mesh) {
      if (std::hypot(corner.position.x, corner.position.y) < 0.002F && corner.position.z > 0)
        lowest = std::min(lowest, corner.position.z);
    }
    return lowest;
  };
  EXPECT_NEAR(lowest_of_top(scene.picture(at, 0)), 0.025 - 0.004, 5e-4);
  at.touching = false;
  EXPECT_NEAR(lowest_of_top(scene.picture(at, 0)), 0.025, 1e-6);
}

TEST(Seen, TrailIsLinearBetweenTicks) {
  SeenTrail trail;
  EXPECT_FALSE(trail.at(0));
  for (int i = 0; i <= 2000; ++i) trail.add(moment(i * 1'000'000, {1e-3 * i, 0, 0}));
  EXPECT_NEAR(trail.at(1'500'300'000)->hand.tip.x, 1.5003, 1e-12);
  EXPECT_EQ(trail.at(5'000'000'000)->hand.tip.x, 2);
  EXPECT_NEAR(trail.at(0)->hand.tip.x, 0.9, 1e-9);  // only the last 1.1 s are kept
  trail.clear();
  EXPECT_FALSE(trail.newest());
}

TEST(Seen, IsVisibleWhenTheProtocolSays) {
  using When = protocols::SeenSpec::When;
  servo::Sample sample;
  sample.phase = servo::Phase::homing;
  const SeenMoment homing = moment_of(sample, nullptr);
  sample.phase = servo::Phase::feeling;
  const SeenMoment free = moment_of(sample, &homing);
  sample.rendering.contacts = 1;
  const SeenMoment touching = moment_of(sample, &free);
  sample.rendering.contacts = 0;
  const SeenMoment after = moment_of(sample, &touching);
  const auto visible = [](When when, const SeenMoment& at) {
    protocols::SeenSpec seen;
    seen.object = true;
    seen.when = when;
    return is_visible(seen, at);
  };
  EXPECT_FALSE(visible(When::forces, homing));
  EXPECT_TRUE(visible(When::forces, free) && visible(When::forces, after));
  EXPECT_TRUE(visible(When::before, free));
  EXPECT_FALSE(visible(When::before, after));
  EXPECT_FALSE(visible(When::contact, free));
  EXPECT_TRUE(visible(When::contact, touching) && visible(When::contact, after));
  EXPECT_TRUE(visible(When::always, homing));
}

TEST(Seen, NoiseIsPiecewiseConstantAndSeeded) {
  SeenTrial seen = trial();
  seen.seen.noise = 0.002;
  seen.seen.noise_hz = 10;
  double squares = 0;
  constexpr int kSteps = 2000;
  for (int i = 0; i < kSteps; ++i) {
    const std::int64_t begin = i * 100'000'000LL;
    const Vec3 one = noise_at(seen, begin + 1'000'000);
    EXPECT_EQ(one, noise_at(seen, begin + 98'000'000));
    squares += glm::dot(one, one) / (3 * kSteps);
  }
  EXPECT_NEAR(std::sqrt(squares), 0.002, 0.0001);
  SeenTrial other = seen;
  other.seed = 1;
  EXPECT_NE(noise_at(seen, 0), noise_at(other, 0));
  seen.seen.noise = 0;
  EXPECT_EQ(noise_at(seen, 0), Vec3(0));
}

TEST(Seen, RecordTellsLagAndDroppedFrames) {
  EXPECT_FALSE(participants::seen_record({}));
  std::vector<data::FrameRecord> frames;
  constexpr std::int64_t kStep = 16'000'000, kLag = 9'000'000, kDelay = 100'000'000;
  for (std::int64_t i = 0; i < 200; ++i) {
    if (i == 50 || i == 120 || i == 121) continue;           // dropped
    const std::int64_t pause = i < 100 ? 0 : 3'000'000'000;  // between two intervals
    const std::int64_t swap = i * kStep + pause;
    frames.push_back({swap, swap - kDelay - (i == 10 ? 30'000'000 : kLag), kDelay});
  }
  const auto record = participants::seen_record(frames);
  ASSERT_TRUE(record);
  EXPECT_EQ(record->frames, 197);
  EXPECT_EQ(record->dropped, 3);
  EXPECT_EQ(record->first_ns, 0);
  EXPECT_NEAR(record->lag, 0.009, 1e-9);
  EXPECT_NEAR(record->lag_p99, 0.009, 1e-9);
}

TEST(Seen, LuminanceFollowsSrgb) {
  EXPECT_EQ(grey_of(0), 0);
  EXPECT_NEAR(grey_of(1), 1, 1e-6);
  EXPECT_NEAR(grey_of(0.2140), 0.5, 1e-3);
}

}  // namespace
}  // namespace palpate::runner::display
