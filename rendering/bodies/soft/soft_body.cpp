#include "rendering/bodies/soft/soft_body.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <stdexcept>
#include <string>
#include <utility>

namespace palpate::rendering {
namespace {

bool is_finite(const Vec3& v) { return std::isfinite(v.x + v.y + v.z); }

std::vector<bool> marked(std::size_t count, const std::vector<std::uint32_t>& which) {
  std::vector<bool> marks(count, false);
  for (const std::uint32_t i : which) marks[i] = true;
  return marks;
}

std::vector<std::uint32_t> unmarked(const std::vector<bool>& marks) {
  std::vector<std::uint32_t> rest;
  for (std::uint32_t i = 0; i < marks.size(); ++i) {
    if (!marks[i]) rest.push_back(i);
  }
  return rest;
}

/// Mass / step^2 + (1 + damping / step) stiffness, of the free nodes.
stimuli::Factor factorised(const Solid& solid, const std::vector<bool>& is_fixed,
                           const std::vector<std::uint32_t>& free, const SoftSettings& settings) {
  std::vector<std::uint32_t> row(is_fixed.size());
  std::vector<stimuli::MatrixEntry> entries;
  for (std::uint32_t i = 0; i < free.size(); ++i) {
    row[free[i]] = 3 * i;
    const double mass = solid.masses()[free[i]];
    if (!(mass > 0))
      throw std::invalid_argument("node " + std::to_string(free[i] + 1) + " belongs to no element");
    for (std::uint32_t c = 0; c < 3; ++c)
      entries.push_back({3 * i + c, 3 * i + c, mass / (settings.step * settings.step)});
  }
  const double scale = 1 + settings.material.damping / settings.step;
  for (const Solid::Block& block : solid.stiffness()) {
    if (is_fixed[block.row] || is_fixed[block.column]) continue;
    for (std::uint32_t i = 0; i < 3; ++i) {
      for (std::uint32_t j = 0; j < 3; ++j) {
        entries.push_back(
            {row[block.row] + i, row[block.column] + j, scale * block.value[3 * i + j]});
      }
    }
  }
  return {3 * free.size(), entries};
}

constexpr double kArmijo = 1e-4;  // of the decrease predicted by the slope
constexpr int kHalvings = 30;
constexpr double kRounding = 1e-14;  // of the energy: less is not an increase
// The quadratic model is trusted if a whole step lowers the potential by between this share of the
// predicted decrease and 1 / it. Otherwise another iteration is worth its time.
constexpr double kTrusted = 0.9;

double dot(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += glm::dot(a[i], b[i]);
  return sum;
}

double longest(const std::vector<Vec3>& ways) {
  double square = 0;
  for (const Vec3& way : ways) square = std::max(square, glm::dot(way, way));
  return std::sqrt(square);
}

}  // namespace

SoftBody::SoftBody(stimuli::SolidMesh mesh, const std::vector<std::uint32_t>& fixed,
                   const SoftSettings& settings)
    : mesh_(std::move(mesh)),
      settings_(settings),
      solid_(mesh_, settings.material),
      is_fixed_(marked(mesh_.nodes.size(), fixed)),
      free_nodes_(unmarked(is_fixed_)),
      factor_(factorised(solid_, is_fixed_, free_nodes_, settings)),
      surface_(stimuli::surface_of(mesh_)) {
  for (const Vec3& node : mesh_.nodes)
    extent_ = std::max(extent_, glm::distance(node, mesh_.nodes.front()));
  find_surface();
  if (settings.compliance) find_compliance();
}

void SoftBody::find_surface() {
  surface_index_.assign(mesh_.nodes.size(), kInside);
  for (const stimuli::SolidFace& triangle : surface_) {
    for (const std::uint32_t node : triangle) {
      if (surface_index_[node] != kInside) continue;
      surface_index_[node] = static_cast<std::uint32_t>(surface_nodes_.size());
      surface_nodes_.push_back(node);
    }
  }
}

void SoftBody::find_compliance() {
  constexpr std::size_t kTogether = stimuli::Factor::kTogether;
  const std::size_t count = surface_nodes_.size(), size = factor_.size();
  std::vector<std::uint32_t> row(mesh_.nodes.size());
  for (std::uint32_t i = 0; i < free_nodes_.size(); ++i) row[free_nodes_[i]] = 3 * i;
  compliance_.assign(9 * count * count, 0);
  std::vector<double> sides(size * kTogether), work(2 * size * kTogether);
  for (std::size_t first = 0; first < 3 * count; first += kTogether) {
    const std::size_t last = std::min(first + kTogether, 3 * count);
    std::fill(sides.begin(), sides.end(), 0.0);
    for (std::size_t c = first; c < last; ++c) {
      const std::uint32_t node = surface_nodes_[c / 3];
      if (!is_fixed_[node]) sides[(row[node] + c % 3) * kTogether + (c - first)] = 1;
    }
    factor_.solve_several(sides, work);
    for (std::size_t a = 0; a < count; ++a) {
      const std::uint32_t node = surface_nodes_[a];
      if (is_fixed_[node]) continue;
      for (std::size_t c = first; c < last; ++c) {
        for (std::size_t i = 0; i < 3; ++i) {
          compliance_[9 * (a * count + c / 3) + 3 * i + c % 3] =
              static_cast<float>(sides[(row[node] + i) * kTogether + (c - first)]);
        }
      }
    }
  }
}

SoftState SoftBody::rest() const {
  SoftState state;
  const std::size_t n = mesh_.nodes.size();
  state.x = mesh_.nodes;
  for (auto* const field : {&state.v, &state.gradient, &state.load, &state.ahead, &state.by_load,
                            &state.trial, &state.step, &state.trial_gradient, &state.next_gradient})
    field->assign(n, Vec3(0));
  state.pack.resize(factor_.size());
  state.work.resize(2 * factor_.size());
  state.energy = solid_.energy(state.x, state.gradient.data(), state.strains);
  state.next_strains = state.strains;
  look_ahead(state);
  return state;
}

/// Replaces forces b by the displacements that they cause.
void SoftBody::solve(SoftState& state, std::vector<Vec3>& b) const noexcept {
  for (std::size_t i = 0; i < free_nodes_.size(); ++i) {
    for (int c = 0; c < 3; ++c)
      state.pack[3 * i + static_cast<std::size_t>(c)] = b[free_nodes_[i]][c];
  }
  factor_.solve(state.pack, state.work);
  std::fill(b.begin(), b.end(), Vec3(0));
  for (std::size_t i = 0; i < free_nodes_.size(); ++i)
    b[free_nodes_[i]] = {state.pack[3 * i], state.pack[3 * i + 1], state.pack[3 * i + 2]};
}

void SoftBody::look_ahead(SoftState& state) const noexcept {
  for (std::size_t i = 0; i < state.x.size(); ++i) {
    state.ahead[i] = solid_.masses()[i] * (state.v[i] / settings_.step + settings_.gravity) +
                     state.load[i] - state.gradient[i];
  }
  solve(state, state.ahead);
}

/// Replaces the last load by the forces; adds the effect of the change to `ahead` and `by_load`.
void SoftBody::add_forces(SoftState& state, std::span<const NodeForce> forces) const noexcept {
  std::vector<Vec3>& change = state.step;
  for (std::size_t i = 0; i < state.load.size(); ++i) change[i] = -state.load[i];
  std::fill(state.load.begin(), state.load.end(), Vec3(0));
  bool any = false;
  for (const NodeForce& f : forces) {
    if (!is_finite(f.force)) continue;
    const std::uint32_t node = surface_nodes_[f.surface_node];
    state.load[node] += f.force;
    any |= f.force != Vec3(0);
  }
  bool changes = false;
  for (std::size_t i = 0; i < state.load.size(); ++i) {
    change[i] += state.load[i];
    changes |= change[i] != Vec3(0);
  }
  if (!changes) return;
  solve(state, change);
  for (std::size_t i = 0; i < state.load.size(); ++i) {
    state.ahead[i] += change[i];
    state.by_load[i] = any ? state.by_load[i] + change[i] : Vec3(0);
  }
}

/// J, of inertia, gravity and load from the step's start to x.
/// \param gradient  receives the sum; null: not wanted
double SoftBody::work_against(const SoftState& state, std::span<const Vec3> x,
                              Vec3* gradient) const {
  const double h = settings_.step;
  double change = 0;
  for (const std::uint32_t i : free_nodes_) {
    const double mass = solid_.masses()[i];
    const Vec3 moved = x[i] - state.x[i];
    const Vec3 pull = mass * (state.v[i] / h + settings_.gravity) + state.load[i];
    change += glm::dot(moved, 0.5 * mass / (h * h) * moved - pull);
    if (gradient != nullptr) gradient[i] += mass / (h * h) * moved - pull;
  }
  return change;
}

/// Incremental potential at the trial less that at the step's start. Also computes the next step's
/// initial values, in case this step ends there.
double SoftBody::change_at_trial(SoftState& state) const noexcept {
  const Solid::Potential there =
      solid_.potential(state.trial, state.strains, settings_.material.damping / settings_.step,
                       state.next_gradient.data(), state.next_strains);
  state.next_energy = there.elastic;
  state.next_is_trial = true;
  return there.damped - state.energy + work_against(state, state.trial, nullptr);
}

/// Sets the gradient of the incremental potential at the trial.
void SoftBody::find_trial_gradient(SoftState& state) const noexcept {
  solid_.energy(state.trial, state.strains, settings_.material.damping / settings_.step,
                state.trial_gradient.data());
  work_against(state, state.trial, state.trial_gradient.data());
}

// One step of a soft body: quasi-Newton with a guard.

/// m, motion of the whole body in a step if nothing holds it: the minimisation must not remove its
/// momentum.
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

/// Searches from state.trial along state.step for a lower potential; sets state.trial to it.
/// \param change  the potential at the trial; updated with it
SoftBody::LineSearch SoftBody::search_line(SoftState& state, double& change) const noexcept {
  const double slope = dot(state.trial_gradient, state.step);
  const double rounding = kRounding * (std::abs(state.energy) + std::abs(change));
  if (!(-slope > rounding)) return LineSearch::stays;
  // Where elements are inside out, the stiffness at rest may predict motions of many times the
  // body's size.
  const double most = longest(state.step);
  double part = most > extent_ ? extent_ / most : 1;
  for (int halving = 0; halving <= kHalvings; ++halving, part *= 0.5) {
    for (std::size_t i = 0; i < state.trial.size(); ++i) state.trial[i] += part * state.step[i];
    const double there = change_at_trial(state);
    if (there <= change + kArmijo * part * slope + rounding) {
      const double share = (change - there) / (-0.5 * slope);
      change = there;
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
