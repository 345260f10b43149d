#include "rendering/bodies/soft/soft_body.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <stdexcept>
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
Factor factorised(const Solid& solid, const std::vector<bool>& is_fixed,
                  const std::vector<std::uint32_t>& free, const SoftSettings& settings) {
  std::vector<std::uint32_t> row(is_fixed.size());
  std::vector<MatrixEntry> entries;
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
  for (const stimuli::SurfaceTriangle& triangle : surface_) {
    for (const std::uint32_t node : triangle) {
      if (surface_index_[node] != kInside) continue;
      surface_index_[node] = static_cast<std::uint32_t>(surface_nodes_.size());
      surface_nodes_.push_back(node);
    }
  }
}

void SoftBody::find_compliance() {
  constexpr std::size_t kTogether = Factor::kTogether;
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

/// b becomes the displacements by the forces b.
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

/// Puts the forces in place of the last load; what changes is added to `ahead` and `by_load`.
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

/// J, of inertia, gravity and load from the step's start to x. \param gradient  it is added to;
/// null: not wanted
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

/// Incremental potential at the trial less that at the step's start. What the next step begins
/// with, if this one ends there, comes with it.
double SoftBody::change_at_trial(SoftState& state) const noexcept {
  const Solid::Potential there =
      solid_.potential(state.trial, state.strains, settings_.material.damping / settings_.step,
                       state.next_gradient.data(), state.next_strains);
  state.next_energy = there.elastic;
  state.next_is_trial = true;
  return there.damped - state.energy + work_against(state, state.trial, nullptr);
}

/// Of the incremental potential.
void SoftBody::find_trial_gradient(SoftState& state) const noexcept {
  solid_.energy(state.trial, state.strains, settings_.material.damping / settings_.step,
                state.trial_gradient.data());
  work_against(state, state.trial, state.trial_gradient.data());
}

}  // namespace palpate::rendering
