#include "runner/session/replay.h"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>

#include "runner/devices/replay.h"
#include "runner/scene_builder.h"
#include "runner/servo/servo.h"
#include "runner/session/body_record.h"
#include "runner/session/level_scenes.h"
#include "stimuli/shapes.h"

namespace palpate::runner {
namespace {

using protocols::RendererKind;

/// A renderer, and its scene for the recorded trial.
struct ShownInterval {
  RendererKind renderer;
  rendering::Scene scene;
};

RendererKind kind_of(const std::string& name, bool other) {
  const bool ray = (name == protocols::to_string(RendererKind::ray)) != other;
  return ray ? RendererKind::ray : RendererKind::point;
}

int stimulus_named(const protocols::Protocol& protocol, const std::string& name) {
  for (std::size_t i = 0; i < protocol.stimuli.size(); ++i) {
    if (protocol.stimuli[i].name == name) return static_cast<int>(i);
  }
  throw std::invalid_argument("the protocol has no stimulus named " + name);
}

protocols::Trial trial_of(const protocols::Protocol& protocol, const data::TrialRecord& recorded) {
  protocols::Trial trial;
  trial.session = recorded.session;
  trial.block = recorded.block;
  trial.trial = recorded.trial;
  trial.practice = recorded.practice;
  const auto& q = recorded.orientation_wxyz;
  trial.orientation = Quat(q[0], q[1], q[2], q[3]);
  trial.stimulus = stimulus_named(protocol, recorded.shape);
  if (!recorded.task) return trial;
  for (std::size_t i = 0; i < protocol.blocks.size(); ++i) {
    if (protocol.blocks[i].name == recorded.task->block_name)
      trial.task_block = static_cast<int>(i);
  }
  if (trial.task_block < 0)
    throw std::invalid_argument("the protocol has no block named " + recorded.task->block_name);
  return trial;
}

protocols::Interval interval_of(const protocols::Protocol& protocol,
                                const data::IntervalRecord& recorded, bool other) {
  protocols::Interval one;
  one.stimulus = recorded.stimulus.empty() ? -1 : stimulus_named(protocol, recorded.stimulus);
  one.renderer = kind_of(recorded.renderer, other);
  one.level = recorded.level;
  one.standard = recorded.standard;
  return one;
}

std::vector<ShownInterval> scenes_of(const protocols::Protocol& protocol,
                                     const data::TrialRecord& recorded, bool other) {
  protocols::Trial trial = trial_of(protocol, recorded);
  std::vector<ShownInterval> shown;
  if (!recorded.task) {
    trial.renderer = kind_of(recorded.renderer, other);
    shown.push_back({trial.renderer, StimulusLibrary(protocol).scene(trial)});
    return shown;
  }
  LevelScenes scenes(protocol);
  for (const data::IntervalRecord& interval : recorded.task->intervals) {
    const protocols::Interval one = interval_of(protocol, interval, other);
    shown.push_back({one.renderer, scenes.scene(trial, one)});
  }
  return shown;
}

bool equal(const std::array<double, 3>& recorded, const Vec3& again) {
  return recorded[0] == again.x && recorded[1] == again.y && recorded[2] == again.z;
}

}  // namespace

std::vector<std::span<const data::SampleRecord>> samples_of_intervals(
    const data::TrialRecord& recorded) {
  std::vector<std::span<const data::SampleRecord>> intervals;
  const std::span<const data::SampleRecord> all(recorded.samples);
  std::size_t begin = 0;
  for (std::size_t i = 1; i <= all.size(); ++i) {
    if (i < all.size() && all[i].tick > all[i - 1].tick) continue;
    intervals.push_back(all.subspan(begin, i - begin));
    begin = i;
  }
  return intervals;
}

std::vector<std::optional<stimuli::ObjectSpec>> shown_objects(const protocols::Protocol& protocol,
                                                              const data::TrialRecord& recorded) {
  const protocols::Trial trial = trial_of(protocol, recorded);
  if (!recorded.task) {
    stimuli::ObjectSpec object = protocol.stimuli[static_cast<std::size_t>(trial.stimulus)].object;
    object.pose = stimuli::compose({Vec3(0), trial.orientation}, object.pose);
    return {object};
  }
  std::vector<std::optional<stimuli::ObjectSpec>> shown;
  for (const data::IntervalRecord& recorded_one : recorded.task->intervals) {
    const protocols::Interval one = interval_of(protocol, recorded_one, false);
    shown.push_back(one.stimulus < 0 ? std::nullopt
                                     : std::optional(shown_object(protocol, trial, one)));
  }
  return shown;
}

namespace {

void replay_shown(const protocols::Protocol& protocol, const data::TrialRecord& recorded,
                  const std::vector<ShownInterval>& shown,
                  const std::function<void(std::size_t, const data::SampleRecord&,
                                           const ReplayedSample&)>& visit) {
  const auto intervals = samples_of_intervals(recorded);
  // One whose time was over before it began has none.
  const std::size_t least = shown.size() - (recorded.task && recorded.timed_out ? 1 : 0);
  if (intervals.size() > shown.size() || intervals.size() < least)
    throw std::invalid_argument("samples of " + std::to_string(shown.size()) +
                                " intervals are expected, found " +
                                std::to_string(intervals.size()));
  ForceLimits limits;
  limits.max_force = limits.max_change = std::numeric_limits<double>::max();
  // The record begins where the stylus had rested in the home zone.
  constexpr HomeZone kAnywhere{0, 0};
  // Of an extended probe, the record has the virtual stylus; what the hand got of it follows.
  const std::optional<rendering::Reach> reach = workspace_of(protocol).reach;
  for (std::size_t i = 0; i < intervals.size(); ++i) {
    ReplayDevice device(intervals[i], protocol.servo_rate);
    Servo servo(device, device, protocol.servo_rate, limits);
    servo.prepare(shown[i].scene, renderer_for(shown[i].renderer), kAnywhere);
    for (const data::SampleRecord& sample : intervals[i]) {
      servo.hold_steps((sample.faults & rendering::render_fault::kSoftLate) != 0);
      ReplayedSample again;
      static_cast<Sample&>(again) = servo.tick();
      if (again.bodies > 0) again.body = servo.bodies().front();
      if (reach) again.rendering = rendering::felt(*reach, again.rendering);
      visit(i, sample, again);
    }
    servo.stop();
  }
}

}  // namespace

void replay(const protocols::Protocol& protocol, const data::TrialRecord& recorded, bool other,
            const std::function<void(std::size_t, const data::SampleRecord&,
                                     const ReplayedSample&)>& visit) {
  replay_shown(protocol, recorded, scenes_of(protocol, recorded, other), visit);
}

void replay(const protocols::Protocol& protocol, const StimulusLibrary& library,
            const data::TrialRecord& recorded,
            const std::function<void(std::size_t, const data::SampleRecord&,
                                     const ReplayedSample&)>& visit) {
  protocols::Trial trial = trial_of(protocol, recorded);
  trial.renderer = kind_of(recorded.renderer, false);
  replay_shown(protocol, recorded, {{trial.renderer, library.scene(trial)}}, visit);
}

bool equals_record(const data::TrialRecord& recorded, const data::SampleRecord& tick,
                   const ReplayedSample& again) {
  const rendering::Rendering& r = again.rendering;
  const std::optional<data::BodyRecord> body = data::body_of(recorded, tick);
  if (body && !(again.body && same_body(*body, body_record(*again.body)))) return false;
  return equal(tick.force, r.force) && equal(tick.torque, r.torque) &&
         tick.depth == r.deepest.depth && tick.contacts == recorded_contacts(r.contacts) &&
         tick.contact_type == static_cast<std::uint8_t>(r.deepest.type) &&
         (tick.faults & rendering::kAllRenderFaults) == (r.faults & rendering::kAllRenderFaults);
}

}  // namespace palpate::runner
