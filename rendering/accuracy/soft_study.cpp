#include "rendering/accuracy/soft_study.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <memory>
#include <utility>

#include "data/base/random.h"
#include "rendering/accuracy/analytic_stroke.h"
#include "rendering/bodies/soft/soft_scene.h"

namespace palpate::rendering {
namespace {

constexpr double kYoungModulus = 20000, kPoissonRatio = 0.45;  // Pa; a soft tissue
constexpr double kStepTime = 0.004;                            // s

using Clock = std::function<double()>;

std::vector<std::uint32_t> nodes_where(const stimuli::SolidMesh& mesh,
                                       const std::function<bool(const Vec3&)>& is) {
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t i = 0; i < mesh.nodes.size(); ++i) {
    if (is(mesh.nodes[i])) nodes.push_back(i);
  }
  return nodes;
}

SoftRow row_of(std::string name, std::string truth, const stimuli::SolidMesh& mesh, double value,
               double reference, std::string unit) {
  return {std::move(name), std::move(truth), mesh.nodes.size(), mesh.hexahedra.size(),
          value,           reference,        std::move(unit),   std::abs(value / reference - 1)};
}

SoftRow patch_test() {
  Random random(7);
  stimuli::SolidMesh mesh = stimuli::mesh_of_box(Vec3(0.03), {4, 4, 4});
  const auto inside = nodes_where(mesh, [](const Vec3& p) {
    return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) < 0.0149;
  });
  for (const std::uint32_t i : inside)
    mesh.nodes[i] += 0.003 * Vec3(random.unit() - 0.5, random.unit() - 0.5, random.unit() - 0.5);
  const Solid solid(mesh, {.young = kYoungModulus, .poisson = kPoissonRatio});
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
  const SoftBody body(mesh, held,
                      {.material = {.young = kYoung, .poisson = kPoisson, .damping = 0},
                       .step = 10,
                       .iterations = 3,
                       .compliance = false});
  SoftState state = body.rest();
  std::vector<NodeForce> forces;
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

/// A slab on a table with a tool on it.
struct PressedSlab {
  std::shared_ptr<const SoftBody> body;
  double force = 0;  ///< N
  double sunk = 0;   ///< m, of the ideal tool
  double step_ns = 0;
};

/// \param half  m, of the slab's height
/// \param goal  m, depth of the virtual tool
PressedSlab press_slab(stimuli::SolidMesh mesh, double half, double poisson,
                       const SoftContactSettings& contact, const PlacedTool& tool,
                       const Vec3& above, double goal, const Clock& now) {
  const auto held = nodes_where(mesh, [&](const Vec3& p) { return p.z < -0.999 * half; });
  PressedSlab pressed;
  pressed.body = std::make_shared<const SoftBody>(
      std::move(mesh), held,
      SoftSettings{.material = {.young = kYoungModulus, .poisson = poisson}, .step = kStepTime});
  const SoftObject object(pressed.body, contact, 0);
  SoftObjectState state = initial_state(object);
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
  PlacedTool tool;
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

PressedSlab lying(int resolution, const Clock& now) {
  PlacedTool tool;
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
  PlacedTool tool;
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
  const SoftBody body(mesh, held,
                      {.material = {.young = kYoungModulus, .poisson = 0.49},
                       .step = kStepTime,
                       .compliance = false});
  SoftState state = body.rest();
  std::vector<NodeForce> forces;
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
  SoftSettings exact = body.settings();
  exact.iterations = 20;
  const SoftBody solved(mesh, held, exact);
  SoftState there = solved.rest();
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

}  // namespace palpate::rendering
