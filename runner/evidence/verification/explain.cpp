// Stages of the tick in isolation, over recorded ticks: those whose cost explain() can state.
#include "runner/evidence/verification/explain.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <memory>
#include <set>

#include "rendering/probes.h"
#include "rendering/tick.h"
#include "runner/evidence/verification/surface_stroke.h"
#include "stimuli/convex_mesh.h"

namespace palpate::runner::evidence {
namespace {

using Kind = rendering::ContactFeature::Kind;

constexpr int kApproach = 2000;  // ticks until the hand has arrived
constexpr int kTicks = 1000;     // recorded

/// One tick of one part, with the input of its stages.
struct RecordedTick {
  rendering::LineProbe probe, last;  ///< world
  rendering::LineProbe local;        ///< mesh frame
  rendering::PartState before;       ///< state before the tick
  rendering::WalkResult hit;
  rendering::LoadedContact loaded;  ///< before materials
};

/// Ticks over the scene's first part.
struct Recording {
  std::vector<rendering::LineProbe> poses;
  rendering::RenderState start;  ///< before the first pose
  std::vector<bool> touching;    ///< at each pose, any part
  std::vector<RecordedTick> contact, free, entry;
};

template <class Probe>
void record_tick(const rendering::Scene& scene, const rendering::RenderState& state,
                 const rendering::PartState& before, const rendering::LineProbe& last,
                 const rendering::LineProbe& probe, Recording& out) {
  const rendering::ScenePart& part = scene.parts()[0];
  const rendering::PartState& after = state.parts[0];
  RecordedTick recorded;
  recorded.probe = probe;
  recorded.last = last;
  recorded.local = Probe::to_local(part, probe);
  recorded.before = before;
  if (before.feature.kind == Kind::none) {
    (after.feature.kind == Kind::none ? out.free : out.entry).push_back(recorded);
    return;
  }
  const Vec3 d = recorded.local.tail - recorded.local.tip;
  recorded.hit = Probe::walk(*part.mesh, before.feature, recorded.local.tip, d);
  if (recorded.hit.feature.kind == Kind::none) return;
  rendering::LoadedContact& c = recorded.loaded;
  Probe::classify(*part.mesh, recorded.hit, recorded.local.tip, d, glm::length(d), c);
  c.contact.normal = part.world_vector(recorded.hit.normal);
  c.contact.depth = recorded.hit.depth;
  c.stiffness = part.material.stiffness;
  c.object = part.object;
  load(std::span<rendering::LoadedContact, 1>(&c, 1));
  out.contact.push_back(recorded);
}

/// \param lifted  fraction of the time off the object
template <class Probe>
Recording record(const rendering::Scene& scene, const rendering::Renderer& renderer,
                 double lifted) {
  const rendering::ScenePart& part = scene.parts()[0];
  SurfaceStrokeSettings settings;
  settings.centre = part.sphere_centre;
  settings.radius = part.sphere_radius;
  settings.side = Probe::kSegment;
  settings.lifted = lifted;
  settings.lift_period = 200;
  SurfaceStroke hand(settings);
  Recording out;
  rendering::RenderState state = scene.initial_state();
  double depth = 0;
  for (int i = 0; i < kApproach + kTicks; ++i) {
    const rendering::LineProbe probe = hand.next(depth);
    const rendering::PartState before = state.parts[0];
    const rendering::LineProbe last = state.has_last ? state.last : probe;
    if (i == kApproach) out.start = state;
    const rendering::Rendering rendering = renderer.tick(scene, state, probe, 1e-3);
    depth = rendering.contacts > 0 ? rendering.deepest.depth : 0;
    if (i < kApproach) continue;
    out.poses.push_back(probe);
    out.touching.push_back(rendering.contacts > 0);
    record_tick<Probe>(scene, state, before, last, probe, out);
  }
  return out;
}

double sum(const Vec3& v) { return v.x + v.y + v.z; }

void add_materials(const rendering::TickFeatures& features, std::vector<TickStage>& stages) {
  const auto add = [&](const char* name, bool runs, const char* what) {
    stages.push_back({name, StageTime::contact, runs, runs ? what : "no material has it"});
  };
  add("damping", features.damping, "against the normal speed, never pulling");
  add("friction", features.friction, "Coulomb's, by the ideal probe's tangential offset");
}

/// The stages of one renderer over recordings: sliding, lifting off, hovering.
template <class Probe>
class StageTimings {
 public:
  StageTimings(const rendering::Scene& scene, const rendering::Renderer& renderer)
      : scene_(scene),
        renderer_(renderer),
        touching_(std::make_shared<const Recording>(record<Probe>(scene, renderer, 0))),
        lifting_(std::make_shared<const Recording>(record<Probe>(scene, renderer, 0.5))),
        hovering_(std::make_shared<const Recording>(record<Probe>(scene, renderer, 1))) {}

