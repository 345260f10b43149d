#include "runner/evidence/accuracy/body_study.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <memory>
#include <numbers>
#include <utility>

#include "data/base/random.h"
#include "rendering/bodies/moving_scene.h"
#include "rendering/bodies/soft/soft_contact.h"
#include "rendering/bodies/soft/soft_object.h"
#include "rendering/renderer.h"
#include "runner/evidence/accuracy/analytic_stroke.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"

namespace palpate::runner::evidence {
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

constexpr double kYoungModulus = 20000, kPoissonRatio = 0.45;  // Pa; a soft tissue

using Clock = std::function<double()>;

SoftRow row_of(std::string name, std::string truth, const stimuli::SolidMesh& mesh, double value,
               double reference, std::string unit) {
  return {std::move(name), std::move(truth), mesh.nodes.size(), mesh.hexahedra.size(),
          value,           reference,        std::move(unit),   std::abs(value / reference - 1)};
}

/// A slab on a table with a tool on it.
struct PressedSlab {
  std::shared_ptr<const rendering::SoftBody> body;
  double force = 0;  ///< N
  double sunk = 0;   ///< m, of the ideal tool
  double step_ns = 0;
};
constexpr double kStepTime = 0.004;  // s

std::vector<std::uint32_t> nodes_where(const stimuli::SolidMesh& mesh,
                                       const std::function<bool(const Vec3&)>& is) {
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t i = 0; i < mesh.nodes.size(); ++i) {
    if (is(mesh.nodes[i])) nodes.push_back(i);
  }
  return nodes;
}

/// \param half  m, of the slab's height
/// \param goal  m, depth of the virtual tool
PressedSlab press_slab(stimuli::SolidMesh mesh, double half, double poisson,
                       const rendering::SoftContactSettings& contact,
                       const rendering::PlacedTool& tool, const Vec3& above, double goal,
                       const Clock& now) {
  const auto held = nodes_where(mesh, [&](const Vec3& p) { return p.z < -0.999 * half; });
  PressedSlab pressed;
  pressed.body = std::make_shared<const rendering::SoftBody>(
      std::move(mesh), held,
      rendering::SoftSettings{.material = {.young = kYoungModulus, .poisson = poisson},
                              .step = kStepTime});
  const rendering::SoftObject object(pressed.body, contact, 0);
  rendering::SoftObjectState state = initial_state(object);
  Vec3 at = above;
  at.z = half + contact.radius + 0.0005;
  constexpr double kTick = 0.001, kFall = 2e-5;
  const int ticks = static_cast<int>(goal / kFall) + 500;
  for (int i = 0; i < ticks; ++i) {
    const double step = std::max(-kFall, half + contact.radius - goal - at.z);
    at.z += step;
    pressed.force = advance(object, state, at, tool, std::abs(step), kTick).z;
  }
  pressed.sunk = goal - state.contact.shift.z;
  constexpr int kTimed = 20;
  const double start = now();
  for (int i = 0; i < kTimed; ++i) pressed.body->step(state.body, state.mean);
  pressed.step_ns = (now() - start) / kTimed;
  return pressed;
}

stimuli::SolidMesh box_mesh(const Vec3& size, int resolution) {
  stimuli::ObjectSpec spec;
  spec.shape = stimuli::ShapeKind::box;
  spec.size = size;
  return stimuli::mesh_of_primitive(spec, resolution);
}

