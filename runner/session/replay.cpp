#include "runner/session/replay.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>

#include "runner/participants/seen_trial.h"
#include "runner/scene_builder.h"
#include "runner/servo/servo.h"
#include "runner/session/body_record.h"
#include "runner/session/device_check.h"
#include "runner/session/replay_device.h"
#include "runner/session/session_scenes.h"
#include "stimuli/shapes.h"

namespace palpate::runner::session {
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
  const auto block =
      std::ranges::find(protocol.blocks, recorded.task.block_name, &protocols::TaskBlock::name);
  if (block == protocol.blocks.end())
    throw std::invalid_argument("the protocol has no block named " + recorded.task.block_name);
  trial.task_block = static_cast<int>(block - protocol.blocks.begin());
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

/// Of a level of several dimensions, the point takes the place of the recorded level.
void put_point(const protocols::Protocol& protocol, const protocols::Trial& trial,
               const data::TaskRecord& task, protocols::Interval& interval) {
  const protocols::TaskBlock& block = protocols::block_of(protocol, trial);
  if (block.dimensions.empty()) return;
  interval.level.reset();
  if (task.dimensions.size() != block.dimensions.size() || interval.stimulus < 0) return;
  for (const auto& [name, value] : task.dimensions) interval.point.push_back(value);
}

std::vector<ShownInterval> scenes_of(const protocols::Protocol& protocol,
                                     const data::TrialRecord& recorded, bool other,
                                     const StimulusLibrary* library) {
  const protocols::Trial trial = trial_of(protocol, recorded);
  std::vector<ShownInterval> shown;
  SessionScenes scenes(protocol, library);
  for (const data::IntervalRecord& interval : data::intervals_of(recorded)) {
    protocols::Interval one = interval_of(protocol, interval, other);
    put_point(protocol, trial, recorded.task, one);
    shown.push_back({one.renderer, scenes.scene(trial, one)});
  }
  return shown;
}

bool equal(const std::array<double, 3>& recorded, const Vec3& again) {
  return recorded[0] == again.x && recorded[1] == again.y && recorded[2] == again.z;
}

/// The samples of each interval of a trial, in order; the record begins with tick 0 in each. A
/// trial of version 1 has one interval.
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

}  // namespace

std::vector<std::optional<stimuli::ObjectSpec>> shown_objects(const protocols::Protocol& protocol,
                                                              const data::TrialRecord& recorded) {
  const protocols::Trial trial = trial_of(protocol, recorded);
  std::vector<std::optional<stimuli::ObjectSpec>> shown;
  for (const data::IntervalRecord& recorded_one : data::intervals_of(recorded)) {
    const protocols::Interval one = interval_of(protocol, recorded_one, false);
    shown.push_back(one.stimulus < 0 ? std::nullopt
                                     : std::optional(shown_object(protocol, trial, one)));
  }
  return shown;
}

bool is_felt(const protocols::Protocol& protocol, const data::IntervalRecord& recorded) {
  const int stimulus = interval_of(protocol, recorded, false).stimulus;
  return stimulus >= 0 && protocol.stimuli[static_cast<std::size_t>(stimulus)].felt;
}

std::vector<std::shared_ptr<const display::SeenTrial>> shown_sights(
    const protocols::Protocol& protocol, const data::TrialRecord& recorded) {
  const protocols::Trial trial = trial_of(protocol, recorded);
  std::vector<std::shared_ptr<const display::SeenTrial>> seen;
  for (const data::IntervalRecord& recorded_one : data::intervals_of(recorded))
    seen.push_back(
        participants::seen_trial_of(protocol, trial, interval_of(protocol, recorded_one, false)));
  return seen;
}

void replay(
    const protocols::Protocol& protocol, const data::TrialRecord& recorded, bool other,
    const std::function<void(std::size_t, const data::SampleRecord&, const ReplayedSample&)>& visit,
    const StimulusLibrary* library) {
  const std::vector<ShownInterval> shown = scenes_of(protocol, recorded, other, library);
  const auto intervals = samples_of_intervals(recorded);
  // An interval whose time was over before it began has no samples.
  const std::size_t least = shown.size() - (recorded.timed_out ? 1 : 0);
  if (intervals.size() > shown.size() || intervals.size() < least)
    throw std::invalid_argument("samples of " + std::to_string(shown.size()) +
                                " intervals are expected, found " +
                                std::to_string(intervals.size()));
  servo::ForceLimits limits;
  limits.max_force = limits.max_change = std::numeric_limits<double>::max();
  // The record begins with the stylus at rest in the home zone.
  constexpr servo::HomeZone kAnywhere{0, 0};
  // For an extended probe the record has the virtual stylus; the forces at the hand follow from it.
  const std::optional<rendering::Reach> reach = workspace_of(protocol).reach;
  for (std::size_t i = 0; i < intervals.size(); ++i) {
    ReplayDevice device(intervals[i], protocol.servo_rate);
    servo::Servo servo(device, device, protocol.servo_rate, limits);
    servo.prepare(shown[i].scene, renderer_for(shown[i].renderer), kAnywhere);
    for (const data::SampleRecord& sample : intervals[i]) {
      servo.hold_steps((sample.faults & rendering::render_fault::kSoftLate) != 0);
      ReplayedSample again;
      static_cast<servo::Sample&>(again) = servo.tick();
      if (again.bodies > 0) again.body = servo.bodies().front();
      if (reach) again.rendering = rendering::felt(*reach, again.rendering);
      visit(i, sample, again);
    }
    servo.stop();
  }
}

bool equals_record(const data::TrialRecord& recorded, const data::SampleRecord& tick,
                   const ReplayedSample& again) {
  const rendering::Rendering& r = again.rendering;
  const std::optional<data::BodyRecord> body = data::body_of(recorded, tick);
  if (body && !(again.body && same_body(*body, body_record(*again.body)))) return false;
  return equal(tick.force, r.force) && equal(tick.torque, r.torque) &&
         tick.depth == r.deepest.depth && tick.contacts == servo::recorded_contacts(r.contacts) &&
         tick.contact_type == static_cast<std::uint8_t>(r.deepest.type) &&
         (tick.faults & rendering::kAllRenderFaults) == (r.faults & rendering::kAllRenderFaults);
}

}  // namespace palpate::runner::session
