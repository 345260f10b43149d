#include "runner/movement/touched_trial.h"

#include <algorithm>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "data/export/sample_slots.h"
#include "protocols/tasks/levels.h"
#include "runner/session/live_forces.h"
#include "runner/session/recorded_trial.h"
#include "runner/session/replay.h"
#include "stimuli/convex_mesh.h"

namespace palpate::runner::movement {
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
  for (const std::uint32_t i : placed.surface->file_order()) {
    const stimuli::SurfaceTriangle& t = placed.surface->triangles()[i];
    triangles.push_back({world(t.corners[0]), world(t.corners[1]), world(t.corners[2])});
  }
}

bool inside(const rendering::ScenePart& part, const Vec3& place) {
  const Vec3 local = part.local_point(place);
  // On the surface is not inside: abutting parts hide their common wall from each other.
  const double least = std::max(part.tolerance, 1e-9 * part.mesh->size());
  return std::all_of(part.mesh->facets().begin(), part.mesh->facets().end(),
                     [&](const stimuli::Facet& facet) {
                       return glm::dot(facet.normal, local) < facet.offset - least;
                     });
}

/// Places on the outer surface of a scene; none: no part of it is rigid.
std::vector<Vec3> places_of(const rendering::Scene& scene) {
  constexpr std::size_t kRounds = 8;  // a union hides most of its parts' surfaces at worst
  int outer = std::numeric_limits<int>::max();
  for (const rendering::ScenePart& part : scene.parts()) {
    if (part.layer != rendering::kNotFelt) outer = std::min(outer, part.layer);
  }
  for (const rendering::PlacedSurface& placed : scene.surfaces()) {
    if (placed.layer != rendering::kNotFelt) outer = std::min(outer, placed.layer);
  }
  std::vector<SurfaceTriangle> triangles;
  std::vector<const rendering::ScenePart*> parts;
  for (const rendering::ScenePart& part : scene.parts()) {
    if (part.layer != outer) continue;
    parts.push_back(&part);
    add_part(part, triangles);
  }
  for (const rendering::PlacedSurface& placed : scene.surfaces()) {
    if (placed.layer == outer) add_surface(placed, triangles);
  }
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

/// A tick in the object's frame.
struct TouchedTick {
  Vec3 tip;
  bool contact = false, on_edge = false;
  Vec3 point, normal, force;  ///< of the deepest contact
  std::array<Vec3, 2> touched;
};

void put(analysis::MovementTrial& trial, const TouchedTick& tick, bool has_edges) {
  trial.tip.push_back(tick.tip);
  trial.contact.push_back(tick.contact);
  trial.point.push_back(tick.point);
  trial.normal.push_back(tick.normal);
  trial.force.push_back(tick.force);
  trial.touched.push_back(tick.touched);
  if (has_edges) trial.on_edge.push_back(tick.on_edge);
}

void reserve(analysis::MovementTrial& trial, std::size_t ticks) {
  for (auto* vectors : {&trial.tip, &trial.point, &trial.normal, &trial.force})
    vectors->reserve(ticks);
  trial.touched.reserve(ticks);
  trial.contact.reserve(ticks);
  trial.on_edge.reserve(ticks);
}

/// Interpolates a missed tick linearly between its neighbours; in contact if both are.
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
  tick.touched = {tick.point, tick.point};
  tick.on_edge = before.on_edge && after.on_edge;
  return tick;
}

/// Whether a level leaves shape, size and orientation as they are: materials only.
bool keeps_geometry(const protocols::Protocol& protocol, const data::TaskRecord& task) {
  const auto block =
      std::ranges::find(protocol.blocks, task.block_name, &protocols::TaskBlock::name);
  if (block == protocol.blocks.end()) return true;
  return std::ranges::all_of(
      protocols::targets_of(*block), [](const protocols::LevelTarget& target) {
        const std::string last = target.pointer.substr(target.pointer.rfind('/') + 1);
        return last.starts_with("stiffness_") || last.starts_with("damping_") ||
               last.starts_with("friction_");
      });
}

