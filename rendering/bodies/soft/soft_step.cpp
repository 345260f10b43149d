// One step of a soft body: quasi-Newton with a guard.

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

#include "rendering/bodies/soft/soft_body.h"

namespace palpate::rendering {
namespace {

constexpr double kArmijo = 1e-4;  // of the decrease that the slope promises
constexpr int kHalvings = 30;
constexpr double kRounding = 1e-14;  // of the energy: less is no increase
// Where a whole step lowers the potential by this share of what the quadratic model says, or less
// than 1 / it, the model does not hold, and another iteration is worth its time.
constexpr double kTrusted = 0.9;

double longest(const std::vector<Vec3>& ways) {
  double square = 0;
  for (const Vec3& way : ways) square = std::max(square, glm::dot(way, way));
  return std::sqrt(square);
}

double dot(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += glm::dot(a[i], b[i]);
  return sum;
}

}  // namespace

/// m, that the body moves in a step as a whole, if nothing holds it: no search for the least
/// potential may take its momentum.
Vec3 SoftBody::rigid_way(const SoftState& state) const noexcept {
  if (free_nodes_.size() < state.x.size()) return Vec3(0);
  Vec3 momentum(0);
  double mass = 0;
  for (std::size_t i = 0; i < state.x.size(); ++i) {
    momentum += solid_.masses()[i] * state.v[i];
    mass += solid_.masses()[i];
  }
  return settings_.step * (momentum / mass + settings_.step * settings_.gravity);
}

/// From state.trial along state.step to what lowers the potential, which is put into state.trial.
/// \param change  the potential at the trial; changed with it
SoftBody::LineSearch SoftBody::search_line(SoftState& state, double& change) const noexcept {
  const double slope = dot(state.trial_gradient, state.step);
  const double rounding = kRounding * (std::abs(state.energy) + std::abs(change));
  if (!(-slope > rounding)) return LineSearch::stays;
  // Where elements are inside out the stiffness at rest may promise ways of many times the body.
  const double most = longest(state.step);
  double part = most > extent_ ? extent_ / most : 1;
  for (int halving = 0; halving <= kHalvings; ++halving, part *= 0.5) {
    for (std::size_t i = 0; i < state.trial.size(); ++i) state.trial[i] += part * state.step[i];
    const double there = change_at_trial(state);
    if (there <= change + kArmijo * part * slope + rounding) {
      const double share = (change - there) / (-0.5 * slope);
      change = there;
      if (part < 1) ++state.shortened;
      return part == 1 && share > kTrusted && share < 1 / kTrusted ? LineSearch::as_expected
                                                                   : LineSearch::moves;
    }
    for (std::size_t i = 0; i < state.trial.size(); ++i) state.trial[i] -= part * state.step[i];
    state.next_is_trial = false;
  }
  return LineSearch::stays;
}

void SoftBody::step(SoftState& state, std::span<const NodeForce> forces) const noexcept {
  const double h = settings_.step;
  add_forces(state, forces);
  ++state.steps;
  const Vec3 way = rigid_way(state);
  double change = 0;
  for (std::size_t i = 0; i < state.x.size(); ++i) {
    const double mass = solid_.masses()[i];
    const Vec3 pull = state.load[i] + mass * (state.v[i] / h + settings_.gravity);
    const Vec3 inertia = mass / (h * h) * way;
    state.trial[i] = state.x[i] + way;
    state.trial_gradient[i] = is_fixed_[i] ? Vec3(0) : state.gradient[i] - pull + inertia;
    state.step[i] = state.ahead[i] - way;
    change += glm::dot(way, 0.5 * inertia - pull);
  }
  state.next_is_trial = false;
  LineSearch found = search_line(state, change);
  for (int iteration = 1; found == LineSearch::moves && iteration < settings_.iterations;
       ++iteration) {
    find_trial_gradient(state);
    for (std::size_t i = 0; i < state.x.size(); ++i) {
      if (is_fixed_[i]) state.trial_gradient[i] = Vec3(0);
      state.step[i] = -state.trial_gradient[i];
    }
    solve(state, state.step);
    found = search_line(state, change);
  }
  for (std::size_t i = 0; i < state.x.size(); ++i) {
    state.v[i] = (state.trial[i] - state.x[i]) / h;
    state.x[i] = state.trial[i];
  }
  if (state.next_is_trial) {
    state.energy = state.next_energy;
    std::swap(state.gradient, state.next_gradient);
    std::swap(state.strains, state.next_strains);
  } else {
    state.energy = solid_.energy(state.x, state.gradient.data(), state.strains);
  }
  look_ahead(state);
}

}  // namespace palpate::rendering
