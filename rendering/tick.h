#pragma once
// One tick of the servo: from the pose of the virtual probe to the force on the hand. The path of a
// force: renderer.cpp > tick.h > facet_walk.cpp.
//
// A template over the probe (tip or whole segment: probes.h) and over the features that the scene
// needs (TickFeatures). World frame, SI units. Nothing here throws, allocates, locks or does I/O.
// Included only where ticks are instantiated.

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <span>

#include "rendering/contact.h"
#include "rendering/contact_detection.h"
#include "rendering/equivalent_point.h"
#include "rendering/renderer.h"
#include "rendering/scene.h"
#include "rendering/surface_contact.h"
#include "rendering/texture.h"
#include "rendering/union_contact.h"

namespace palpate::rendering::tick {

/// Applies the contact's material to its force: damping and friction, beyond the plain spring.
/// \param motion  m, of the probe at the contact since the last tick
/// \param rate    1/s, ticks; 0 when unknown: no damping
template <TickFeatures kFeatures>
[[gnu::always_inline]] inline void apply_material(LoadedContact& c,
                                                  const stimuli::Material& material,
                                                  const Vec3& motion, double rate,
                                                  FrictionState& friction) {
  if (kFeatures.damping && material.damping > 0 && c.normal_displacement > 0) {
    const double closing_speed = -glm::dot(motion, c.contact.normal) * rate;
    c.force = std::max(0.0, c.force + material.damping * closing_speed);
  }
  if (kFeatures.friction && material.has_friction()) apply_friction(c, material, motion, friction);
}

/// Applies damping and friction of the parts' materials to the loaded contacts' forces.
/// \param probe  the virtual probe, world frame
template <TickFeatures kFeatures>
[[gnu::always_inline]] inline void apply_material_forces(const Scene& scene, RenderState& state,
                                                         const LineProbe& probe,
                                                         std::span<LoadedContact> contacts,
                                                         double rate) {
  if constexpr (kFeatures.friction) {
    for (const auto& c : contacts) {
      FrictionState& friction = state.parts[c.part].friction;
      if (!friction.in_contact) friction = {};
    }
    for (const std::uint32_t i : state.near_parts) state.parts[i].friction.in_contact = false;
  }
  for (auto& c : contacts) {
    const LineProbe& last = state.has_last ? state.last : probe;
    const Vec3 motion = (1 - c.probe_fraction) * (probe.tip - last.tip) +
                        c.probe_fraction * (probe.tail - last.tail);
    apply_material<kFeatures>(c, scene.parts()[c.part].material, motion, rate,
                              state.parts[c.part].friction);
  }
}

/// The same for contacts of the law of unions. When one pair of part and segment takes over the
/// contact from another of its group, at a seam, it takes over the friction state as well.
template <TickFeatures kFeatures>
void apply_material_forces(const Scene& scene, RenderState& state,
                           std::span<PlacedContact> contacts, double rate) {
  UnionMemory& all = state.unions;
  const auto friction_of = [&](const PlacedContact& c) -> FrictionState& {
    return c.by_law ? all.pairs[c.pair].friction : state.parts[c.loaded.part].friction;
  };
  if constexpr (kFeatures.friction) {
    for (const PlacedContact& c : contacts) {
      FrictionState& friction = friction_of(c);
      if (friction.in_contact) continue;
      friction = {};
      for (const RubbedPair& was : all.rubbed) {
        if (c.by_law && was.group == c.group) friction = all.pairs[was.pair].friction;
      }
    }
    for (const RubbedPair& was : all.rubbed) all.pairs[was.pair].friction.in_contact = false;
    for (const std::uint32_t i : state.near_parts) state.parts[i].friction.in_contact = false;
    all.rubbed.clear();
  }
  for (PlacedContact& c : contacts) {
    FrictionState& friction = friction_of(c);
    apply_material<kFeatures>(c.loaded, scene.material_of(c.loaded.part), c.motion, rate, friction);
    if (kFeatures.friction && c.by_law && friction.in_contact)
      all.rubbed.push_back({c.group, c.pair});
  }
}

// m. Farther off than any device or hand: a reading beyond it is a fault, like NaN, and sums of
// squares below it are exact enough to separate objects.
constexpr double kFarthest = 1e6;

inline bool within_range(const Vec3& v) { return glm::dot(v, v) <= kFarthest * kFarthest; }

/// Contact with one part, followed from the last tick or newly detected; kind `none` without
/// contact. Mesh frame.
/// \param before  the probe at the last tick, world frame; null at the first tick of all
/// \param tip     m
/// \param d       tail - tip of the probe, m
template <class Probe>
[[gnu::always_inline]] inline WalkResult track(const ScenePart& part, PartState& state,
                                               const LineProbe* before, const Vec3& tip,
                                               const Vec3& d, std::uint32_t& faults) {
  using Kind = ContactFeature::Kind;
  const stimuli::ConvexMesh& mesh = *part.mesh;
  const bool in_contact = state.feature.kind != Kind::none;
  // In free space the separating plane of an earlier tick mostly still holds. Written so that the
  // result is built in place: a copy costs as much as up to five dot products.
  WalkResult hit = in_contact ? Probe::walk(mesh, state.feature, tip, d)
                   : state.plane.separates(tip, tip + d)
                       ? WalkResult()
                       : detect_contact<Probe>(part, state, before, {tip, tip + d});
  if (!in_contact) return hit;
  if (hit.capped) faults |= render_fault::kWalkCapped;
  if (hit.not_converged) [[unlikely]] {
    search_separating_plane(part, state, {tip, tip + d});
    if (state.plane.valid || !search_all_features<Probe>(part, tip, d, hit)) {
      state.feature = hit.feature = {};
      return hit;
    }
  }
  const bool moved = !(hit.feature == state.feature);
  state.feature = hit.feature;
  if (hit.feature.kind == Kind::none) {
    record_separation(state, hit, {tip, tip + d});
  } else if (moved) {
    prefetch_neighbours(mesh, state.feature);
  }
  return hit;
}

struct SpreadPoint {
  double probe_fraction;
  ContactType type;
};

/// Equation (2) over the faces of a part with shallow ridges. Takes copies: values passed by
/// reference stay in memory for the whole tick.
// NOLINTBEGIN(performance-unnecessary-value-param)
[[gnu::cold, gnu::noinline]] inline SpreadPoint spread_over_ridges(const ScenePart& part,
                                                                   WalkResult hit, Vec3 tip, Vec3 d,
                                                                   double probe_fraction,
                                                                   ContactType type) {
  // NOLINTEND(performance-unnecessary-value-param)
  LoadedContact c;
  c.probe_fraction = probe_fraction;
  c.contact.type = type;
  const FacedPart alone{&part, hit.feature, tip + hit.depth * hit.normal, d};
  spread_over_faces(std::span<const FacedPart>(&alone, 1), hit, part.tolerance, c);
  return {c.probe_fraction, c.contact.type};
}

/// The contact on a textured part, whose smooth surface it touches. False: it is above the texture.
template <class Probe>
bool carve_contact(const ScenePart& part, const WalkResult& hit, const Vec3& tip, const Vec3& d,
                   TextureState& state, LoadedContact& c, std::uint32_t& faults) {
  SmoothContact smooth{hit.normal, hit.depth, tip + hit.depth * hit.normal + c.probe_fraction * d};
  if constexpr (Probe::kSegment) {
    if (hit.feature.kind == ContactFeature::Kind::edge) {
      const stimuli::Edge& edge = part.mesh->edges()[hit.feature.index];
      smooth.edge = edge.to - edge.from;
      smooth.probe = d;
    }
    if (c.contact.type == ContactType::segment_face)
      smooth.window = pressed_window(*part.mesh, hit, tip, d, c.probe_fraction);
  }
  const CarvedContact carved = carve(*part.material.texture, smooth, state);
  if (carved.lost) faults |= render_fault::kTextureLost;
  if (!carved.touches) return false;
  c.contact.depth = glm::length(carved.shift);
  c.contact.normal = part.world_vector(carved.shift / c.contact.depth);
  return true;
}

/// One tick in progress: the contacts found so far.
template <class ProbeKind>
struct Tick {
  using Probe = ProbeKind;

