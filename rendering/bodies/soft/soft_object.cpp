#include "rendering/bodies/soft/soft_object.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <span>

namespace palpate::rendering {
namespace {

constexpr double kEarly = 1e-9;        // s; sums of ticks fall short of a step by rounding
constexpr double kFarthestAhead = 2;   // steps beyond the view, covered by clusters' boxes
constexpr double kFarthestNode = 1e3;  // m

void add_impulse(SoftObjectState& state, double dt) {
  for (const NodeForce& f : state.contact.forces) {
    Vec3& impulse = state.impulse[f.surface_node];
    if (impulse == Vec3(0)) state.impelled.push_back(f.surface_node);
    impulse += dt * f.force;
    if (impulse == Vec3(0)) state.impelled.pop_back();
  }
}

/// Requests a step with the mean force since the last one.
void ask_for_step(SoftObjectState& state) {
  state.mean.clear();
  for (const std::uint32_t node : state.impelled) {
    state.mean.push_back({node, state.impulse[node] / state.since_step});
    state.impulse[node] = Vec3(0);
  }
  state.impelled.clear();
  state.since_step = 0;
  state.waiting = true;
  if (state.stepper != nullptr) state.stepper->ask(state.mean);
}

void take_step(const SoftObject& object, SoftObjectState& state) {
  const bool good = state.stepper != nullptr
                        ? state.stepper->take(state.view)
                        : step_and_look(object, state.body, state.mean, state.view);
  state.failed = state.failed || !good;
  state.view_age = state.since_step;
  state.waiting = false;
}

/// Takes a due step if one may arrive in this tick.
void take_due_step(const SoftObject& object, SoftObjectState& state) {
  if (state.pace == SoftPace::hold || !state.waiting || !step_is_due(object, state, 0)) return;
  take_step(object, state);
  if (state.pace == SoftPace::this_tick) state.pace = SoftPace::hold;
}

}  // namespace

double SoftObject::node_spacing() const {
  double area = 0;
  for (const auto& [i, j, k] : surface.triangles())
    area += 0.5 * glm::length(glm::cross(rest[j] - rest[i], rest[k] - rest[i]));
  return std::sqrt(area / static_cast<double>(rest.size()));
}

SoftObjectState initial_state(const SoftObject& object) {
  SoftObjectState state;
  state.body = object.body->rest();
  state.view = object.surface.first_view(*object.body, state.body);
  state.contact = SoftContactMemory(*object.body, object.contact);
  state.impulse.assign(object.body->surface_nodes().size(), Vec3(0));
  state.impelled.reserve(2 * state.impulse.size());
  state.mean.reserve(2 * state.impulse.size());
  return state;
}

void keep_room(const SoftObjectState& original, SoftObjectState& copy) {
  copy.contact.contacts.reserve(original.contact.contacts.capacity());
  copy.contact.found.reserve(original.contact.found.capacity());
  copy.contact.forces.reserve(original.contact.forces.capacity());
  copy.contact.local.reserve(original.contact.local.capacity());
  copy.impelled.reserve(original.impelled.capacity());
  copy.mean.reserve(original.mean.capacity());
}

bool step_is_due(const SoftObject& object, const SoftObjectState& state, double dt) noexcept {
  return state.waiting &&
         state.since_step + dt >= object.delay * object.body->settings().step - kEarly;
}

bool is_stalled(const SoftObjectState& state) noexcept {
  return state.waiting && state.since_step > kStalledAfter;
}

bool step_and_look(const SoftObject& object, SoftState& body, std::span<const NodeForce> forces,
                   SoftView& view) noexcept {
  object.body->step(body, forces);
  object.surface.look(*object.body, body, view);
  double most = 0;
  bool numbers = std::isfinite(body.energy);
  for (std::size_t i = 0; i < view.x.size(); ++i) {
    const Vec3& x = view.x[i];
    const Vec3& ahead = view.ahead[i];
    numbers = numbers && std::isfinite(x.x + x.y + x.z + ahead.x + ahead.y + ahead.z);
    most = std::max({most, std::abs(x.x), std::abs(x.y), std::abs(x.z)});
  }
  return numbers && most <= kFarthestNode;
}

Vec3 advance(const SoftObject& object, SoftObjectState& state, const Vec3& tip,
             const PlacedTool& tool, double step, double dt) noexcept {
  const double h = object.body->settings().step;
  state.since_step += dt;
  state.view_age += dt;
  take_due_step(object, state);
  if (state.failed) return Vec3(0);
  const double fraction = std::min(state.view_age / h, kFarthestAhead);
  const SoftMoment moment{*object.body, object.surface, state.view, fraction};
  Vec3 force(0);
  if (!state.started || state.off) {
    const bool inside = is_inside(moment, object.contact.radius, tip, tool);
    state.off = inside;
    state.started = true;
  }
  if (!state.off) force = follow_surface(moment, object.contact, tip, tool, step, state.contact);
  add_impulse(state, dt);
  // Wait for a late step: the next one gets the mean force of the whole time.
  if (!state.waiting && state.since_step >= h - kEarly) {
    ask_for_step(state);
    if (object.delay * h <= kEarly) take_due_step(object, state);
  }
  return force;
}

}  // namespace palpate::rendering
