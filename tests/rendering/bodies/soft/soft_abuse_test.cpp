// Soft bodies deformed into extreme shapes, shaken and struck: they stay finite and return.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <string>
#include <vector>

#include "data/base/random.h"
#include "rendering/bodies/soft/soft_body.h"
#include "tests/rendering/bodies/soft/soft_fixtures.h"

namespace palpate::rendering {
namespace {

enum class Abuse { sudden, twist, inversion, shake, strike, no_number };

void set_abused_shape(Abuse abuse, SoftState& state) {
  for (Vec3& p : state.x) {
    const double up = (p.z + 0.015) / 0.03;
    if (abuse == Abuse::sudden) p.z -= 0.02 * up;
    if (abuse == Abuse::twist) p = glm::angleAxis(up * M_PI / 2, Vec3(0, 0, 1)) * p;
    if (abuse == Abuse::inversion) p.z = -0.015 - (p.z + 0.015);
  }
}

class AbusedSoftBody : public testing::TestWithParam<Abuse> {
 protected:
  static SoftBody body(double young, double step) {
    return {mesh_,
            nodes_below(mesh_, -0.0149),
            {.material = {.young = young, .damping = 0.02}, .step = step, .compliance = false}};
  }

  /// The state after 60 steps, each of which must be finite.
  static SoftState abused(const SoftBody& body) {
    const double step = body.settings().step;
    SoftState state = body.rest();
    set_abused_shape(GetParam(), state);
    state.energy = body.solid().energy(state.x, state.gradient.data(), state.strains);
    std::vector<NodeForce> top;
    for (std::uint32_t i = 0; i < mesh_.nodes.size(); ++i) {
      if (mesh_.nodes[i].z > 0.0149) top.push_back({body.surface_index(i), Vec3(0)});
    }
    for (int i = 0; i < 60; ++i) {
      for (NodeForce& f : top) {
        if (GetParam() == Abuse::shake)
          f.force.x = body.settings().material.young * 1e-4 * std::sin(2 * M_PI * 50 * i * step);
        if (GetParam() == Abuse::strike) f.force.z = i == 0 ? -1e6 : 0;
        if (GetParam() == Abuse::no_number) f.force.z = i % 2 ? NAN : INFINITY;
      }
      body.step(state, top);
      EXPECT_TRUE(std::isfinite(state.energy)) << i;
    }
    return state;
  }

  inline static const stimuli::SolidMesh mesh_ =
      stimuli::mesh_of_box({0.03, 0.03, 0.03}, {3, 3, 3});
};

TEST_P(AbusedSoftBody, StaysFinite) {
  for (const double young : {1e3, 3e4, 1e6}) {
    for (const double step : {0.001, 0.004, 0.016}) abused(body(young, step));
  }
}

TEST_P(AbusedSoftBody, ComesBack) {
  for (const double young : {1e3, 3e4, 1e6}) {
    const SoftBody body = AbusedSoftBody::body(young, 0.004);
    SoftState state = abused(body);
    // The softest swings at 5 Hz; far from rest the guard makes short steps.
    for (int i = 0; i < 1600; ++i) body.step(state, {});
    EXPECT_LT(farthest(state.x, mesh_.nodes), 1e-6) << young << " Pa";
  }
}

INSTANTIATE_TEST_SUITE_P(All, AbusedSoftBody,
                         testing::Values(Abuse::sudden, Abuse::twist, Abuse::inversion,
                                         Abuse::shake, Abuse::strike, Abuse::no_number));

/// Where the stiffness at rest predicts motions of a thousand times the body's size, the step must
/// not hang.
TEST(SoftSolid, RandomlyScatteredNodesReturn) {
  for (const double size : {0.001, 1.0}) {
    for (const double poisson : {0.3, 0.495}) {
      const stimuli::SolidMesh mesh = stimuli::mesh_of_box({size, size, size}, {3, 3, 3});
      const SoftBody body(mesh, nodes_below(mesh, -0.499 * size),
                          {.material = {.young = 1e6, .poisson = poisson, .damping = 0.01},
                           .step = 0.001,
                           .compliance = false});
      for (const std::uint64_t seed : {1, 2}) {
        SCOPED_TRACE(std::to_string(size) + " m, " + std::to_string(poisson) + ", seed " +
                     std::to_string(seed));
        Random random(seed);
        SoftState state = body.rest();
        for (std::size_t i = 0; i < state.x.size(); ++i) {
          if (body.is_fixed(static_cast<std::uint32_t>(i))) continue;
          for (int c = 0; c < 3; ++c) state.x[i][c] = 8 * size * (random.unit() - 0.5);
        }
        state.energy = body.solid().energy(state.x, state.gradient.data(), state.strains);
        const double scattered = state.energy;
        for (int i = 0; i < 2000; ++i) body.step(state, {});
        const double later = state.energy;
        for (int i = 0; i < (poisson < 0.4 ? 4000 : 500); ++i) body.step(state, {});
        if (poisson < 0.4) {
          EXPECT_LT(farthest(state.x, mesh.nodes), 1e-6 * std::max(1.0, size / 0.03));
        } else {  // a nearly incompressible body unfolds slowly: the guard shortens steps
          EXPECT_LT(later, 0.01 * scattered);
          EXPECT_LT(state.energy, 0.995 * later);
        }
      }
    }
  }
}

TEST(SoftSolid, NoStepRaisesTheIncrementalPotential) {
  const stimuli::SolidMesh mesh = stimuli::mesh_of_box({0.03, 0.03, 0.03}, {3, 3, 3});
  const SoftBody body(
      mesh, nodes_below(mesh, -0.0149),
      {.material = {.young = 1e6, .damping = 0}, .step = 0.016, .compliance = false});
  SoftState state = body.rest();
  set_abused_shape(Abuse::twist, state);
  state.energy = body.solid().energy(state.x, state.gradient.data(), state.strains);
  double last = state.energy;  // with kinetic energy: implicit Euler never gains energy
  for (int i = 0; i < 200; ++i) {
    body.step(state, {});
    double now = state.energy;
    for (std::size_t k = 0; k < state.v.size(); ++k)
      now += 0.5 * body.solid().masses()[k] * glm::dot(state.v[k], state.v[k]);
    EXPECT_LE(now, last * (1 + 1e-12) + 1e-18);
    last = now;
  }
}

}  // namespace
}  // namespace palpate::rendering
