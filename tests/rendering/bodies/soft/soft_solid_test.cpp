// The elastic solid and its steps against definitions and beam theory.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <utility>
#include <vector>

#include "data/base/random.h"
#include "rendering/bodies/soft/soft_body.h"
#include "tests/rendering/bodies/soft/soft_fixtures.h"

namespace palpate::rendering {
namespace {

using stimuli::ShapeKind;

stimuli::SolidMesh soft_mesh(ShapeKind shape, int resolution) {
  stimuli::ObjectSpec spec;
  spec.shape = shape;
  spec.size = {0.06, 0.05, 0.03};
  spec.radius = 0.03;
  spec.height = 0.05;
  return stimuli::mesh_of_primitive(spec, resolution);
}

/// A tetrahedron of ten nodes whose mid-edge nodes are off the straight edges.
stimuli::SolidMesh one_tetrahedron() {
  stimuli::SolidMesh mesh;
  mesh.nodes = {{0, 0, 0}, {0.02, 0, 0}, {0, 0.02, 0}, {0, 0, 0.02}};
  for (const auto& [a, b] : {std::pair{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}})
    mesh.nodes.push_back(
        0.5 * (mesh.nodes[static_cast<std::size_t>(a)] + mesh.nodes[static_cast<std::size_t>(b)]));
  mesh.tetrahedra.push_back({0, 1, 2, 3, 4, 5, 6, 7, 8, 9});
  return mesh;
}

Vec3 random_step(Random& random, double size) {
  const auto one = [&] { return size * (2 * random.unit() - 1); };
  return {one(), one(), one()};
}

TEST(SoftSolid, VolumesAndMassesEqualShapes) {
  EXPECT_NEAR(Solid(soft_mesh(ShapeKind::box, 6), {}).volume(), 0.06 * 0.05 * 0.03, 1e-15);
  const double cylinder = M_PI * 0.03 * 0.03 * 0.05, ball = 4.0 / 3 * M_PI * 0.03 * 0.03 * 0.03;
  EXPECT_NEAR(Solid(soft_mesh(ShapeKind::cylinder, 12), {}).volume() / cylinder, 1, 0.03);
  EXPECT_NEAR(Solid(soft_mesh(ShapeKind::sphere, 12), {}).volume() / ball, 1, 0.05);
  const Solid solid(soft_mesh(ShapeKind::sphere, 6), {.density = 1200});
  double mass = 0;
  for (const double m : solid.masses()) mass += m;
  EXPECT_NEAR(mass, 1200 * solid.volume(), 1e-12);
}

TEST(SoftSolid, TheSurfaceIsClosedAndPointsOutwards) {
  for (const ShapeKind shape : {ShapeKind::box, ShapeKind::cylinder, ShapeKind::sphere}) {
    const stimuli::SolidMesh mesh = soft_mesh(shape, 5);
    double volume = 0;
    Vec3 area(0);
    for (const auto& [a, b, c] : stimuli::surface_of(mesh)) {
      volume += glm::dot(mesh.nodes[a], glm::cross(mesh.nodes[b], mesh.nodes[c])) / 6;
      area += glm::cross(mesh.nodes[b] - mesh.nodes[a], mesh.nodes[c] - mesh.nodes[a]);
    }
    EXPECT_NEAR(volume / Solid(mesh, {}).volume(), 1, 0.01);
    EXPECT_LT(glm::length(area), 1e-15);
  }
}

TEST(SoftSolid, TheGradientIsTheSlopeOfTheEnergy) {
  constexpr std::uint64_t kSeed = 3;
  Random random(kSeed);
  for (const stimuli::SolidMesh& mesh :
       {soft_mesh(ShapeKind::sphere, 4), soft_mesh(ShapeKind::box, 3), one_tetrahedron()}) {
    const Solid solid(mesh, {.young = 30000, .poisson = 0.4});
    std::vector<Vec3> x = mesh.nodes, before = mesh.nodes;
    for (Vec3& p : x) p += random_step(random, 0.003);
    for (Vec3& p : before) p += random_step(random, 0.001);
    Strains strains;
    solid.energy(before, nullptr, strains);
    std::vector<Vec3> gradient(x.size());
    solid.energy(x, strains, 3, gradient.data());
    double largest = 0;
    for (const Vec3& g : gradient) largest = std::max(largest, glm::length(g));
    for (std::size_t i = 0; i < x.size(); i += 3) {
      for (int c = 0; c < 3; ++c) {
        constexpr double kStep = 1e-7;
        std::vector<Vec3> less = x, more = x;
        less[i][c] -= kStep;
        more[i][c] += kStep;
        const double slope =
            (solid.energy(more, strains, 3, nullptr) - solid.energy(less, strains, 3, nullptr)) /
            (2 * kStep);
        EXPECT_NEAR(gradient[i][c], slope, 1e-6 * largest);
      }
    }
  }
}

TEST(SoftSolid, StiffnessIsTheGradientsSlopeAtRest) {
  const stimuli::SolidMesh mesh = soft_mesh(ShapeKind::cylinder, 2);
  const Solid solid(mesh, {.young = 30000, .poisson = 0.4});
  constexpr std::uint64_t kSeed = 5;
  Random random(kSeed);
  std::vector<Vec3> step, by_matrix(mesh.nodes.size(), Vec3(0));
  for (std::size_t i = 0; i < mesh.nodes.size(); ++i) step.push_back(random_step(random, 1));
  for (const Solid::Block& block : solid.stiffness()) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j)
        by_matrix[block.row][i] += block.value[3 * i + j] * step[block.column][j];
    }
  }
  constexpr double kStep = 1e-7;
  std::vector<Vec3> less = mesh.nodes, more = mesh.nodes, low(step.size()), high(step.size());
  for (std::size_t i = 0; i < step.size(); ++i) {
    less[i] -= kStep * step[i];
    more[i] += kStep * step[i];
  }
  solid.energy(less, low.data());
  solid.energy(more, high.data());
  for (std::size_t i = 0; i < step.size(); ++i)
    EXPECT_LT(glm::length((high[i] - low[i]) / (2 * kStep) - by_matrix[i]), 1e-2);  // of 1e3 N/m
}