  std::vector<StageTiming> all() {
    add_whole(kTickInContact, touching_, true);
    add_whole(kTickInFreeSpace, hovering_, false);
    add("pose check", touching_, &Recording::contact,
        [](const rendering::ScenePart&, const RecordedTick& m) {
          return rendering::tick::within_range(m.probe.tip) &&
                         rendering::tick::within_range(m.probe.tail)
                     ? 1.0
                     : 0.0;
        });
    if (scene_.features().several_parts) add_broad_phase();
    add("frame of the part", touching_, &Recording::contact,
        [](const rendering::ScenePart& part, const RecordedTick& m) {
          const rendering::LineProbe local = Probe::to_local(part, m.probe);
          return sum(local.tip) + sum(local.tail);
        });
    add("separating plane", hovering_, &Recording::free,
        [](const rendering::ScenePart&, const RecordedTick& m) {
          return m.before.plane.separates(m.local.tip, m.local.tail) ? 1.0 : 0.0;
        });
    add("first contact", lifting_, &Recording::entry,
        [](const rendering::ScenePart& part, const RecordedTick& m) {
          rendering::PartState state = m.before;
          return rendering::tick::detect_contact<Probe>(part, state, &m.last, m.local).depth;
        });
    add("neighbourhood watch", touching_, &Recording::contact,
        [](const rendering::ScenePart& part, const RecordedTick& m) {
          return Probe::walk(*part.mesh, m.before.feature, m.local.tip, m.local.tail - m.local.tip)
              .depth;
        });
    if constexpr (Probe::kSegment) add_sides();
    add("spring", touching_, &Recording::contact,
        [](const rendering::ScenePart&, const RecordedTick& m) {
          return sum(m.loaded.stiffness * m.loaded.normal_displacement * m.loaded.contact.normal);
        });
    add_materials();
    return std::move(timings_);
  }

 private:
  using Recorded = std::shared_ptr<const Recording>;

  /// Over the longest run of ticks that do, or do not, touch.
  void add_whole(const char* name, const Recorded& recording, bool touching) {
    std::size_t begin = 0, count = 0;
    for (std::size_t from = 0, i = 0; i < recording->poses.size(); ++i) {
      if (recording->touching[i] != touching) from = i + 1;
      if (i + 1 - from > count) {
        begin = from;
        count = i + 1 - from;
      }
    }
    const auto state = std::make_shared<rendering::RenderState>();
    const auto run = [scene = &scene_, renderer = &renderer_, state, recording](std::size_t from,
                                                                                std::size_t to) {
      double total = 0;
      for (std::size_t i = from; i < to; ++i)
        total += renderer->tick(*scene, *state, recording->poses[i], 1e-3).force.x;
      return total;
    };
    timings_.push_back({name, count,
                        [state, recording, run, begin] {
                          *state = recording->start;
                          run(0, begin);
                        },
                        [run, begin, count] { return run(begin, begin + count); }});
  }

  template <class Run>
  void add(const char* name, const Recorded& recording, std::vector<RecordedTick> Recording::*which,
           Run stage) {
    timings_.push_back({name, (*recording.*which).size(), [] {},
                        [part = &scene_.parts()[0], recording, which, stage] {
                          double total = 0;
                          for (const RecordedTick& recorded : *recording.*which)
                            total += stage(*part, recorded);
                          return total;
                        }});
  }

  void add_broad_phase() {
    const auto state = std::make_shared<rendering::RenderState>();
    timings_.push_back({"several parts", touching_->poses.size(),
                        [state, recording = touching_] { *state = recording->start; },
                        [scene = &scene_, state, recording = touching_] {
                          double total = 0;
                          for (const rendering::LineProbe& pose : recording->poses) {
                            update_near_parts(*scene, *state, pose);
                            total += static_cast<double>(state->near_parts.size());
                          }
                          return total;
                        }});
  }

  void add_sides() {
    add("side contact", touching_, &Recording::contact,
        [](const rendering::ScenePart& part, const RecordedTick& m) {
          rendering::LoadedContact c;
          const Vec3 d = m.local.tail - m.local.tip;
          Probe::classify(*part.mesh, m.hit, m.local.tip, d, glm::length(d), c);
          return c.probe_fraction;
        });
    add("torque and second device", touching_, &Recording::contact,
        [](const rendering::ScenePart&, const RecordedTick& m) {
          const Vec3 force = m.loaded.force * m.loaded.contact.normal;
          const Vec3 torque =
              glm::cross(m.loaded.probe_fraction * (m.probe.tail - m.probe.tip), force);
          return sum(torque) + sum(m.loaded.probe_fraction * force);
        });
  }

