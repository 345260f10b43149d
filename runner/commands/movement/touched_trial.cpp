#include "runner/commands/movement/touched_trial.h"

#include <algorithm>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "data/export/sample_slots.h"
#include "runner/session/contact_log.h"
#include "runner/session/replay.h"

namespace palpate::runner {
namespace {

using analysis::SurfaceTriangle;

constexpr std::int64_t kLongestGap = 5;  // ticks that are interpolated

void add_part(const rendering::ScenePart& part, std::vector<SurfaceTriangle>& triangles) {
  const stimuli::ConvexMesh& mesh = *part.mesh;
  for (std::uint32_t f = 0; f < mesh.facets().size(); ++f) {
    const stimuli::Facet& facet = mesh.facets()[f];
    std::vector<Vec3> corners;
    for (std::uint32_t s = 0; s < facet.side_count; ++s) {
      const stimuli::Edge& edge = mesh.edges()[mesh.sides()[facet.first_side + s].edge];
      corners.push_back(part.world_vector(edge.left == f ? edge.from : edge.to) + part.position);
    }
    for (std::size_t i = 2; i < corners.size(); ++i)
      triangles.push_back({corners[0], corners[i - 1], corners[i]});
  }
}

void add_surface(const rendering::PlacedSurface& placed, std::vector<SurfaceTriangle>& triangles) {
  const auto world = [&placed](std::uint32_t vertex) {
    return placed.world_vector(placed.surface->vertices()[vertex]) + placed.position;
  };
  for (const rendering::SurfaceTriangle& t : placed.surface->triangles())
    triangles.push_back({world(t.corners[0]), world(t.corners[1]), world(t.corners[2])});
}

bool inside(const rendering::ScenePart& part, const Vec3& place) {
  const Vec3 local = part.local_point(place);
  // On its surface is not inside: parts that abut share a wall, which both of them hide.
  const double least = std::max(part.tolerance, 1e-9 * part.mesh->size());
  return std::all_of(part.mesh->facets().begin(), part.mesh->facets().end(),
                     [&](const stimuli::Facet& facet) {
                       return glm::dot(facet.normal, local) < facet.offset - least;
                     });
}

/// Places on the outer surface of a scene; none: nothing of it is rigid.
std::vector<Vec3> places_of(const rendering::Scene& scene) {
  constexpr std::size_t kRounds = 8;  // a union hides most of its parts' surfaces at worst
  int outer = std::numeric_limits<int>::max();
  for (const rendering::ScenePart& part : scene.parts()) {
    if (part.layer != rendering::kNotFelt) outer = std::min(outer, part.layer);
  }
  std::vector<SurfaceTriangle> triangles;
  std::vector<const rendering::ScenePart*> parts;
  for (const rendering::ScenePart& part : scene.parts()) {
    if (part.layer != outer || (outer != 0 && !scene.surfaces().empty())) continue;
    parts.push_back(&part);
    add_part(part, triangles);
  }
  for (const rendering::PlacedSurface& placed : scene.surfaces()) add_surface(placed, triangles);
  if (triangles.empty()) return {};
  constexpr std::size_t kPlaces = analysis::TouchedSurface::kPlaces;
  std::vector<Vec3> places =
      analysis::draw_places(triangles, parts.size() > 1 ? kRounds * kPlaces : kPlaces);
  if (parts.size() > 1) {
    std::erase_if(places, [&](const Vec3& place) {
      return std::any_of(parts.begin(), parts.end(),
                         [&](const auto* part) { return inside(*part, place); });
    });
  }
  if (places.size() > kPlaces) places.resize(kPlaces);
  return places;
}

}  // namespace

TouchedStimuli::TouchedStimuli(protocols::Protocol protocol)
    : protocol_(std::move(protocol)), library_(protocol_) {
  for (std::size_t i = 0; i < protocol_.stimuli.size(); ++i) {
    surfaces_.emplace_back();
    if (library_.soft(i) != nullptr) continue;
    protocols::Trial upright;
    upright.stimulus = static_cast<int>(i);
    upright.renderer = protocols::RendererKind::point;
    upright.orientation = Quat(1, 0, 0, 0);
    std::vector<Vec3> places = places_of(library_.scene(upright));
    if (places.size() >= analysis::TouchedSurface::kParts)
      surfaces_.back() = std::make_unique<analysis::TouchedSurface>(std::move(places));
  }
}

int TouchedStimuli::stimulus(const std::string& name) const {
  const auto& all = protocol_.stimuli;
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const auto& one) { return one.name == name; });
  return found == all.end() ? -1 : static_cast<int>(found - all.begin());
}

