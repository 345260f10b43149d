// The wrench of a body on the hand, with a tool of several segments: the same as that of a fixed
// body, and split on two devices so that their moments are those of the contacts.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "data/base/random.h"
#include "rendering/contact.h"
#include "tests/rendering/bodies/body_fixtures.h"

namespace palpate::rendering::test {
namespace {
namespace moving_wrench {

Tool fork() {
  return {{{Vec3(0), Vec3(0, 0, 0.04)},
           {Vec3(0.01, 0, 0), Vec3(0.01, 0, 0.04)},
           {Vec3(0, 0, 0.04), Vec3(0.01, 0, 0.04)}}};
}

/// A tool across an upper edge of a box of 60 x 60 x 40 mm about the origin, pressed 0 to 2 mm into
/// it.
LineProbe pressed(int i) {
  const double t = i * 1e-3;
  const Vec3 axis = glm::normalize(Vec3(1, 0.3 * std::sin(5 * t), 0.1 + 0.05 * std::cos(7 * t)));
  const Vec3 tip(-0.045 + 0.003 * t, 0.012 * std::sin(4 * t),
                 0.021 - 0.0035 * std::min(1.0, 4 * t));
  return {tip, tip + 0.12 * axis};
}

/// 1000 t: the push does not move it. A body meets the probe within the tick, so the wrenches agree
/// up to a tick's motion.
TEST(MovingWrench, HeavyBodyEqualsAFixedOne) {
  for (const Tool& tool : {Tool{}, fork()}) {
    BodyScene moving, still;
    const Mesh mesh = box_mesh({0.06, 0.06, 0.04});
    moving.moves(mesh, {{0, 0, 0}, {1, 0, 0, 0}}, 1e6);
    still.stands(mesh, {{0, 0, 0}, {1, 0, 0, 0}});
    const Scene a = moving.scene(true, tool), b = still.scene(true, tool);
    RenderState sa = a.initial_state(), sb = b.initial_state();
    int touched = 0, split = 0;
    for (int i = 0; i < 1000; ++i) {
      const LineProbe probe = pressed(i), last = pressed(std::max(0, i - 1));
      const Rendering ra = ray_renderer().tick(a, sa, probe, 1e-3);
      const Rendering rb = ray_renderer().tick(b, sb, probe, 1e-3);
      const double moved =
          std::max(glm::distance(probe.tip, last.tip), glm::distance(probe.tail, last.tail));
      const double force = 2 * moving.stiffness * moved + 1e-6;
      EXPECT_LE(glm::distance(ra.force, rb.force), force) << i;
      EXPECT_LE(glm::distance(ra.torque, rb.torque), 0.12 * force) << i;
      EXPECT_LE(glm::distance(ra.device1, rb.device1), force) << i;
      EXPECT_LE(glm::distance(ra.device2, rb.device2), force) << i;
      if (rb.deepest.depth < 2 * moved || rb.contacts == 0) continue;
      ++touched;
      split += glm::length(rb.device2) > 3 * force;
      EXPECT_EQ(ra.object, rb.object) << i;
      EXPECT_GT(ra.contacts, 0) << i;
      EXPECT_NEAR(ra.deepest.depth, rb.deepest.depth, 2 * moved) << i;
      EXPECT_LE(glm::distance(ra.ideal.tip, rb.ideal.tip), 3 * moved) << i;
    }
    EXPECT_GT(touched, 200);
    EXPECT_TRUE(tool.segments.empty() || split > 50) << split;
  }
}

Vec3 drawn_vector(Random& random) {
  return {2 * random.unit() - 1, 2 * random.unit() - 1, 2 * random.unit() - 1};
}

/// A straight stroke at 0.1 m/s, from 2 mm outside an edge or a corner of the box into it and out
/// again, with a rest of three ticks at each end.
struct DrawnStroke {
  static constexpr int kWay = 100, kRest = 3;
  LineProbe start;
  Vec3 each{0, 0, 0};  ///< m; motion in a tick
  Vec3 back{0, 0, 0};  ///< m; motion in a tick on the way out