SoftRow ball(int resolution, const Clock& now) {
  constexpr double kBall = 0.02, kHigh = 0.05;
  rendering::PlacedTool tool;
  tool.count = 1;
  tool.segments[0] = {Vec3(0), Vec3(0)};
  const PressedSlab pressed = press_slab(
      box_mesh({0.1, 0.1, kHigh}, resolution), kHigh / 2, kPoissonRatio,
      {.radius = kBall, .stiffness = 1e5, .most = 128}, tool, {0.0003, 0.0002, 0}, 0.004, now);
  // Dimitriadis et al. 2002, bonded to its base, for incompressible layers; Hertz for thick ones.
  const double x = std::sqrt(kBall * pressed.sunk) / kHigh;
  const double thin = 1 + x * (1.133 + x * (1.283 + x * (0.769 + x * 0.0975)));
  const double hertz = 4.0 / 3 * kYoungModulus / (1 - kPoissonRatio * kPoissonRatio) *
                       std::sqrt(kBall) * std::pow(pressed.sunk, 1.5) * thin;
  SoftRow row =
      row_of("ball on a slab, resolution " + std::to_string(resolution),
             "Hertz with the slab's thickness", pressed.body->mesh(), pressed.force, hertz, "N");
  row.step_ns = pressed.step_ns;
  return row;
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

SoftRow patch_test() {
  Random random(7);
  stimuli::SolidMesh mesh = stimuli::mesh_of_box(Vec3(0.03), {4, 4, 4});
  const auto inside = nodes_where(mesh, [](const Vec3& p) {
    return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) < 0.0149;
  });
  for (const std::uint32_t i : inside)
    mesh.nodes[i] += 0.003 * Vec3(random.unit() - 0.5, random.unit() - 0.5, random.unit() - 0.5);
  const rendering::Solid solid(mesh, {.young = kYoungModulus, .poisson = kPoissonRatio});
  const Mat3 strain(1.1, 0.1, -0.05, 0.2, 0.9, 0.03, 0, 0.1, 1.05);
  std::vector<Vec3> x, forces(mesh.nodes.size());
  x.reserve(mesh.nodes.size());
  for (const Vec3& p : mesh.nodes) x.push_back(strain * p);
  solid.energy(x, forces.data());
  double within = 0, all = 0;
  for (const Vec3& f : forces) all = std::max(all, glm::length(f));
  for (const std::uint32_t i : inside) within = std::max(within, glm::length(forces[i]));
  SoftRow row = row_of("patch test", "forces inside cancel", mesh, within, 0, "N");
  row.error = within / all;
  return row;
}

SoftRow cantilever(int across, const Clock& now) {
  constexpr double kLength = 0.1, kSide = 0.01, kForce = 1e-5, kYoung = 1e5, kPoisson = 0.3;
  const stimuli::SolidMesh mesh =
      stimuli::mesh_of_box({kLength, kSide, kSide}, {10 * across, across, across});
  const auto held = nodes_where(mesh, [](const Vec3& p) { return p.x < -0.0499; });
  const auto loaded = nodes_where(mesh, [](const Vec3& p) { return p.x > 0.0499; });
  const rendering::SoftBody body(mesh, held,
                                 {.material = {.young = kYoung, .poisson = kPoisson, .damping = 0},
                                  .step = 10,
                                  .iterations = 3,
                                  .compliance = false});
  rendering::SoftState state = body.rest();
  std::vector<rendering::NodeForce> forces;
  for (const std::uint32_t node : loaded) {
    const double y = std::abs(mesh.nodes[node].y), z = std::abs(mesh.nodes[node].z);
    const double share = (y > 0.00499 ? 0.5 : 1) * (z > 0.00499 ? 0.5 : 1) / (across * across);
    forces.push_back({body.surface_index(node), Vec3(0, 0, -kForce * share)});
  }
  constexpr int kSteps = 20;
  const double start = now();
  for (int i = 0; i < kSteps; ++i) body.step(state, forces);
  const double spent = now() - start;
  double sum = 0;
  for (const std::uint32_t node : loaded) sum += mesh.nodes[node].z - state.x[node].z;
  const double shear = 10 * (1 + kPoisson) / (12 + 11 * kPoisson), g = kYoung / (2 + 2 * kPoisson);
  const double inertia = std::pow(kSide, 4) / 12;
  const double theory = kForce * std::pow(kLength, 3) / (3 * kYoung * inertia) +
                        kForce * kLength / (shear * g * kSide * kSide);
  SoftRow row = row_of("cantilever, " + std::to_string(across) + " across", "Timoshenko's beam",
                       mesh, 1000 * sum / static_cast<double>(loaded.size()), 1000 * theory, "mm");
  row.step_ns = spent / kSteps;
  return row;
}