// Elements of any shape represent a uniform strain exactly: inner forces cancel.
TEST(SoftSolid, ElementsOfAnyShapeTakeAUniformStrain) {
  constexpr std::uint64_t kSeed = 7;
  Random random(kSeed);
  stimuli::SolidMesh mesh = stimuli::mesh_of_box({0.03, 0.03, 0.03}, {4, 4, 4});
  const auto inside = [](const Vec3& p) {
    return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) < 0.0149;
  };
  std::vector<bool> is_inside(mesh.nodes.size());
  for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
    is_inside[i] = inside(mesh.nodes[i]);
    if (is_inside[i]) mesh.nodes[i] += random_step(random, 0.0015);
  }
  const Solid solid(mesh, {.young = 20000, .poisson = 0.45});
  const Mat3 strain(1.1, 0.1, -0.05, 0.2, 0.9, 0.03, 0, 0.1, 1.05);
  std::vector<Vec3> x, forces(mesh.nodes.size());
  for (const Vec3& p : mesh.nodes) x.push_back(strain * p);
  solid.energy(x, forces.data());
  double within = 0, outside = 0;
  for (std::size_t i = 0; i < x.size(); ++i)
    (is_inside[i] ? within : outside) =
        std::max(is_inside[i] ? within : outside, glm::length(forces[i]));
  EXPECT_GT(outside, 0.1);
  EXPECT_LT(within, 1e-12 * outside);
}