  const Scene& scene;
  RenderState& state;
  const LineProbe& probe;  ///< the virtual probe
  double length;           ///< m, of the probe; 0 for a point
  std::uint32_t faults = 0;

  const LineProbe* last() const { return state.has_last ? &state.last : nullptr; }

  /// Finds the contact with one part. True if there is one; then fills in `c`.
  /// \tparam kTexture  the part may be textured
  template <bool kTexture>
  [[gnu::always_inline]] bool contact_of(std::uint32_t index, LoadedContact& c) {
    const ScenePart& part = scene.parts()[index];
    PartState& memory = state.parts[index];
    const Vec3 tip = part.local_point(probe.tip);
    const Vec3 d = Probe::kSegment ? part.local_vector(probe.tail - probe.tip) : Vec3(0);
    const WalkResult hit = track<Probe>(part, memory, last(), tip, d, faults);
    if (memory.started_inside) faults |= render_fault::kStartedInside;
    if (hit.feature.kind == ContactFeature::Kind::none) {
      if constexpr (kTexture) state.textures[index].touching = false;
      return false;
    }
    c.part = index;
    Probe::classify(*part.mesh, hit, tip, d, length, c);
    if (Probe::kSegment && part.shallow_ridges) [[unlikely]] {
      const SpreadPoint spread =
          spread_over_ridges(part, hit, tip, d, c.probe_fraction, c.contact.type);
      c.probe_fraction = spread.probe_fraction;
      c.contact.type = spread.type;
    }
    c.contact.normal = part.world_vector(hit.normal);
    c.contact.depth = hit.depth;
    c.stiffness = part.material.stiffness;
    c.object = part.object;
    if constexpr (kTexture) {
      if (part.material.texture != nullptr)
        return carve_contact<Probe>(part, hit, tip, d, state.textures[index], c, faults);
    }
    return true;
  }