PressedSlab lying(int resolution, const Clock& now) {
  rendering::PlacedTool tool;
  tool.count = 1;
  tool.segments[0] = {Vec3(-0.06, 0, 0), Vec3(0.12, 0, 0)};
  return press_slab(box_mesh({0.1, 0.1, 0.04}, resolution), 0.02, kPoissonRatio,
                    {.radius = 0.01, .stiffness = 1e5, .most = 128}, tool, {0, 0.0002, 0}, 0.008,
                    now);
}

/// Hertz's cylinder. With a Poisson's ratio of 0, free sides are in plane strain.
/// \param resolution  elements over the slab's width
SoftRow line(int resolution, const Clock& now) {
  constexpr double kWide = 0.16, kLong = 0.02;
  const LineContact contact{.young = kYoungModulus, .poisson = 0};
  rendering::PlacedTool tool;
  tool.count = 1;
  tool.segments[0] = {Vec3(0, -kLong, 0), Vec3(0, 2 * kLong, 0)};
  const PressedSlab pressed = press_slab(
      stimuli::mesh_of_box({kWide, kLong, contact.thickness},
                           {resolution, 2, std::max(2, 3 * resolution / 8)}),
      contact.thickness / 2, contact.poisson,
      {.radius = contact.radius, .stiffness = 1e5, .most = 128}, tool, {0.0003, 0, 0}, 0.0025, now);
  SoftRow row = row_of("cylinder on a slab, " + std::to_string(resolution) + " across",
                       "Hertz, on a bonded layer", pressed.body->mesh(), pressed.force,
                       kLong * line_force(contact, pressed.sunk), "N");
  row.step_ns = pressed.step_ns;
  return row;
}

/// A cylinder lying across, pressed in by a fifth of the thickness; the truth is the finest mesh's
/// result.
void add_cylinder(bool quick, const Clock& now, std::vector<SoftRow>& rows) {
  const std::vector<int> resolutions = quick ? std::vector{4} : std::vector{6, 10};
  const int finest = quick ? 8 : 14;
  const double truth = lying(finest, now).force;
  for (const int resolution : resolutions) {
    const PressedSlab pressed = lying(resolution, now);
    SoftRow row = row_of("cylinder pressed into a slab, resolution " + std::to_string(resolution),
                         "resolution " + std::to_string(finest), pressed.body->mesh(),
                         pressed.force, truth, "N");
    row.step_ns = pressed.step_ns;
    rows.push_back(row);
  }
}