TEST(SoftSolid, ARotationIsNotAStrain) {
  const stimuli::SolidMesh mesh = soft_mesh(ShapeKind::sphere, 4);
  const Solid solid(mesh, {});
  const Quat turn = glm::angleAxis(2.0, glm::normalize(Vec3(1, 2, -1)));
  std::vector<Vec3> x;
  for (const Vec3& p : mesh.nodes) x.push_back(turn * p + Vec3(0.1, 0, 0));
  Strains rest;
  solid.energy(mesh.nodes, nullptr, rest);
  EXPECT_NEAR(solid.energy(x, rest, 10, nullptr), 0, 1e-15);
}

/// A beam along x, held at one end, with a force at the other; its deflection, m.
double beam_deflection(int along, int across, double force) {
  constexpr double kLength = 0.1, kSide = 0.01;
  stimuli::SolidMesh mesh = stimuli::mesh_of_box({kLength, kSide, kSide}, {along, across, across});
  std::vector<std::uint32_t> held, loaded;
  for (std::uint32_t i = 0; i < mesh.nodes.size(); ++i) {
    if (mesh.nodes[i].x < -0.0499) held.push_back(i);
    if (mesh.nodes[i].x > 0.0499) loaded.push_back(i);
  }
  const SoftBody body(mesh, held,
                      {.material = {.young = 1e5, .poisson = 0.3, .damping = 0},
                       .step = 10,
                       .iterations = 3,
                       .compliance = false});
  SoftState state = body.rest();
  std::vector<NodeForce> forces;
  for (const std::uint32_t node : loaded) {
    const double y = std::abs(mesh.nodes[node].y), z = std::abs(mesh.nodes[node].z);
    const double share = (y > 0.00499 ? 0.5 : 1) * (z > 0.00499 ? 0.5 : 1) / (across * across);
    forces.push_back({body.surface_index(node), Vec3(0, 0, -force * share)});
  }
  for (int i = 0; i < 20; ++i) body.step(state, forces);
  double sum = 0;
  for (const std::uint32_t node : loaded) sum += mesh.nodes[node].z - state.x[node].z;
  return sum / static_cast<double>(loaded.size());
}

TEST(SoftSolid, ACantileverBendsByBeamTheory) {
  // Timoshenko: F L^3 / (3 E I) + F L / (shear coefficient G A), small deflection.
  constexpr double kForce = 1e-5, kInertia = 1e-8 / 12;
  const double shear = 10 * 1.3 / (12 + 11 * 0.3), g = 1e5 / 2.6;
  const double theory = kForce * 1e-3 / (3 * 1e5 * kInertia) + kForce * 0.1 / (shear * g * 1e-4);
  const double coarse = beam_deflection(20, 2, kForce) / theory;
  const double fine = beam_deflection(40, 4, kForce) / theory;
  EXPECT_NEAR(fine, 1, 0.06);
  EXPECT_LT(std::abs(fine - 1), 0.4 * std::abs(coarse - 1));  // of second order: a quarter
}

/// Presses the upper face of a box by `depth` of its height, then releases it.
struct Pressed {
  SoftBody body;
  SoftState state;
};

Pressed pressed_box(double poisson) {
  stimuli::SolidMesh mesh = stimuli::mesh_of_box({0.06, 0.06, 0.03}, {6, 6, 3});
  const auto held = nodes_below(mesh, -0.0149);
  Pressed pressed{
      SoftBody(
          mesh, held,
          {.material = {.young = 20000, .poisson = poisson}, .step = 0.004, .compliance = false}),
      {}};
  pressed.state = pressed.body.rest();
  std::vector<NodeForce> forces;
  for (std::uint32_t i = 0; i < mesh.nodes.size(); ++i) {
    const Vec3& p = mesh.nodes[i];
    if (p.z > 0.0149 && std::abs(p.x) < 0.015 && std::abs(p.y) < 0.015)
      forces.push_back({pressed.body.surface_index(i), Vec3(0, 0, -0.4)});
  }
  for (int i = 0; i < 300; ++i) pressed.body.step(pressed.state, forces);
  return pressed;
}

