#include "rendering/accuracy/body_study.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <memory>
#include <numbers>

#include "rendering/bodies/moving_scene.h"
#include "rendering/renderer.h"
#include "stimuli/primitives.h"

namespace palpate::rendering {
namespace {

const Quat kUpright{1, 0, 0, 0};

Vec3 box_moments(const Vec3& size, double mass) {
  const Vec3 s = size * size;
  return mass / 12 * Vec3(s.y + s.z, s.x + s.z, s.x + s.y);
}

/// J
double box_energy(const BodyBox& box, const BoxMotion& at) {
  const Vec3 spin = glm::conjugate(at.orientation) * at.spin;
  return 0.5 * box.mass * glm::dot(at.velocity, at.velocity) +
         0.5 * glm::dot(spin * spin, box_moments(box.size, box.mass));
}

BodyCase tumbling(bool quick) {
  BodyCase c;
  c.name = "tumbling about the middle axis";
  c.measure = "energy, relative";
  c.duration = quick ? 1 : 10;
  BodyBox box{{0.1, 0.2, 0.03}, 0.3, {Vec3(0), kUpright}};
  box.spin = {8, 0.3, 0.2};
  c.boxes = {box};
  c.always = true;
  const double energy = box_energy(box, {Vec3(0), kUpright, Vec3(0), box.spin});
  c.error = [=](std::span<const BoxMotion> at) {
    return std::abs(box_energy(box, at[0]) / energy - 1);
  };
  return c;
}

/// A square coin: the axis returns after each turn about the momentum.
BodyCase coin() {
  BodyCase c;
  c.name = "spinning coin's precession";
  c.measure = "rad";
  BodyBox box{{0.02, 0.02, 0.002}, 0.0075, {Vec3(0), kUpright}};
  box.spin = {2, 0, 30};
  const Vec3 moments = box_moments(box.size, box.mass);
  const double rate = glm::length(moments * box.spin) / moments.x;
  // A whole number of steps is not a whole number of turns: compute the exact axis at the end.
  c.duration = 1;
  const Vec3 along = glm::normalize(moments * box.spin), axis(0, 0, 1);
  const Vec3 expected = glm::angleAxis(rate * c.duration, along) * axis;
  c.boxes = {box};
  c.error = [=](std::span<const BoxMotion> at) {
    return glm::distance(at[0].orientation * axis, expected);
  };
  return c;
}

BodyCase head_on() {
  BodyCase c;
  c.name = "head-on, restitution 1";
  c.measure = "speed, relative";
  c.duration = 0.2;
  BodyBox first{Vec3(0.05), 0.2, {Vec3(0), kUpright}};
  first.velocity = {1, 0, 0};
  c.boxes = {first, {Vec3(0.05), 0.2, {{0.1237, 0, 0}, kUpright}}};
  c.error = [](std::span<const BoxMotion> at) {
    return std::max(glm::length(at[0].velocity), glm::distance(at[1].velocity, Vec3(1, 0, 0)));
  };
  return c;
}

BodyCase oblique() {
  BodyCase c;
  c.name = "oblique against a wall";
  c.measure = "speed, relative";
  c.duration = 0.1;
  BodyBox box{Vec3(0.05), 0.2, {Vec3(0), kUpright}};
  box.velocity = {1, 0.3, -0.2};
  c.boxes = {box, {{0.05, 1, 1}, 0, {{0.11, 0, 0}, kUpright}}};
  c.error = [](std::span<const BoxMotion> at) {
    return glm::distance(at[0].velocity, Vec3(-1, 0.3, -0.2));
  };
  return c;
}

/// Struck by the corner of a cube whose middle is behind the corner.
BodyCase rod() {
  BodyCase c;
  c.name = "rod struck at its end";
  c.measure = "speed, relative";
  c.duration = 0.2;
  const double length = 0.4, width = 0.02, rod_mass = 0.5, mass = 0.1, arm = 0.19, speed = 0.8;
  const Vec3 corner = glm::normalize(Vec3(1)), down(0, -1, 0);
  const Vec3 axis = glm::normalize(glm::cross(corner, down));
  BodyBox cube{Vec3(0.02), mass, {}};
  cube.pose = {{arm, 0.1, 0}, glm::angleAxis(std::acos(glm::dot(corner, down)), axis)};
  cube.velocity = speed * down;
  c.boxes = {{{length, width, width}, rod_mass, {Vec3(0), kUpright}}, cube};
  const double moment = rod_mass / 12 * (length * length + width * width);
  const double impulse = 2 * speed / (1 / mass + 1 / rod_mass + arm * arm / moment);
  c.error = [=](std::span<const BoxMotion> at) {
    return std::max(glm::distance(at[0].velocity, impulse / rod_mass * down),
                    std::max(glm::distance(at[1].velocity, (speed - impulse / mass) * down),
                             arm * std::abs(at[0].spin.z + impulse * arm / moment))) /
           speed;
  };
  return c;
}

BodyCase cradle() {
  BodyCase c;
  c.name = "Newton's cradle of five";
  c.measure = "speed, relative";
  c.duration = 0.1;
  for (int i = 0; i < 5; ++i) {
    BodyBox box{Vec3(0.04), 0.1, {{0.04 * i - (i == 0 ? 0.05 : 0), 0, 0}, kUpright}};
    if (i == 0) box.velocity = {1, 0, 0};
    c.boxes.push_back(box);
  }
  c.error = [](std::span<const BoxMotion> at) {
    double worst = 0;
    for (std::size_t i = 0; i < 5; ++i)
      worst = std::max(worst, glm::distance(at[i].velocity, Vec3(i == 4 ? 1 : 0, 0, 0)));
    return worst;
  };
  return c;
}

BodyBox ground() { return {{1, 1, 0.1}, 0, {{0, 0, -0.05}, kUpright}, {}, {}, 0.5, 0.3}; }

/// The box hits corner after corner, sometimes two at once; energy is conserved.
BodyCase tumbling_bounces(bool quick) {
  BodyCase c;
  c.name = "tumbling on a floor, restitution 1";
  c.measure = "energy, relative";
  c.gravity = {0, 0, -9.81};
  c.duration = quick ? 1 : 10;
  BodyBox floor = ground(), box{{0.05, 0.03, 0.04}, 0.1, {{0, 0, 0.2}, kUpright}};
  floor.restitution = 1;
  floor.friction = 0;
  box.spin = {1, 2, 3};
  c.boxes = {floor, box};
  const auto energy = [box](const BoxMotion& at) {
    return box_energy(box, at) + box.mass * 9.81 * at.centre.z;
  };
  const double before = energy({box.pose.position, kUpright, Vec3(0), box.spin});
  c.error = [=](std::span<const BoxMotion> at) { return std::abs(energy(at[0]) / before - 1); };
  return c;
}

/// A tilted plank lands on an edge and slides on. Newton's restitution with Coulomb's friction in
/// closed form, in the plane of the fall.
BodyCase plank() {
  BodyCase c;
  c.name = "plank on its edge, with friction";
  c.measure = "speed, relative";
  c.duration = 0.06;
  const double restitution = 0.6, friction = 0.1, angle = 0.4;
  BodyBox floor = ground(), box{{0.2, 0.06, 0.04}, 0.3, {}};
  const Quat turn = glm::angleAxis(angle, Vec3(0, 1, 0));
  const Vec3 corner = turn * Vec3(0.1, 0, -0.02);  // lowest
  box.pose = {{0, 0, 0.0499 - corner.z}, turn};
  box.velocity = {-3, 0, -1};
  floor.restitution = box.restitution = restitution;
  floor.friction = box.friction = friction;
  c.boxes = {floor, box};
  const double moment = box_moments(box.size, box.mass).y, per_mass = 1 / box.mass;
  // The floor drags along +x: impulses (friction n, n) at the corner.
  const double lever = corner.z * friction - corner.x;  // of n about y
  const double n = (1 + restitution) / (per_mass - corner.x * lever / moment);
  const Vec3 velocity = box.velocity + n * per_mass * Vec3(friction, 0, 1);
  const double spin = n * lever / moment;
  c.error = [=](std::span<const BoxMotion> at) {
    return std::max(glm::distance(at[0].velocity, velocity),
                    0.1 * glm::distance(at[0].spin, Vec3(0, spin, 0)));
  };
  return c;
}

BodyCase heavy_on_light(bool quick) {
  BodyCase c;
  c.name = "10 kg on 1 g";
  c.measure = "off its height, mm";
  c.gravity = {0, 0, -9.81};
  c.duration = quick ? 1 : 5;
  c.always = true;
  c.boxes = {ground(),
             {Vec3(0.02), 0.001, {{0, 0, 0.01}, kUpright}, {}, {}, 0.5, 0.3},
             {Vec3(0.1), 10, {{0, 0, 0.07}, kUpright}, {}, {}, 0.5, 0.3}};
  c.error = [](std::span<const BoxMotion> at) {
    return 1e3 * std::max(std::abs(at[0].centre.z - 0.01), std::abs(at[1].centre.z - 0.07));
  };
  return c;
}

BodyCase stack(bool quick) {
  BodyCase c;
  c.name = "stack of ten at rest";
  c.measure = "off its place, mm";
  c.gravity = {0, 0, -9.81};
  c.duration = quick ? 2 : 60;
  c.boxes = {ground()};
  for (int i = 0; i < 10; ++i)
    c.boxes.push_back({Vec3(0.05), 0.1, {{0, 0, 0.025 + 0.05 * i}, kUpright}, {}, {}, 0.5, 0.3});
  c.error = [](std::span<const BoxMotion> at) {
    double worst = 0;
    for (std::size_t i = 0; i < 10; ++i)
      worst = std::max(
          worst, glm::distance(at[i].centre, Vec3(0, 0, 0.025 + 0.05 * static_cast<double>(i))));
    return 1e3 * worst;
  };
  return c;
}

BodyCase collisions() {
  BodyCase c;
  c.name = "six that fly at each other";
  c.measure = "momentum, relative";
  c.duration = 1;
  c.always = true;
  Vec3 before(0);
  double scale = 0;
  for (int i = 0; i < 6; ++i) {
    BodyBox box{{0.08, 0.05, 0.06}, i == 0 ? 5.0 : 0.05 * i, {}};
    const Vec3 place(0.12 * (i % 3), i < 3 ? 0 : 0.12, 0.01 * i);
    box.pose = {place, glm::normalize(Quat(1, 0.3 * i, -0.2 * i, 0.1))};
    box.velocity = 10.0 * (Vec3(0.12, 0.06, 0.02) - place);
    box.spin = {1.0 * i, -2, 3};
    box.restitution = 0.4;
    box.friction = 0.3;
    before += box.mass * box.velocity;
    scale += box.mass * glm::length(box.velocity);
    c.boxes.push_back(box);
  }
  const std::vector<BodyBox> boxes = c.boxes;
  c.error = [=](std::span<const BoxMotion> at) {
    Vec3 now(0);
    for (std::size_t i = 0; i < at.size(); ++i) now += boxes[i].mass * at[i].velocity;
    return glm::distance(now, before) / scale;
  };
  return c;
}

}  // namespace

std::vector<BodyCase> body_cases(bool quick) {
  return {tumbling(quick), coin(),
          head_on(),       oblique(),
          rod(),           plank(),
          cradle(),        tumbling_bounces(quick),
          collisions(),    heavy_on_light(quick),
          stack(quick)};
}

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
    // The hand follows one body and pushes it.
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