/// Reason why a trial of a block has no measures; empty: it has one interval with the stimulus as
/// the protocol describes its surface.
std::string unmeasured_task(const protocols::Protocol& protocol, const data::TrialRecord& record) {
  const std::vector<data::IntervalRecord> intervals = data::intervals_of(record);
  if (intervals.size() != 1) return "a trial of several intervals";
  if (intervals[0].stimulus.empty()) return "a trial without an object";
  if (intervals[0].stimulus != record.shape) return "a trial with the object of catch trials";
  return keeps_geometry(protocol, record.task) ? "" : "its level changes the shape of the object";
}

}  // namespace

TouchedStimuli::TouchedStimuli(protocols::Protocol protocol)
    : protocol_(std::move(protocol)), library_(protocol_) {
  for (std::size_t i = 0; i < protocol_.stimuli.size(); ++i) {
    surfaces_.emplace_back();
    flat_.emplace_back();
    if (library_.soft(i) != nullptr) continue;
    protocols::Trial upright;
    upright.stimulus = static_cast<int>(i);
    upright.renderer = protocols::RendererKind::point;
    upright.orientation = Quat(1, 0, 0, 0);
    const rendering::Scene scene = library_.scene(upright);
    add_flat_parts(scene);
    std::vector<Vec3> places = places_of(scene);
    if (places.size() >= analysis::TouchedSurface::kParts)
      surfaces_.back() = std::make_unique<analysis::TouchedSurface>(std::move(places));
  }
}

/// Keeps the parts of the outer surface with a facet longer than the reach of a touch; on shorter
/// facets the touched part is within the reach of the contact.
void TouchedStimuli::add_flat_parts(const rendering::Scene& scene) {
  for (const rendering::ScenePart& part : scene.parts()) {
    if (part.layer != 0) continue;
    const stimuli::ConvexMesh& mesh = *part.mesh;
    double longest = 0;
    for (const stimuli::Edge& edge : mesh.edges())
      longest = std::max(longest, glm::length(edge.to - edge.from));
    if (longest <= analysis::TouchedSurface::kReach) continue;
    ConvexPart& planes = flat_.back().emplace_back();
    for (const stimuli::Facet& facet : mesh.facets()) {
      const Vec3 normal = part.world_vector(facet.normal);
      planes.push_back({normal, facet.offset + glm::dot(normal, part.position)});
    }
  }
}

std::array<Vec3, 2> TouchedStimuli::touched(int stimulus, const Vec3& tip, const Vec3& tail,
                                            const Vec3& contact) const {
  constexpr double kOn = 5e-5;  // m
  std::array<Vec3, 2> longest = {contact, contact};
  const Vec3 along = tail - tip;
  const double square = glm::dot(along, along);
  if (!(square > 0)) return longest;
  const double at = glm::dot(contact - tip, along) / square;
  double length = 0;
  for (const ConvexPart& part : flat_[static_cast<std::size_t>(stimulus)]) {
    double from = 0, to = 1;
    for (const Plane& plane : part) {
      const double room = plane.offset + kOn - glm::dot(plane.normal, tip);
      const double slope = glm::dot(plane.normal, along);
      if (slope > 0)
        to = std::min(to, room / slope);
      else if (slope < 0)
        from = std::max(from, room / slope);
      else if (room < 0)
        to = -1;
      if (from > to) break;
    }
    if (from > at || to < at || to - from <= length) continue;
    length = to - from;
    longest = {tip + from * along, tip + to * along};
  }
  return longest;
}

int TouchedStimuli::stimulus(const std::string& name) const {
  const auto& all = protocol_.stimuli;
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const auto& one) { return one.name == name; });
  return found == all.end() ? -1 : static_cast<int>(found - all.begin());
}

std::shared_ptr<const TouchedStimuli> StudyStimuli::of(data::Store& store,
                                                       const data::StoredTrial& trial) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto run = std::tuple(trial.participant.id, trial.record.session, trial.run.clock.utc_ns,
                              trial.run.clock.monotonic_ns);
  if (const auto known = by_run_.find(run); known != by_run_.end()) return known->second;
  bool limited = false;
  protocols::Protocol protocol = session::protocol_as_shown(store, trial, folder_, limited);
  std::shared_ptr<const TouchedStimuli> made;
  const std::string group = protocol.groups.name(trial.participant.enrolled_number);
  const auto shown = std::pair(trial.protocol_sha256, group);
  if (const auto known = by_protocol_.find(shown); !limited && known != by_protocol_.end())
    made = known->second;
  else
    made = std::make_shared<TouchedStimuli>(std::move(protocol));
  if (!limited) by_protocol_[shown] = made;
  return by_run_[run] = made;
}