  LineProbe at(int tick) const {
    const int in = std::min(tick, kWay), out = std::clamp(tick - kWay - kRest, 0, kWay);
    const Vec3 way = static_cast<double>(in) * each + static_cast<double>(out) * back;
    return {start.tip + way, start.tail + way};
  }
};

DrawnStroke drawn_stroke(Random& random, const Vec3& half, bool corner) {
  Vec3 outward = glm::normalize(drawn_vector(random));
  const int along = static_cast<int>(random.below(3));
  if (!corner) outward[along] *= 0.1;
  Vec3 place = half;
  for (int axis = 0; axis < 3; ++axis) place[axis] *= outward[axis] < 0 ? -1 : 1;
  if (!corner) place[along] *= 0.6 * random.unit();
  // Across the way in, so that the stylus passes over the edge and touches with its side.
  const Vec3 way = glm::normalize(outward);
  const Vec3 axis = glm::normalize(glm::cross(way, drawn_vector(random)) + 0.3 * way);
  const Vec3 sideways = glm::cross(way, drawn_vector(random));
  DrawnStroke stroke;
  stroke.start.tip = place + 2e-3 * way - 0.04 * random.unit() * axis;
  stroke.start.tail = stroke.start.tip + 0.12 * axis;
  stroke.each = 1e-4 * glm::normalize(-way + 1.2 * sideways);
  stroke.back = 1e-4 * glm::normalize(way + 0.5 * drawn_vector(random));
  return stroke;
}

struct StrokeCounts {
  int exact = 0, changes = 0, left = 0;  ///< ticks; strokes that end outside
};

/// The force of a tick is the mean over it; with several contacts, that of its end. While the same
/// feature is touched, and at rest, it follows from the fixed body's force.
void expect_that_of_one_that_stands_still(const Tool& tool, const Pose& pose,
                                          const DrawnStroke& stroke, StrokeCounts& counts) {
  const Mesh mesh = box_mesh({0.06, 0.06, 0.04});
  BodyScene moving, still;
  moving.moves(mesh, pose, 2e7);
  still.stands(mesh, pose);
  const Scene a = moving.scene(true, tool), b = still.scene(true, tool);
  RenderState sa = a.initial_state(), sb = b.initial_state();
  Rendering before;
  for (int i = 0; i < 2 * (DrawnStroke::kWay + DrawnStroke::kRest); ++i) {
    const LineProbe in_body = stroke.at(i), last = stroke.at(std::max(0, i - 1));
    const auto world = [&](const Vec3& v) { return pose.orientation * v + pose.position; };
    const LineProbe probe{world(in_body.tip), world(in_body.tail)};
    const Rendering ra = ray_renderer().tick(a, sa, probe, 1e-3);
    const Rendering rb = ray_renderer().tick(b, sb, probe, 1e-3);
    if (i == 0 && rb.contacts > 0) return;
    const double moved = glm::distance(in_body.tip, last.tip);
    const double step = glm::distance(rb.force, before.force);
    // 20,000 t still yield by some nanometres.
    const BodyPose& now = sa.motion.bodies()[0];
    const Quat turn = glm::conjugate(pose.orientation) * now.orientation;
    const double yielded = glm::distance(now.centre, pose.position) +
                           2 * 0.05 * glm::length(Vec3(turn.x, turn.y, turn.z));
    const double rounding = 1e-6 + moving.stiffness * yielded;
    EXPECT_LE(yielded, 5e-8) << i;
    EXPECT_LE(glm::distance(ra.force, rb.force), step + 2e3 * moved + rounding) << i;
    const bool same = rb.contacts == before.contacts && rb.segment == before.segment &&
                      rb.deepest.type == before.deepest.type &&
                      glm::dot(rb.deepest.normal, before.deepest.normal) > 1 - 1e-12;
    if (rb.contacts > 0 && before.contacts > 0 && (same || moved == 0)) {
      const double share = rb.contacts == 1 && moved > 0 ? 0.5 : 1;
      const Vec3 force = glm::mix(before.force, rb.force, share);
      EXPECT_LE(glm::distance(ra.force, force), rounding) << i;
      ++counts.exact;
    }
    counts.changes += rb.contacts > 0 && before.contacts > 0 && !same;
    before = rb;
  }
  counts.left += before.contacts == 0 ? 1 : 0;
}

TEST(MovingWrench, HeavyBodyEqualsFixedOverEdgesAndCorners) {
  Tool prongs = fork();
  prongs.segments.pop_back();
  for (const std::uint64_t seed : {3, 17}) {
    StrokeCounts counts;
    for (const Tool& tool : {Tool{}, prongs, fork()}) {
      Random random(seed);
      for (int trial = 0; trial < 40; ++trial) {
        const Quat turn = glm::normalize(Quat(random.unit() - 0.5, drawn_vector(random)));
        const DrawnStroke stroke = drawn_stroke(random, {0.03, 0.03, 0.02}, trial % 2 == 0);
        expect_that_of_one_that_stands_still(tool, {0.1 * drawn_vector(random), turn}, stroke,
                                             counts);
        if (HasFailure()) FAIL() << "seed " << seed << ", trial " << trial;
      }
    }
    EXPECT_GT(counts.exact, 3000) << seed;
    EXPECT_GT(counts.changes, 10) << seed;
    EXPECT_GT(counts.left, 30) << seed;
  }
}

/// Their moment about any point of the stylus is that of the contacts, except torsion about it.
TEST(MovingWrench, IsSplitOnTwoDevices) {
  for (const double mass : {0.05, 1.0, 1e4}) {
    for (const Tool& tool : {Tool{}, fork()}) {
      BodyScene s;
      s.stands(box_mesh({0.2, 0.2, 0.02}), {{0, 0, -0.03}, {1, 0, 0, 0}});
      s.moves(box_mesh({0.06, 0.06, 0.04}), {{0, 0, 0}, {1, 0, 0, 0}}, mass);
      const Scene scene = s.scene(true, tool);
      RenderState state = scene.initial_state();
      int turned = 0;
      for (int i = 0; i < 600; ++i) {
        const LineProbe probe = pressed(i);
        const Rendering r = ray_renderer().tick(scene, state, probe, 1e-3);
        ASSERT_NEAR(glm::distance(r.device1 + r.device2, r.force), 0,
                    1e-9 * (1 + glm::length(r.force)));
        if (r.contacts == 0) continue;
        const Vec3 axis = glm::normalize(probe.tail - probe.tip);
        const Vec3 shown = glm::cross(probe.tail - probe.tip, r.device2);
        const Vec3 missing = shown - r.torque;
        ASSERT_NEAR(glm::length(missing - glm::dot(missing, axis) * axis), 0,
                    1e-9 * (1 + glm::length(r.torque)))
            << mass << ", tick " << i;
        turned += glm::length(r.torque) > 1e-4;
      }
      EXPECT_GT(turned, 50) << mass;
    }
  }
}

}  // namespace moving_wrench
}  // namespace
}  // namespace palpate::rendering::test