  /// The cost of one material, by the tick's own code.
  template <rendering::TickFeatures kFeatures>
  void add_material(const char* name) {
    const auto state = std::make_shared<rendering::RenderState>();
    timings_.push_back({name, touching_->contact.size(),
                        [state, recording = touching_] { *state = recording->start; },
                        [scene = &scene_, state, recording = touching_] {
                          double total = 0;
                          for (const RecordedTick& recorded : recording->contact) {
                            rendering::LoadedContact contact = recorded.loaded;
                            state->last = recorded.last;
                            rendering::tick::apply_material_forces<kFeatures>(
                                *scene, *state, recorded.probe,
                                std::span<rendering::LoadedContact, 1>(&contact, 1), 1000);
                            total += contact.force + contact.tangential_offset.x;
                          }
                          return total;
                        }});
  }

  void add_materials() {
    if (scene_.features().damping)
      add_material<rendering::TickFeatures{.damping = true}>("damping");
    if (scene_.features().friction)
      add_material<rendering::TickFeatures{.friction = true}>("friction");
  }

  const rendering::Scene& scene_;
  const rendering::Renderer& renderer_;
  Recorded touching_, lifting_, hovering_;
  std::vector<StageTiming> timings_;
};

std::string counted(std::size_t count, const std::string& one, const std::string& many) {
  return std::to_string(count) + ' ' + (count == 1 ? one : many);
}

/// How many of the scene's meshes have a certain tree, and the largest count of its primitives.
struct MeshTally {
  std::size_t meshes = 0, with = 0, most = 0;
};

template <class Has, class Count>
MeshTally tally(const rendering::Scene& scene, Has has, Count count) {
  MeshTally result;
  std::set<const stimuli::ConvexMesh*> seen;
  for (const rendering::ScenePart& part : scene.parts()) {
    if (!seen.insert(part.mesh.get()).second) continue;
    ++result.meshes;
    if (has(*part.trees)) ++result.with;
    result.most = std::max(result.most, count(*part.mesh));
  }
  return result;
}

TickStage structure(std::string name, const MeshTally& t, const std::string& things,
                    std::size_t limit) {
  const bool built = t.with > 0;
  std::string why = built ? "for " + std::to_string(t.with) + " of " +
                                counted(t.meshes, "mesh", "meshes") + ": more than " +
                                std::to_string(limit) + ' ' + things
                          : "not more than " + std::to_string(limit) + ' ' + things +
                                " (here up to " + std::to_string(t.most) + ")";
  return {std::move(name), StageTime::once, built, std::move(why)};
}

void add_structures(const rendering::Scene& scene, const rendering::Renderer& renderer,
                    std::vector<TickStage>& stages) {
  const auto facets = [](const stimuli::ConvexMesh& m) { return m.facets().size(); };
  const auto edges = [](const stimuli::ConvexMesh& m) { return m.edges().size(); };
  const auto vertices = [](const stimuli::ConvexMesh& m) { return m.vertices().size(); };
  stages.push_back(structure(
      "tree of polygons",
      tally(
          scene, [](const rendering::ContactTrees& t) { return t.polygons() != nullptr; }, facets),
      "facets to scan", rendering::ContactTrees::kScanLimit));
  const MeshTally with_edges = tally(
      scene, [](const rendering::ContactTrees& t) { return t.edges() != nullptr; }, edges);
  if (with_edges.with == 0 && !renderer.side_contact()) {
    stages.push_back({"tree of edges", StageTime::once, false, "a point meets no edges"});
  } else {
    stages.push_back(structure("tree of edges", with_edges, "edges to scan",
                               rendering::ContactTrees::kScanLimit));
  }
  stages.push_back(structure(
      "support map",
      tally(
          scene, [](const rendering::ContactTrees& t) { return t.support_map() != nullptr; },
          vertices),
      "vertices to climb", stimuli::SupportMap::kSmallMesh));
  stages.push_back(structure(
      "facet map",
      tally(
          scene, [](const rendering::ContactTrees& t) { return t.facet_map() != nullptr; },
          vertices),
      "vertices to walk past", stimuli::SupportMap::kSmallMesh));
}

/// Parts that a point anywhere on the first part's bounding sphere cannot reach.
std::size_t out_of_reach(const rendering::Scene& scene) {
  const auto& parts = scene.parts();
  return static_cast<std::size_t>(
      std::count_if(parts.begin(), parts.end(), [&](const rendering::ScenePart& part) {
        const rendering::ScenePart& first = parts.front();
        const double gap = glm::length(part.sphere_centre - first.sphere_centre) -
                           first.sphere_radius - part.sphere_radius;
        return !in_reach(part, gap, 0);
      }));
}

void add_parts(const rendering::Scene& scene, std::vector<TickStage>& stages) {
  const std::size_t parts = scene.parts().size();
  const bool several = scene.features().several_parts;
  stages.push_back({"several parts", StageTime::tick, several,
                    several ? "broad phase by bounding spheres, a list of contacts, sums over it"
                            : "a single part is always near and has one contact at most"});
  const bool tree = !scene.part_tree().nodes().empty();
  stages.push_back({"tree of parts", StageTime::once, tree,
                    "not more than " + std::to_string(rendering::Scene::kFewParts) +
                        " parts are looked at one by one (here " + std::to_string(parts) + ")"});
  if (tree) stages.back().why = "of their bounding spheres, for the broad phase";
  const std::size_t far = out_of_reach(scene);
  stages.push_back({"objects out of reach", StageTime::tick, false,
                    far == 0 ? "there are none while the first is touched"
                             : std::to_string(far) + " of " + counted(parts, "part", "parts") +
                                   " while the first is touched"});
}

}  // namespace

std::vector<StageTiming> stage_timings(const rendering::Scene& scene,
                                       const rendering::Renderer& renderer) {
  if (scene.parts().empty()) return {};
  if (renderer.side_contact())
    return StageTimings<rendering::tick::SegmentProbe>(scene, renderer).all();
  return StageTimings<rendering::tick::PointProbe>(scene, renderer).all();
}

const char* to_string(StageTime time) {
  switch (time) {
    case StageTime::once:
      return "once a scene";
    case StageTime::tick:
      return "every tick";
    case StageTime::free:
      return "in free space";
    case StageTime::entry:
      return "at first contact";
    case StageTime::contact:
      return "in contact";
  }
  return "";
}

std::vector<TickStage> explain(const rendering::Scene& scene, const rendering::Renderer& renderer) {
  const bool sides = renderer.side_contact();
  std::vector<TickStage> stages;
  add_structures(scene, renderer, stages);
  stages.push_back({"pose check", StageTime::tick, true,
                    "no force where a coordinate is not finite or beyond 1000 km"});
  add_parts(scene, stages);
  stages.push_back({"frame of the part", StageTime::tick, true, "the pose in the mesh's frame"});
  stages.push_back({"separating plane", StageTime::free, true,
                    "while the plane of an earlier tick separates them, nothing else is computed"});
  stages.push_back({"first contact", StageTime::entry, true,
                    "the feature through which the probe enters, once that plane is crossed"});
  stages.push_back({"neighbourhood watch", StageTime::contact, true,
                    "the walk from the last feature to the one that holds the ideal probe now"});
  stages.push_back({"side contact", StageTime::contact, sides,
                    sides ? "the walk crosses silhouette edges too (its cost is counted there); "
                            "equation (2) places the contact"
                          : "only the tip touches"});
  const bool unions = scene.features().unions;
  stages.push_back({"unions and tools", StageTime::contact, unions,
                    unions ? "one ideal tool for all parts of a surface: turn, push out, cast, "
                             "active planes"
                           : "no object has several parts or layers, and the stylus has no tool"});
  if (!scene.surfaces().empty())
    stages.push_back({"closed surfaces", StageTime::contact, true,
                      "one ideal tool for each, off the patches of its triangles and edges"});
  stages.push_back({"spring", StageTime::contact, true, "stiffness times depth along the normal"});
  add_materials(scene.features(), stages);
  if (scene.features().texture)
    stages.push_back({"texture", StageTime::contact, true,
                      "a god-object on the carved profile, local to the facet"});
  if (const rendering::SceneEffects* const effects = scene.effects()) {
    std::size_t fields = 0;
    bool knocks = false;
    for (const rendering::ObjectEffects& object : effects->objects) {
      fields += object.fields.size();
      knocks = knocks || object.transient;
    }
    if (fields > 0)
      stages.push_back({"fields", StageTime::tick, true,
                        counted(fields, "field", "fields") + " at the tip or the grip"});
    if (knocks)
      stages.push_back(
          {"knock of a contact", StageTime::contact, true, "a decaying sinusoid along the normal"});
  }
  stages.push_back({"torque and second device", StageTime::contact, sides,
                    sides ? "the moment about the tip; equations (1), (4) and (5)"
                          : "a force at the tip has no moment about it"});
  stages.push_back({"sample log", StageTime::tick, false,
                    "not part of the scene: a protocol asks for it (\"samples\": true)"});
  return stages;
}

}  // namespace palpate::runner::evidence