std::string read_movement(const TouchedStimuli& stimuli, const data::StoredTrial& stored,
                          analysis::MovementTrial& trial) {
  const data::TrialRecord& record = stored.record;
  const int stimulus = stimuli.stimulus(record.shape);
  if (std::string why = unmeasured_task(stimuli.protocol(), record); !why.empty()) return why;
  if (stimulus < 0) return "the protocol has no such stimulus";
  if (record.samples.empty()) return "no samples";

  const SharpEdges& edges = stimuli.library().edges(stimulus);
  const bool soft = stimuli.library().soft(static_cast<std::size_t>(stimulus)) != nullptr;
  const bool has_edges = !edges.too_many() && !soft;
  const bool ray = record.renderer == protocols::to_string(protocols::RendererKind::ray);
  const auto& q = record.orientation_wxyz;
  const Quat to_object = glm::conjugate(Quat(q[0], q[1], q[2], q[3]));
  trial.rate = stimuli.protocol().servo_rate;
  reserve(trial, record.samples.size());
  bool equal = true;
  try {
    data::SampleSlots slots(stored, trial.rate);
    std::int64_t last_slot = 0;
    TouchedTick last;
    session::replay(
        stimuli.protocol(), record, false,
        [&](std::size_t, const data::SampleRecord& recorded, const session::ReplayedSample& again) {
          equal &= session::equals_record(record, recorded, again);
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
          tick.on_edge = has_edges && tick.contact &&
                         edges.distance(tick.point) <= session::ContactLog::kReach;
          tick.touched = {tick.point, tick.point};
          if (ray && tick.contact) {
            tick.touched = stimuli.touched(stimulus, turn * (shown.ideal.tip - moved),
                                           turn * (shown.ideal.tail - moved), tick.point);
          }
          const std::int64_t slot = slots.next();
          const std::int64_t gap = trial.tip.empty() ? 0 : slot - last_slot - 1;
          if (gap > kLongestGap) trial.breaks.push_back(trial.tip.size());
          for (std::int64_t k = 1; k <= gap && gap <= kLongestGap; ++k) {
            const double share = static_cast<double>(k) / static_cast<double>(gap + 1);
            put(trial, between(last, tick, share), has_edges);
          }
          put(trial, tick, has_edges);
          last_slot = slot;
          last = tick;
        },
        &stimuli.library());
  } catch (const data::StoreRefused&) {
    return "ticks are out of order or times cannot be";
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return equal ? "" : "rendering it again gives other forces than were recorded";
}

MeasuredTrial measure_trial(const TouchedStimuli& stimuli, const data::StoredTrial& stored,
                            const analysis::MovementSettings& settings, bool with_tally) {
  MeasuredTrial result;
  result.ticks = stored.record.samples.size();
  analysis::MovementTrial trial;
  result.missing = read_movement(stimuli, stored, trial);
  if (!result.missing.empty()) return result;
  const analysis::TouchedSurface* surface = stimuli.surface(stimuli.stimulus(stored.record.shape));
  result.values = analysis::measure(trial, surface, settings);
  if (with_tally && surface != nullptr) result.tally = analysis::tally_of(trial, *surface);
  return result;
}

std::vector<std::optional<data::TickContact>> contacts_of(const TouchedStimuli& stimuli,
                                                          const data::StoredTrial& stored) {
  const data::TrialRecord& record = stored.record;
  std::vector<std::optional<data::TickContact>> contacts;
  contacts.reserve(record.samples.size());
  bool equal = true;
  const auto visit = [&](std::size_t, const data::SampleRecord& recorded,
                         const session::ReplayedSample& again) {
    equal &= session::equals_record(record, recorded, again);
    const rendering::Contact& deepest = again.rendering.deepest;
    auto& contact = contacts.emplace_back();
    if (again.rendering.contacts > 0) {
      contact = {{deepest.point.x, deepest.point.y, deepest.point.z},
                 {deepest.normal.x, deepest.normal.y, deepest.normal.z}};
    }
  };
  try {
    session::replay(stimuli.protocol(), record, false, visit, &stimuli.library());
  } catch (const std::invalid_argument&) {
    equal = false;
  }
  if (!equal) contacts.clear();
  return contacts;
}

}  // namespace palpate::runner::movement
