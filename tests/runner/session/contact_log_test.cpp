// Contact share and edge dwell against their definitions, for recorded samples and closed forms of
// the shapes.

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>
#include <string>
#include <vector>

#include "data/base/random.h"
#include "protocols/parse.h"
#include "runner/scene_builder.h"
#include "runner/session/live_forces.h"
#include "runner/session/simulated_study.h"

namespace palpate::runner::session {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();

Vec3 vec(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

/// Distance to the circle of this radius about the z axis at this height.
double distance_to_rim(const Vec3& p, double radius, double z) {
  return std::hypot(std::hypot(p.x, p.y) - radius, p.z - z);
}

double distance_to_cube_edges(const Vec3& p, double edge) {
  const double half = edge / 2;
  double least = kNone;
  for (int axis = 0; axis < 3; ++axis) {
    const int b = (axis + 1) % 3, c = (axis + 2) % 3;
    const double off = std::max(std::abs(p[axis]) - half, 0.0);
    least =
        std::min(least, std::hypot(off, std::hypot(std::abs(p[b]) - half, std::abs(p[c]) - half)));
  }
  return least;
}

/// Distance from a point in the object's frame to its sharp edges, by the formulas of the shapes.
double closed_form(const stimuli::ObjectSpec& object, const Vec3& p) {
  const double half = object.height / 2;
  switch (object.shape) {
    case stimuli::ShapeKind::cube:
      return distance_to_cube_edges(p, object.edge);
    case stimuli::ShapeKind::cylinder:
      return std::min(distance_to_rim(p, object.radius, half),
                      distance_to_rim(p, object.radius, -half));
    case stimuli::ShapeKind::cone:
      return std::min(glm::length(p - Vec3(0, 0, half)), distance_to_rim(p, object.radius, -half));
    default:
      return kNone;
  }
}

SharpEdges edges_of(const stimuli::ObjectSpec& object) {
  return SharpEdges(SceneBuilder().build({object}, false));
}

TEST(SharpEdges, MatchTheShapesFormulas) {
  constexpr std::uint64_t kSeed = 41;
  Random random(kSeed);
  for (const auto shape : {stimuli::ShapeKind::sphere, stimuli::ShapeKind::cone,
                           stimuli::ShapeKind::cylinder, stimuli::ShapeKind::cube}) {
    stimuli::ObjectSpec object;
    object.shape = shape;
    object.radius = 0.021;
    object.height = 0.05;
    object.edge = 0.044;
    object.pose.position = {0.01, -0.02, 0.03};
    const SharpEdges edges = edges_of(object);
    EXPECT_FALSE(edges.too_many());
    for (int i = 0; i < 500; ++i) {
      const Vec3 p = 0.03 * Vec3(random.normal(), random.normal(), random.normal());
      const double expected = closed_form(object, p);
      const double got = edges.distance(p + object.pose.position);
      if (expected == kNone) {
        EXPECT_EQ(got, kNone);
      } else {
        EXPECT_NEAR(got, expected, 3e-5) << "a rim has corners";
      }
    }
  }
}

TEST(SharpEdges, ExcludeShallowEdges) {
  stimuli::ObjectSpec object;
  object.shape = stimuli::ShapeKind::cylinder;
  for (const int segments : {11, 12, 13, 64}) {
    object.segments = segments;
    const Vec3 on_the_side(object.radius, 0, 0);
    const bool along = edges_of(object).distance(on_the_side) < 0.01;
    EXPECT_EQ(along, 360.0 / segments >= 30) << segments;
  }
}

TEST(SharpEdges, TooManyCountAsATexture) {
  stimuli::ObjectSpec row, tooth;
  row.shape = stimuli::ShapeKind::compound;
  tooth.shape = stimuli::ShapeKind::cube;
  tooth.edge = 0.001;
  for (int i = 0; i < 167; ++i) {
    tooth.pose.position.x = 0.002 * i;
    row.parts.push_back(tooth);
    if (i == 165) {
      EXPECT_FALSE(edges_of(row).too_many()) << "1992 edges";
    }
  }
  EXPECT_TRUE(edges_of(row).too_many()) << "2004 edges";
  EXPECT_EQ(edges_of(row).distance(Vec3(0)), kNone);
}

servo::Sample touching(const Vec3& point) {
  servo::Sample sample;
  sample.phase = servo::Phase::feeling;
  sample.rendering.contacts = 1;
  sample.rendering.deepest.point = point;
  return sample;
}

TEST(ContactLog, CountsEveryTickAsIfAllEdgesWereChecked) {
  stimuli::ObjectSpec cube;
  cube.shape = stimuli::ShapeKind::cube;
  cube.edge = 0.04;
  const SharpEdges edges = edges_of(cube);
  constexpr std::uint64_t kSeed = 5;
  Random random(kSeed);
  const Quat turned = glm::normalize(Quat(0.3, -0.2, 0.7, 0.4));
  ContactLog log;
  log.begin(edges, turned);
  EXPECT_EQ(log.contact_share(), 0);
  Vec3 p(0.02, 0.01, 0);  // a walk of small steps, with jumps
  int touched = 0, near = 0;
  constexpr int kTicks = 20'000;
  for (int tick = 0; tick < kTicks; ++tick) {
    const double step = tick % 50 == 0 ? 0.01 : 6e-5;
    p += step * Vec3(random.normal(), random.normal(), random.normal());
    if (glm::length(p) > 0.035) p *= 0.5;
    servo::Sample sample = touching(turned * p);
    if (random.unit() < 0.3) {
      sample.rendering = {};
    } else {
      ++touched;
      near += distance_to_cube_edges(p, cube.edge) <= ContactLog::kReach ? 1 : 0;
    }
    log.add(sample);
  }
  ASSERT_GT(near, 100);
  EXPECT_DOUBLE_EQ(log.contact_share(), touched / static_cast<double>(kTicks));
  EXPECT_NEAR(*log.edge_dwell(0.001), 0.001 * near, 0.0015) << "but for roundings at the border";
  log.begin(edges, turned);
  log.add(servo::Sample{});
  EXPECT_EQ(log.contact_share(), 0) << "nothing is left of the trial before";
  EXPECT_EQ(*log.edge_dwell(0.001), 0);
}

TEST(ContactLog, WithoutDistinguishableEdgesThereIsNoDwell) {
  stimuli::ObjectSpec row, tooth;
  row.shape = stimuli::ShapeKind::compound;
  tooth.shape = stimuli::ShapeKind::cube;
  tooth.edge = 0.001;
  for (int i = 0; i < 200; ++i) {
    tooth.pose.position.x = 0.002 * i;
    row.parts.push_back(tooth);
  }
  const SharpEdges edges = edges_of(row);
  ContactLog log;
  log.begin(edges, Quat(1, 0, 0, 0));
  log.add(touching(Vec3(0)));
  EXPECT_EQ(log.contact_share(), 1);
  EXPECT_FALSE(log.edge_dwell(0.001));
}

/// The definitions, evaluated for a recorded trial.
struct Recomputed {
  double contact_share = 0;
  int surely = 0, perhaps = 0;  ///< ticks near an edge; perhaps: within kSlack of the border
};

// A rim of the mesh is a polygon of 64 corners.
constexpr double kSlack = 1e-4;  // m

Recomputed recompute(const data::TrialRecord& record, const stimuli::ObjectSpec& object) {
  Recomputed out;
  int touched = 0;
  const auto& q = record.orientation_wxyz;
  const Quat to_object = glm::conjugate(Quat(q[0], q[1], q[2], q[3]));
  for (const data::SampleRecord& sample : record.samples) {
    if (sample.contacts == 0) continue;
    ++touched;
    const Vec3 force = vec(sample.force), stylus = vec(sample.tail) - vec(sample.tip);
    const Vec3 axis = glm::normalize(stylus), lever = glm::cross(axis, force);
    const double lever2 = glm::dot(lever, lever);
    double along = 0;
    bool known = true;
    if (record.renderer == "ray") {
      known = lever2 > 1e-6 * glm::dot(force, force);
      if (known) along = glm::dot(lever, vec(sample.torque)) / lever2;
    }
    const Vec3 point = vec(sample.tip) + along * axis + sample.depth * glm::normalize(force);
    const double distance = closed_form(object, to_object * point);
    out.surely += known && distance < ContactLog::kReach - kSlack ? 1 : 0;
    out.perhaps += !known || distance < ContactLog::kReach + kSlack ? 1 : 0;
  }
  out.contact_share = touched / static_cast<double>(record.samples.size());
  return out;
}

TEST(ContactLog, MatchesSamplesOfSimulatedStudy) {
  const protocols::Protocol protocol = protocols::parse_protocol_text(
      R"({"version": 1, "name": "touched", "samples": true,
          "stimuli": [{"name": "sphere", "shape": "sphere", "radius_m": 0.03},
                      {"name": "cone", "shape": "cone", "radius_m": 0.025, "height_m": 0.07},
                      {"name": "cylinder", "shape": "cylinder", "radius_m": 0.025, "height_m": 0.06},
                      {"name": "cube", "shape": "cube", "edge_m": 0.05}],
          "renderers": ["point", "ray"], "repetitions": 2, "practice": {"repetitions": 0},
          "response": {"keys": {"1": "sphere", "2": "cone", "3": "cylinder", "4": "cube"}}})",
      "touched.json");
  const std::atomic<bool> stop{false};
  int with_edges = 0, trials = 0;
  simulate_in_memory(
      protocol, participants::load_simulated_settings("", 3), first_numbers(1), 77, stop,
      [&](int, const data::TrialRecord& record, std::uint64_t contact_ticks) {
        ++trials;
        const stimuli::ObjectSpec* object = nullptr;
        for (const auto& stimulus : protocol.stimuli) {
          if (stimulus.name == record.shape) object = &stimulus.object;
        }
        const Recomputed expected = recompute(record, *object);
        ASSERT_TRUE(record.contact_share && record.edge_dwell);
        EXPECT_EQ(record.samples.size(), record.ticks);
        EXPECT_DOUBLE_EQ(*record.contact_share, expected.contact_share);
        EXPECT_EQ(contact_ticks, std::llround(expected.contact_share * record.ticks));
        const double ticks = *record.edge_dwell * protocol.servo_rate;
        EXPECT_GE(ticks, expected.surely - 0.5) << record.renderer << " " << record.shape;
        EXPECT_LE(ticks, expected.perhaps + 0.5) << record.renderer << " " << record.shape;
        EXPECT_LE(expected.perhaps - expected.surely, 0.1 * record.ticks) << "says something";
        with_edges += expected.surely > 100 ? 1 : 0;
      });
  EXPECT_EQ(trials, 16);
  EXPECT_GT(with_edges, 4);
}

}  // namespace
}  // namespace palpate::runner::session