void add_pressed(const Clock& now, std::vector<SoftRow>& rows) {
  const stimuli::SolidMesh mesh = stimuli::mesh_of_box({0.06, 0.06, 0.03}, {8, 8, 4});
  const auto held = nodes_where(mesh, [](const Vec3& p) { return p.z < -0.0149; });
  const auto top = nodes_where(mesh, [](const Vec3& p) {
    return p.z > 0.0149 && std::max(std::abs(p.x), std::abs(p.y)) < 0.016;
  });
  const rendering::SoftBody body(mesh, held,
                                 {.material = {.young = kYoungModulus, .poisson = 0.49},
                                  .step = kStepTime,
                                  .compliance = false});
  rendering::SoftState state = body.rest();
  std::vector<rendering::NodeForce> forces;
  forces.reserve(top.size());
  for (const std::uint32_t node : top)
    forces.push_back(
        {body.surface_index(node), Vec3(0, 0, -9.0 / static_cast<double>(top.size()))});
  constexpr int kSteps = 500;
  const double start = now();
  for (int i = 0; i < kSteps; ++i) body.step(state, forces);
  const double spent = (now() - start) / kSteps;
  const double sunk = mesh.nodes[top[0]].z - state.x[top[0]].z;
  SoftRow volume = row_of("volume, Poisson's ratio 0.49, pressed", "volume at rest", mesh,
                          1e6 * body.solid().volume(state.x), 1e6 * body.solid().volume(), "ml");
  volume.step_ns = spent;
  rows.push_back(volume);

  // The same equilibrium with every step fully solved.
  rendering::SoftSettings exact = body.settings();
  exact.iterations = 20;
  const rendering::SoftBody solved(mesh, held, exact);
  rendering::SoftState there = solved.rest();
  for (int i = 0; i < kSteps / 4; ++i) solved.step(there, forces);
  rows.push_back(row_of("depth pressed to, one iteration a step", "twenty iterations a step", mesh,
                        1000 * sunk, 1000 * (mesh.nodes[top[0]].z - there.x[top[0]].z), "mm"));
  for (int i = 0; i < 2 * kSteps; ++i) body.step(state, {});
  double off = 0;
  for (std::size_t i = 0; i < mesh.nodes.size(); ++i)
    off = std::max(off, glm::distance(state.x[i], mesh.nodes[i]));
  SoftRow rest = row_of("rest shape, let go", "shape at rest", mesh, 1e6 * off, 0, "um");
  rest.error = off / 0.06;  // of the body's length
  rows.push_back(rest);
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
  std::vector<rendering::SceneObject> objects;
  std::vector<rendering::MovingObject> moving;
  for (int i = 0; i < 11; ++i) {
    rendering::MovingObject object;
    object.object = i;
    object.body.mass = 0.1;
    object.body.restitution = 0.8;
    object.pose.position = {0.06 * (i % 4), 0.06 * ((i / 4) % 4), i == 10 ? 0.12 : 0.005 * i};
    object.body.damping = 0.2;
    for (const auto& [mesh, at] : i == 10 ? rocket() : dumbbell()) {
      rendering::SceneObject part;
      part.mesh = mesh;
      part.object = i;
      part.pose = {object.pose.position + at.position, at.orientation};
      objects.push_back(part);
    }
    moving.push_back(object);
  }
  const rendering::Scene scene = moving_scene(objects, moving, Vec3(0));
  rendering::RenderState state = scene.initial_state();
  const int ticks = quick ? 2000 : 20000;
  std::vector<double> costs;
  for (int i = 0; i < ticks; ++i) {
    // The hand follows one body and pushes it.
    const rendering::BodyPose& body =
        state.motion.bodies()[static_cast<std::size_t>(i / 400) % state.motion.bodies().size()];
    const double phase = (i % 400) / 400.0;
    const Vec3 tip = body.centre + Vec3(0.08 - 0.09 * phase, 0.01 * std::sin(0.01 * i), 0.01);
    const double start = now();
    rendering::ray_renderer().tick(scene, state, {tip, tip + Vec3(0.12, 0.02, 0.01)}, 1e-3);
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

std::vector<SoftRow> soft_study(bool quick, const std::function<double()>& now,
                                const std::function<void(double)>& progress) {
  std::vector<SoftRow> rows;
  progress(0);
  rows.push_back(patch_test());
  for (const int across : quick ? std::vector{1, 2} : std::vector{1, 2, 4})
    rows.push_back(cantilever(across, now));
  progress(0.2);
  add_pressed(now, rows);
  for (const int resolution : quick ? std::vector{4, 8} : std::vector{6, 10, 14}) {
    rows.push_back(ball(resolution, now));
    progress(0.5);
  }
  for (const int across : quick ? std::vector{8, 16} : std::vector{8, 16, 32})
    rows.push_back(line(across, now));
  add_cylinder(quick, now, rows);
  return rows;
}

}  // namespace palpate::runner::evidence
