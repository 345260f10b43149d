#include "runner/session/replay.h"

#include <limits>
#include <optional>
#include <stdexcept>

#include "runner/devices/replay.h"
#include "runner/scene_builder.h"
#include "runner/servo/servo.h"

namespace palpate::runner {
namespace {

protocols::Trial trial_of(const protocols::Protocol& protocol, const data::TrialRecord& recorded,
                          protocols::RendererKind renderer) {
  protocols::Trial trial;
  trial.session = recorded.session;
  trial.block = recorded.block;
  trial.trial = recorded.trial;
  trial.renderer = renderer;
  trial.practice = recorded.practice;
  const auto& q = recorded.orientation_wxyz;
  trial.orientation = Quat(q[0], q[1], q[2], q[3]);
  for (std::size_t i = 0; i < protocol.stimuli.size(); ++i) {
    if (protocol.stimuli[i].name != recorded.shape) continue;
    trial.stimulus = static_cast<int>(i);
    return trial;
  }
  throw std::invalid_argument("the protocol has no stimulus named " + recorded.shape);
}

bool equal(const std::array<double, 3>& recorded, const Vec3& again) {
  return recorded[0] == again.x && recorded[1] == again.y && recorded[2] == again.z;
}

}  // namespace

void replay(const protocols::Protocol& protocol, const data::TrialRecord& recorded,
            protocols::RendererKind renderer,
            const std::function<void(const data::SampleRecord&, const Sample&)>& visit) {
  const StimulusLibrary library(protocol);
  ReplayDevice device(recorded.samples, protocol.servo_rate);
  ForceLimits limits;
  limits.max_force = limits.max_change = std::numeric_limits<double>::max();
  Servo servo(device, device, protocol.servo_rate, limits);
  // The record begins where the stylus had rested in the home zone.
  constexpr HomeZone kAnywhere{0, 0};
  servo.prepare(library.scene(trial_of(protocol, recorded, renderer)), renderer_for(renderer),
                kAnywhere);
  // Of an extended probe, the record has the virtual stylus; what the hand got of it follows.
  const std::optional<rendering::Reach> reach = workspace_of(protocol).reach;
  for (const data::SampleRecord& sample : recorded.samples) {
    Sample again = servo.tick();
    if (reach) again.rendering = rendering::felt(*reach, again.rendering);
    visit(sample, again);
  }
  servo.stop();
}

bool equals_record(const data::SampleRecord& recorded, const Sample& again) {
  const rendering::Rendering& r = again.rendering;
  return equal(recorded.force, r.force) && equal(recorded.torque, r.torque) &&
         recorded.depth == r.deepest.depth && recorded.contacts == recorded_contacts(r.contacts) &&
         recorded.contact_type == static_cast<std::uint8_t>(r.deepest.type) &&
         (recorded.faults & rendering::kAllRenderFaults) ==
             (r.faults & rendering::kAllRenderFaults);
}

}  // namespace palpate::runner
