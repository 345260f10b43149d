#include "rendering/bodies/soft/soft_coupling.h"

#include <glm/geometric.hpp>

namespace palpate::rendering {
namespace {

constexpr double kEarly = 1e-9;  // s; sums of ticks fall short of a step by rounding

void add_impulse(SoftObjectState& state, double dt) {
  for (const NodeForce& f : state.contact.forces) {
    Vec3& impulse = state.impulse[f.surface_node];
    if (impulse == Vec3(0)) state.impelled.push_back(f.surface_node);
    impulse += dt * f.force;
    if (impulse == Vec3(0)) state.impelled.pop_back();
  }
}

/// The mean force since the last step is what the next one gets.
void ask_for_step(SoftObjectState& state) {
  state.mean.clear();
  for (const std::uint32_t node : state.impelled) {
    state.mean.push_back({node, state.impulse[node] / state.since_step});
    state.impulse[node] = Vec3(0);
  }
  state.impelled.clear();
  state.since_step = 0;
  state.waiting = true;
}

void take_step(const SoftObject& object, SoftObjectState& state) {
  object.body->step(state.body, state.mean);
  object.surface.look(*object.body, state.body, state.view);
  state.view_age = state.since_step;
  state.waiting = false;
}

}  // namespace

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

Vec3 advance(const SoftObject& object, SoftObjectState& state, const Vec3& tip,
             const PlacedTool& tool, double step, double dt) noexcept {
  const double h = object.body->settings().step;
  state.since_step += dt;
  state.view_age += dt;
  if (state.waiting && state.since_step >= object.delay * h - kEarly) take_step(object, state);
  const SoftMoment moment{*object.body, object.surface, state.view, state.view_age / h};
  Vec3 force(0);
  if (!state.started || state.off) {
    const bool inside = is_inside(moment, object.contact.radius, tip, tool);
    state.off = inside;
    state.started = true;
  }
  if (!state.off) force = follow_surface(moment, object.contact, tip, tool, step, state.contact);
  add_impulse(state, dt);
  if (state.since_step >= h - kEarly) {
    ask_for_step(state);
    if (object.delay * h <= kEarly) take_step(object, state);
  }
  return force;
}

}  // namespace palpate::rendering