TEST(SoftSolid, NearlyIncompressibleKeepsVolumeWithoutLocking) {
  const Pressed soft = pressed_box(0.3), pressed = pressed_box(0.49);
  const Solid& solid = pressed.body.solid();
  const auto sunk = [](const Pressed& p) { return farthest(p.state.x, p.body.mesh().nodes); };
  EXPECT_GT(sunk(pressed), 0.003);
  EXPECT_NEAR(solid.volume(pressed.state.x) / solid.volume(), 1, 0.01);
  EXPECT_GT(sunk(pressed), 0.6 * sunk(soft));
}

TEST(SoftSolid, TheRestShapeComesBack) {
  Pressed pressed = pressed_box(0.45);
  for (int i = 0; i < 1000; ++i) pressed.body.step(pressed.state, {});
  EXPECT_LT(farthest(pressed.state.x, pressed.body.mesh().nodes), 1e-6);
}

TEST(SoftSolid, FallsFreelyWithoutSupport) {
  stimuli::SolidMesh mesh = soft_mesh(ShapeKind::sphere, 3);
  const SoftBody body(
      mesh, {}, {.material = {}, .step = 0.001, .gravity = {0, 0, -9.81}, .compliance = false});
  SoftState state = body.rest();
  for (int i = 0; i < 100; ++i) body.step(state, {});
  // Implicit Euler: sum of n h^2 g.
  const double fallen = 9.81 * 1e-6 * 100 * 101 / 2;
  for (std::size_t i = 0; i < mesh.nodes.size(); ++i)
    EXPECT_LT(glm::distance(state.x[i], mesh.nodes[i] - Vec3(0, 0, fallen)), 1e-9);
}

TEST(SoftSolid, SmallBodiesFallAsFastAsLargeOnes) {
  for (const double size : {0.002, 0.02}) {
    const stimuli::SolidMesh mesh = stimuli::mesh_of_box(Vec3(size), {2, 2, 2});
    const SoftBody body(
        mesh, {}, {.material = {}, .step = 0.004, .gravity = {0, 0, -9.81}, .compliance = false});
    SoftState state = body.rest();
    for (int i = 0; i < 250; ++i) body.step(state, {});
    const double fallen = 9.81 * 16e-6 * 250 * 251 / 2;  // 4.9 m, 40 mm in the last step
    EXPECT_NEAR(state.x[0].z, mesh.nodes[0].z - fallen, 1e-6) << size;
  }
}

TEST(SoftSolid, ABodyThatWasPushedKeepsItsMomentum) {
  // A body of a thirtieth of a milligram, whose steps the guard often shortens.
  const stimuli::SolidMesh mesh = stimuli::mesh_of_box({0.001, 0.001, 0.0003}, {10, 10, 3});
  const SoftBody body(
      mesh, {}, {.material = {.young = 1e5, .density = 100}, .step = 0.004, .compliance = false});
  SoftState state = body.rest();
  const auto momentum = [&] {
    Vec3 sum(0);
    for (std::size_t i = 0; i < state.v.size(); ++i) sum += body.solid().masses()[i] * state.v[i];
    return sum;
  };
  std::uint32_t node = 0;
  for (std::uint32_t i = 0; i < mesh.nodes.size(); ++i) {
    if (mesh.nodes[i].x > 0.00049) node = i;
  }
  const NodeForce push{body.surface_index(node), {0, 0, 7.5e-10}};
  for (int i = 0; i < 5; ++i) body.step(state, {&push, 1});
  const Vec3 given = momentum();
  EXPECT_GT(given.z, 0);
  for (int i = 0; i < 250; ++i) body.step(state, {});
  EXPECT_LT(glm::distance(momentum(), given), 1e-5 * glm::length(given));
}

}  // namespace
}  // namespace palpate::rendering
