// Stages of the tick in isolation, over recorded ticks: those that explain() can state a cost of.

#include <cmath>
#include <memory>

#include "rendering/probes.h"
#include "rendering/tick.h"
#include "rendering/verification/explain.h"
#include "rendering/verification/surface_stroke.h"

namespace palpate::rendering {
namespace {

using Kind = ContactFeature::Kind;

constexpr int kApproach = 2000;  // ticks until the hand has arrived
constexpr int kTicks = 1000;     // recorded

/// One tick of one part, with the input of its stages.
struct RecordedTick {
  LineProbe probe, last;  ///< world
  LineProbe local;        ///< mesh frame
  PartState before;       ///< state before the tick
  WalkResult hit;
  LoadedContact loaded;  ///< before materials
};

/// Ticks over the scene's first part.
struct Recording {
  std::vector<LineProbe> poses;
  RenderState start;           ///< before the first pose
  std::vector<bool> touching;  ///< at each pose, whatever part
  std::vector<RecordedTick> contact, free, entry;
};

template <class Probe>
void record_tick(const Scene& scene, const RenderState& state, const PartState& before,
                 const LineProbe& last, const LineProbe& probe, Recording& out) {
  const ScenePart& part = scene.parts()[0];
  const PartState& after = state.parts[0];
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
  LoadedContact& c = recorded.loaded;
  Probe::classify(*part.mesh, recorded.hit, recorded.local.tip, d, glm::length(d), c);
  c.contact.normal = part.world_vector(recorded.hit.normal);
  c.contact.depth = recorded.hit.depth;
  c.stiffness = part.material.stiffness;
  c.object = part.object;
  load(std::span<LoadedContact, 1>(&c, 1));
  out.contact.push_back(recorded);
}

/// \param lifted  fraction of the time off the object
template <class Probe>
Recording record(const Scene& scene, const Renderer& renderer, double lifted) {
  const ScenePart& part = scene.parts()[0];
  SurfaceStrokeSettings settings;
  settings.centre = part.sphere_centre;
  settings.radius = part.sphere_radius;
  settings.side = Probe::kSegment;
  settings.lifted = lifted;
  settings.lift_period = 200;
  SurfaceStroke hand(settings);
  Recording out;
  RenderState state = scene.initial_state();
  double depth = 0;
  for (int i = 0; i < kApproach + kTicks; ++i) {
    const LineProbe probe = hand.next(depth);
    const PartState before = state.parts[0];
    const LineProbe last = state.has_last ? state.last : probe;
    if (i == kApproach) out.start = state;
    const Rendering rendering = renderer.tick(scene, state, probe, 1e-3);
    depth = rendering.contacts > 0 ? rendering.deepest.depth : 0;
    if (i < kApproach) continue;
    out.poses.push_back(probe);
    out.touching.push_back(rendering.contacts > 0);
    record_tick<Probe>(scene, state, before, last, probe, out);
  }
  return out;
}

double sum(const Vec3& v) { return v.x + v.y + v.z; }

/// The stages of one renderer over recordings: sliding, lifting off, hovering.
template <class Probe>
class StageTimings {
 public:
  StageTimings(const Scene& scene, const Renderer& renderer)
      : scene_(scene),
        renderer_(renderer),
        touching_(std::make_shared<const Recording>(record<Probe>(scene, renderer, 0))),
        lifting_(std::make_shared<const Recording>(record<Probe>(scene, renderer, 0.5))),
        hovering_(std::make_shared<const Recording>(record<Probe>(scene, renderer, 1))) {}