namespace {

/// A tick in the object's frame.
struct TouchedTick {
  Vec3 tip;
  bool contact = false, on_edge = false;
  Vec3 point, normal, force;  ///< of the deepest contact
};

void put(analysis::MovementTrial& trial, const TouchedTick& tick, bool has_edges) {
  trial.tip.push_back(tick.tip);
  trial.contact.push_back(tick.contact);
  trial.point.push_back(tick.point);
  trial.normal.push_back(tick.normal);
  trial.force.push_back(tick.force);
  if (has_edges) trial.on_edge.push_back(tick.on_edge);
}

/// A missed tick: on the line between its neighbours; in contact where both are.
TouchedTick between(const TouchedTick& before, const TouchedTick& after, double share) {
  TouchedTick tick;
  tick.tip = glm::mix(before.tip, after.tip, share);
  tick.contact = before.contact && after.contact;
  if (!tick.contact) return tick;
  const Vec3 normal = glm::mix(before.normal, after.normal, share);
  const double length = glm::length(normal);
  tick.normal = length > 0 ? normal / length : before.normal;
  tick.point = glm::mix(before.point, after.point, share);
  tick.force = glm::mix(before.force, after.force, share);
  tick.on_edge = before.on_edge && after.on_edge;
  return tick;
}

}  // namespace

MeasuredTrial measure_trial(const TouchedStimuli& stimuli, const data::StoredTrial& stored,
                            const analysis::MovementSettings& settings) {
  const data::TrialRecord& record = stored.record;
  MeasuredTrial result;
  result.ticks = record.samples.size();
  const int stimulus = stimuli.stimulus(record.shape);
  if (record.samples.empty()) result.missing = "no samples";
  if (record.task) result.missing = "a trial of several intervals";
  if (stimulus < 0) result.missing = "the protocol has no such stimulus";
  if (!result.missing.empty()) return result;

  const SharpEdges& edges = stimuli.library().edges(stimulus);
  const bool soft = stimuli.library().soft(static_cast<std::size_t>(stimulus)) != nullptr;
  const bool has_edges = !edges.too_many() && !soft;
  const auto& q = record.orientation_wxyz;
  const Quat to_object = glm::conjugate(Quat(q[0], q[1], q[2], q[3]));
  analysis::MovementTrial trial;
  trial.rate = stimuli.protocol().servo_rate;
  bool equal = true;
  std::int64_t longest_gap = 0;
  try {
    data::SampleSlots slots(stored, trial.rate);
    std::int64_t last_slot = 0;
    TouchedTick last;
    replay(stimuli.protocol(), stimuli.library(), record,
           [&](std::size_t, const data::SampleRecord& recorded, const ReplayedSample& again) {
             equal &= equals_record(record, recorded, again);
             const rendering::Rendering& shown = again.rendering;
             Quat turn = to_object;
             Vec3 moved(0);
             if (again.body) {
               turn = to_object * glm::conjugate(again.body->moved.orientation);
               moved = again.body->moved.position;
             }
             TouchedTick tick;
             tick.contact = shown.contacts > 0;
             tick.tip = turn * (Vec3(recorded.tip[0], recorded.tip[1], recorded.tip[2]) - moved);
             tick.point = turn * (shown.deepest.point - moved);
             tick.normal = turn * shown.deepest.normal;
             tick.force = turn * shown.force;
             tick.on_edge =
                 has_edges && tick.contact && edges.distance(tick.point) <= ContactLog::kReach;
             const std::int64_t slot = slots.next();
             const std::int64_t gap = trial.tip.empty() ? 0 : slot - last_slot - 1;
             longest_gap = std::max(longest_gap, gap);
             for (std::int64_t k = 1; k <= gap && longest_gap <= kLongestGap; ++k) {
               const double share = static_cast<double>(k) / static_cast<double>(gap + 1);
               put(trial, between(last, tick, share), has_edges);
             }
             put(trial, tick, has_edges);
             last_slot = slot;
             last = tick;
           });
  } catch (const data::StoreRefused&) {
    result.missing = "ticks are out of order or times cannot be";
  } catch (const std::invalid_argument& error) {
    result.missing = error.what();
  }
  if (!result.missing.empty()) return result;
  if (!equal) {
    result.missing = "rendering it again gives other forces than were recorded";
    return result;
  }
  if (longest_gap > kLongestGap) {
    result.missing = "more than " + std::to_string(kLongestGap) + " ticks in a row were missed";
    return result;
  }
  result.values = analysis::measure(trial, stimuli.surface(stimulus), settings);
  return result;
}

}  // namespace palpate::runner
