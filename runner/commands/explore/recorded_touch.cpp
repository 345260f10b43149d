#include "runner/commands/explore/recorded_touch.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <iterator>
#include <memory>
#include <utility>

#include "runner/commands/render/forces.h"
#include "runner/display/timeline.h"

namespace palpate::runner {
namespace {

constexpr double kSoftEvery = 0.015;  // s; a minute of every tick's surfaces would fill the memory

}  // namespace

SceneMoment moment_of(const TimedPose& pose, const protocols::SceneSpec& spec,
                      const rendering::Scene& scene, const rendering::Rendering& rendering,
                      const rendering::RenderState& state) {
  SceneMoment out{.sample = {}, .contacts = contact_places(scene, state, rendering)};
  out.sample.time_ns = std::llround(pose.t * 1e9);
  out.sample.probe = virtual_stylus(spec, pose.probe);
  out.sample.rendering = rendering;
  out.sample.faults = rendering.faults;
  out.sample.device1 = rendering.device1;
  out.sample.device2 = rendering.device2;
  if (spec.reach) out.held = pose.probe;
  out.poses = object_poses(spec.objects, state);
  out.soft = soft_surfaces(scene, state);
  return out;
}

RecordedTouch::RecordedTouch(std::string scene_path, protocols::SceneSpec spec,
                             const rendering::Renderer& renderer, std::vector<TimedPose> poses)
    : scene_path_(std::move(scene_path)),
      spec_(std::move(spec)),
      renderer_(renderer),
      poses_(std::move(poses)) {
  touch();
}

void RecordedTouch::touch() {
  const rendering::Scene scene = build_scene(scene_path_, spec_, renderer_);
  const std::size_t stride = (poses_.size() + Timeline::kMost - 2) / (Timeline::kMost - 1);
  std::size_t row = 0;
  std::uint32_t faults = 0;
  double soft_time = -1;  // of the surfaces that were kept last: fewer than there are ticks
  std::vector<std::shared_ptr<const SoftSurfaceNow>> soft;
  moments_.clear();
  render_along(scene, spec_, renderer_, poses_,
               [&](const TimedPose& pose, const rendering::Rendering& rendering,
                   const rendering::RenderState& state) {
                 faults |= rendering.faults;  // of rows that are not kept as well
                 if (row++ % stride != 0) return;
                 moments_.push_back(moment_of(pose, spec_, scene, rendering, state));
                 moments_.back().sample.faults = std::exchange(faults, 0);
                 if (pose.t >= soft_time && pose.t < soft_time + kSoftEvery && soft_time >= 0) {
                   moments_.back().soft = soft;
                 } else {
                   soft = moments_.back().soft;
                   soft_time = pose.t;
                 }
               });
}

void RecordedTouch::take(std::vector<SceneMoment>& out) {
  out.insert(out.end(), std::make_move_iterator(moments_.begin()),
             std::make_move_iterator(moments_.end()));
  moments_.clear();
}

void RecordedTouch::show(const std::vector<stimuli::ObjectSpec>& objects) {
  const std::vector<stimuli::ObjectSpec> before = std::exchange(spec_.objects, objects);
  trouble_.clear();
  try {
    touch();
  } catch (const std::exception& fault) {
    trouble_ = fault.what();
    spec_.objects = before;
    touch();
  }
}

}  // namespace palpate::runner