  std::vector<StageTiming> all() {
    add_whole(kTickInContact, touching_, true);
    add_whole(kTickInFreeSpace, hovering_, false);
    add("pose check", touching_, &Recording::contact, [](const ScenePart&, const RecordedTick& m) {
      return tick::within_range(m.probe.tip) && tick::within_range(m.probe.tail) ? 1.0 : 0.0;
    });
    if (scene_.features().several_parts) add_broad_phase();
    add("frame of the part", touching_, &Recording::contact,
        [](const ScenePart& part, const RecordedTick& m) {
          const LineProbe local = Probe::to_local(part, m.probe);
          return sum(local.tip) + sum(local.tail);
        });
    add("separating plane", hovering_, &Recording::free,
        [](const ScenePart&, const RecordedTick& m) {
          return m.before.plane.separates(m.local.tip, m.local.tail) ? 1.0 : 0.0;
        });
    add("first contact", lifting_, &Recording::entry,
        [](const ScenePart& part, const RecordedTick& m) {
          PartState state = m.before;
          return tick::detect_contact<Probe>(part, state, &m.last, m.local).depth;
        });
    add("neighbourhood watch", touching_, &Recording::contact,
        [](const ScenePart& part, const RecordedTick& m) {
          return Probe::walk(*part.mesh, m.before.feature, m.local.tip, m.local.tail - m.local.tip)
              .depth;
        });
    if constexpr (Probe::kSegment) add_sides();
    add("spring", touching_, &Recording::contact, [](const ScenePart&, const RecordedTick& m) {
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
    const auto state = std::make_shared<RenderState>();
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
    const auto state = std::make_shared<RenderState>();
    timings_.push_back({"several parts", touching_->poses.size(),
                        [state, recording = touching_] { *state = recording->start; },
                        [scene = &scene_, state, recording = touching_] {
                          double total = 0;
                          for (const LineProbe& pose : recording->poses) {
                            update_near_parts(*scene, *state, pose);
                            total += static_cast<double>(state->near_parts.size());
                          }
                          return total;
                        }});
  }

  void add_sides() {
    add("side contact", touching_, &Recording::contact,
        [](const ScenePart& part, const RecordedTick& m) {
          LoadedContact c;
          const Vec3 d = m.local.tail - m.local.tip;
          Probe::classify(*part.mesh, m.hit, m.local.tip, d, glm::length(d), c);
          return c.probe_fraction;
        });
    add("torque and second device", touching_, &Recording::contact,
        [](const ScenePart&, const RecordedTick& m) {
          const Vec3 force = m.loaded.force * m.loaded.contact.normal;
          const Vec3 torque =
              glm::cross(m.loaded.probe_fraction * (m.probe.tail - m.probe.tip), force);
          return sum(torque) + sum(m.loaded.probe_fraction * force);
        });
  }

  /// What one material adds, by the tick's own code.
  template <TickFeatures kFeatures>
  void add_material(const char* name) {
    const auto state = std::make_shared<RenderState>();
    timings_.push_back({name, touching_->contact.size(),
                        [state, recording = touching_] { *state = recording->start; },
                        [scene = &scene_, state, recording = touching_] {
                          double total = 0;
                          for (const RecordedTick& recorded : recording->contact) {
                            LoadedContact contact = recorded.loaded;
                            state->last = recorded.last;
                            tick::apply_material_forces<kFeatures>(
                                *scene, *state, recorded.probe,
                                std::span<LoadedContact, 1>(&contact, 1), 1000);
                            total += contact.force + contact.tangential_offset.x;
                          }
                          return total;
                        }});
  }

  void add_materials() {
    if (scene_.features().damping) add_material<TickFeatures{.damping = true}>("damping");
    if (scene_.features().friction) add_material<TickFeatures{.friction = true}>("friction");
  }

  const Scene& scene_;
  const Renderer& renderer_;
  Recorded touching_, lifting_, hovering_;
  std::vector<StageTiming> timings_;
};

}  // namespace

std::vector<StageTiming> stage_timings(const Scene& scene, const Renderer& renderer) {
  if (scene.parts().empty()) return {};
  if (renderer.side_contact()) return StageTimings<tick::SegmentProbe>(scene, renderer).all();
  return StageTimings<tick::PointProbe>(scene, renderer).all();
}

}  // namespace palpate::rendering