  /// Adds the contacts of all parts that are near.
  template <bool kTexture>
  void add_contacts() {
    state.contacts.clear();
    for (const std::uint32_t index : state.near_parts) {
      LoadedContact found;
      // Scene::initial_state reserved room for one contact of each part: no allocation.
      if (contact_of<kTexture>(index, found)) state.contacts.push_back(found);
    }
  }

  /// Puts the point of a loaded contact on the ideal probe.
  /// \param shift  m, from the virtual to the ideal probe, without friction
  /// \return the shift with friction
  template <bool kFriction>
  Vec3 place_on_ideal_probe(LoadedContact& c, Vec3 shift) const {
    if constexpr (kFriction) shift += c.tangential_offset;
    c.contact.point = probe.tip + shift;
    if constexpr (Probe::kSegment) {
      c.contact.along = c.probe_fraction * length;
      c.contact.point += c.probe_fraction * (probe.tail - probe.tip);
    }
    c.shift = shift;
    return shift;
  }
};

inline Rendering no_contact(const LineProbe& ideal, std::uint32_t faults) {
  Rendering none;
  none.ideal = ideal;
  none.faults = faults;
  return none;
}

/// The result of a tick in contact; zero force and a fault bit where it is not finite.
/// \param shift  m, from the virtual to the ideal probe of the deepest contact
template <class Probe>
[[gnu::always_inline]] inline Rendering make_result(const Tick<Probe>& tick, const Loads& loads,
                                                    const LoadedContact& deepest, const Vec3& shift,
                                                    std::size_t contacts) {
  const Vec3 all = loads.force + loads.torque;
  if (!std::isfinite(all.x + all.y + all.z))
    return no_contact(tick.probe, tick.faults | render_fault::kNonFinite);
  return {.force = loads.force,
          .torque = loads.torque,
          .device1 = loads.device1,
          .device2 = loads.device2,
          .deepest = deepest.contact,
          .ideal = {tick.probe.tip + shift, tick.probe.tail + shift},
          .contacts = static_cast<int>(contacts),
          .object = deepest.object,
          .faults = tick.faults};
}

/// Places the ideal probe and sums the forces of all contacts.
template <class Probe, bool kFriction>
Rendering sum_contacts(const Tick<Probe>& tick, std::span<LoadedContact> contacts) {
  std::size_t deepest = 0;
  Vec3 deepest_shift(0);
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const Vec3 shift = tick.template place_on_ideal_probe<kFriction>(
        contacts[i], contacts[i].normal_displacement * contacts[i].contact.normal);
    if (i == 0 || contacts[i].contact.depth > contacts[deepest].contact.depth) {
      deepest = i;
      deepest_shift = shift;
    }
  }
  const Loads loads =
      sum_loads<Probe::kSegment, kFriction>(std::span<const LoadedContact>(contacts), tick.probe);
  return make_result(tick, loads, contacts[deepest], deepest_shift, contacts.size());
}

