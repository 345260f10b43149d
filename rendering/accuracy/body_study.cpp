#include "rendering/accuracy/body_study.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <memory>

#include "rendering/accuracy/body_engines.h"
#include "rendering/bodies/moving_scene.h"
#include "rendering/renderer.h"
#include "stimuli/primitives.h"

namespace palpate::rendering {
namespace {

constexpr double kStudyStep = 1e-3;  // s

BodyRow measure_bodies(const BodyCase& of, const BodyEngineKind& kind,
                       const std::function<double()>& now) {
  BodyRow row;
  row.name = of.name;
  row.measure = of.measure;
  row.engine = kind.name;
  const std::unique_ptr<BodyEngine> engine = kind.make(of);
  const int steps = static_cast<int>(std::lround(of.duration / kStudyStep));
  double cost = 0;
  for (int i = 0; i < steps; ++i) {
    const double start = now();
    engine->step(kStudyStep);
    cost += now() - start;
    if (!of.always && i + 1 < steps) continue;
    const double error = of.error(engine->motion());
    if (!(error <= row.error)) row.error = error;
  }
  row.us_per_step = 1e-3 * cost / steps;
  return row;
}

using Parts = std::vector<std::pair<std::shared_ptr<const stimuli::ConvexMesh>, Pose>>;

std::shared_ptr<const stimuli::ConvexMesh> mesh_from(const stimuli::PolygonSoup& soup) {
  return std::make_shared<const stimuli::ConvexMesh>(soup);
}

Parts dumbbell() {
  const auto ball = mesh_from(stimuli::icosphere(0.015, 3));
  const auto bar = mesh_from(stimuli::cylinder(0.005, 0.06, 24));
  return {{ball, {{0, 0, 0.03}, {1, 0, 0, 0}}}, {ball, {{0, 0, -0.03}, {1, 0, 0, 0}}}, {bar, {}}};
}

/// A hull of four stages, a nose and four fins.
Parts rocket() {
  Parts parts;
  for (int i = 0; i < 4; ++i)
    parts.push_back(
        {mesh_from(stimuli::cylinder(0.02, 0.04, 24)), {{0, 0, 0.04 * i - 0.06}, {1, 0, 0, 0}}});
  parts.push_back({mesh_from(stimuli::cone(0.02, 0.05, 24)), {{0, 0, 0.125}, {1, 0, 0, 0}}});
  for (int i = 0; i < 4; ++i) {
    const Quat turn = glm::angleAxis(std::acos(-1.0) / 2 * i, Vec3(0, 0, 1));
    parts.push_back(
        {mesh_from(stimuli::box({0.03, 0.004, 0.04})), {turn * Vec3(0.03, 0, -0.06), turn}});
  }
  return parts;
}

}  // namespace

std::vector<BodyRow> body_study(bool quick, const std::function<double()>& now,
                                const std::function<void(double)>& progress) {
  std::vector<BodyRow> rows;
  const std::vector<BodyCase> cases = body_cases(quick);
  const std::vector<BodyEngineKind> engines = body_engines();
  for (const BodyCase& of : cases) {
    for (const BodyEngineKind& engine : engines) {
      progress(static_cast<double>(rows.size()) /
               static_cast<double>(cases.size() * engines.size()));
      rows.push_back(measure_bodies(of, engine, now));
    }
  }
  return rows;
}

BodyTickCost body_tick_cost(bool quick, const std::function<double()>& now) {
  std::vector<SceneObject> objects;
  std::vector<MovingObject> moving;
  for (int i = 0; i < 11; ++i) {
    MovingObject object;
    object.object = i;
    object.body.mass = 0.1;
    object.body.restitution = 0.8;
    object.pose.position = {0.06 * (i % 4), 0.06 * ((i / 4) % 4), i == 10 ? 0.12 : 0.005 * i};
    object.body.damping = 0.2;
    for (const auto& [mesh, at] : i == 10 ? rocket() : dumbbell()) {
      SceneObject part;
      part.mesh = mesh;
      part.object = i;
      part.pose = {object.pose.position + at.position, at.orientation};
      objects.push_back(part);
    }
    moving.push_back(object);
  }
  const Scene scene = moving_scene(objects, moving, Vec3(0));
  RenderState state = scene.initial_state();
  const int ticks = quick ? 2000 : 20000;
  std::vector<double> costs;
  for (int i = 0; i < ticks; ++i) {
    // The hand goes after one of them and pushes it on.
    const BodyPose& body =
        state.motion.bodies()[static_cast<std::size_t>(i / 400) % state.motion.bodies().size()];
    const double phase = (i % 400) / 400.0;
    const Vec3 tip = body.centre + Vec3(0.08 - 0.09 * phase, 0.01 * std::sin(0.01 * i), 0.01);
    const double start = now();
    ray_renderer().tick(scene, state, {tip, tip + Vec3(0.12, 0.02, 0.01)}, 1e-3);
    costs.push_back(1e-3 * (now() - start));
  }
  std::sort(costs.begin(), costs.end());
  BodyTickCost cost;
  cost.ticks = costs.size();
  cost.median = costs[costs.size() / 2];
  cost.p99 = costs[costs.size() * 99 / 100];
  cost.most = costs.back();
  return cost;
}

}  // namespace palpate::rendering