/// The same for a single contact.
template <class Probe, bool kFriction>
[[gnu::always_inline]] inline Rendering sum_contacts(const Tick<Probe>& tick,
                                                     LoadedContact& contact) {
  const Vec3 shift = tick.template place_on_ideal_probe<kFriction>(
      contact, contact.normal_displacement * contact.contact.normal);
  const Loads loads = sum_loads<Probe::kSegment, kFriction>(
      std::span<const LoadedContact, 1>(&contact, 1), tick.probe);
  return make_result(tick, loads, contact, shift, 1);
}

/// The contacts of a scene with unions or with a tool on the stylus.
template <class Probe, TickFeatures kFeatures>
void add_placed_contacts(UnionTick& tick, Tick<Probe>& plain) {
  const Scene& scene = tick.scene;
  RenderState& state = tick.state;
  UnionMemory& all = state.unions;
  all.contacts.clear();
  all.reach = 0;
  all.most_lag = 0;
  for (std::size_t k = 0; k < state.near_parts.size(); ++k) {
    const std::uint32_t index = state.near_parts[k];
    const std::uint32_t group = scene.parts()[index].group;
    const PartGroup& of = scene.groups()[group];
    if (of.by_law) {
      const bool first = k == 0 || scene.parts()[state.near_parts[k - 1]].group != group;
      if (first && !is_off(tick, of)) follow_ideal_tool(tick, group);
      continue;
    }
    PlacedContact found;
    if (!plain.template contact_of<kFeatures.texture>(index, found.loaded)) continue;
    found.group = group;
    load(std::span<LoadedContact, 1>(&found.loaded, 1));
    found.shift = found.loaded.normal_displacement * found.loaded.contact.normal;
    found.place = plain.probe.tip +
                  found.loaded.probe_fraction * (plain.probe.tail - plain.probe.tip) + found.shift;
    const LineProbe& last = state.has_last ? state.last : plain.probe;
    found.motion = (1 - found.loaded.probe_fraction) * (plain.probe.tip - last.tip) +
                   found.loaded.probe_fraction * (plain.probe.tail - last.tail);
    all.contacts.push_back(found);
  }
  for (std::uint32_t i = 0; i < scene.surfaces().size(); ++i) {
    if (!is_off(tick, scene.groups()[scene.surfaces()[i].group])) follow_on_surface(tick, i);
  }
}

/// The same tick where one surface, felt with a plain stylus, is all that there is: no parts, tool,
/// damping or friction.
template <class Probe>
Rendering render_surface(const Scene& scene, RenderState& state, const LineProbe& probe,
                         double dt) noexcept {
  UnionMemory& all = state.unions;
  const ToolPose tool{probe.tip, probe.tail - probe.tip};
  UnionTick tick{scene, state, tool, Probe::kSegment, dt};
  update_objects(tick);
  all.contacts.clear();
  all.reach = 0;
  all.most_lag = 0;
  if (!is_off(tick, scene.groups().front())) follow_on_surface(tick, 0);
  fade_forces(tick);
  state.last = probe;
  state.has_last = true;
  all.last = tool;
  return sum_unions(tick, probe);
}

/// A tick by the law of unions (union_contact.h).
template <class Probe, TickFeatures kFeatures>
Rendering render_unions(const Scene& scene, RenderState& state, const LineProbe& probe,
                        double dt) noexcept {
  UnionMemory& all = state.unions;
  ToolPose tool{probe.tip, probe.tail - probe.tip};
  if (scene.tool() != nullptr) {
    if (!within_range(state.measured_side)) return no_contact(state.last, render_fault::kNonFinite);
    tool.frame =
        tool_frame(tool.d, state.has_last ? &all.last.frame : nullptr, state.measured_side);
  }
  place(Probe::kSegment ? scene.tool() : nullptr, Probe::kSegment, tool, all.now);
  update_near_parts(scene, state, probe, tool, Probe::kSegment);
  Tick<Probe> plain{scene, state, probe, Probe::kSegment ? glm::length(tool.d) : 0};
  UnionTick tick{scene, state, tool, Probe::kSegment, dt};
  update_objects(tick);
  add_placed_contacts<Probe, kFeatures>(tick, plain);
  if constexpr (kFeatures.texture) carve_placed_contacts(tick);
  const std::span<PlacedContact> contacts(all.contacts);
  if constexpr (!kFeatures.plain_springs())
    apply_material_forces<kFeatures>(scene, state, contacts, dt > 0 ? 1 / dt : 0);
  fade_forces(tick);
  state.last = probe;
  state.has_last = true;
  all.last = tool;
  tick.faults |= plain.faults;
  return sum_unions(tick, probe);
}

/// One tick with exactly the features of kFeatures.
/// \param dt  s since the last tick; only damping needs it
template <class Probe, TickFeatures kFeatures>
Rendering render_tick(const Scene& scene, RenderState& state, const LineProbe& probe,
                      double dt) noexcept {
  if (!within_range(probe.tip) || !within_range(probe.tail))
    return no_contact(state.last, render_fault::kNonFinite);
  if constexpr (kFeatures.unions && kFeatures.plain_springs() && !kFeatures.texture) {
    if (scene.is_one_surface()) return render_surface<Probe>(scene, state, probe, dt);
  }
  if constexpr (kFeatures.unions) return render_unions<Probe, kFeatures>(scene, state, probe, dt);
  Tick<Probe> tick{scene, state, probe, Probe::kSegment ? glm::length(probe.tail - probe.tip) : 0};
  const auto finish = [&](std::span<LoadedContact> contacts) {
    if constexpr (!kFeatures.plain_springs())
      apply_material_forces<kFeatures>(scene, state, probe, contacts, dt > 0 ? 1 / dt : 0);
    state.last = probe;
    state.has_last = true;
  };
  if constexpr (kFeatures.several_parts) {
    update_near_parts<Probe::kSegment>(scene, state, probe);
    tick.template add_contacts<kFeatures.texture>();
    const std::span<LoadedContact> contacts(state.contacts);
    load(contacts);
    finish(contacts);
    if (!contacts.empty()) return sum_contacts<Probe, kFeatures.friction>(tick, contacts);
  } else {
    LoadedContact contact;
    if (tick.template contact_of<kFeatures.texture>(0, contact)) {
      const std::span<LoadedContact, 1> contacts(&contact, 1);
      load(contacts);
      finish(contacts);
      return sum_contacts<Probe, kFeatures.friction>(tick, contact);
    }
    finish({});
  }
  return no_contact(probe, tick.faults);
}

}  // namespace palpate::rendering::tick
