#include "rendering/bodies/soft/soft_scene.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

#include "rendering/probe.h"
#include "rendering/renderer.h"
#include "rendering/scene_motion.h"

namespace palpate::rendering {
namespace {

constexpr double kLongestTick = 0.001;   // s; longer ticks are split, with the hand moving evenly
constexpr double kStride = 0.5;          // of the radius; the tool's motion in a piece of a tick
constexpr int kMostPieces = 10'000;      // a gap of more than 10 s in a path counts as 10 s
constexpr int kMostPiecesOfServo = 256;  // the servo gets at most one step a tick
constexpr double kFarthestPose = 1e6;    // m; a reading beyond it is a fault, as for other objects

class SoftMotionState final : public MotionState {
 public:
  RenderState others;
  std::vector<SoftObjectState> soft;
  ToolPose last;
  bool has_last = false, by_tick = false, hold = false;

  std::unique_ptr<MotionState> clone() const override {
    auto copy = std::make_unique<SoftMotionState>(*this);
    for (std::size_t i = 0; i < soft.size(); ++i) {
      copy->soft[i].stepper = nullptr;
      keep_room(soft[i], copy->soft[i]);
    }
    return copy;
  }
  std::span<const BodyPose> bodies() const override { return others.motion.bodies(); }
};

bool is_pose(const Vec3& v) { return glm::dot(v, v) <= kFarthestPose * kFarthestPose; }

/// m, motion of the tool's segments from one pose to the other, at most.
double way(const PlacedTool& from, const Vec3& tip, const PlacedTool& to, const Vec3& to_tip) {
  double most = 0;
  for (std::size_t k = 0; k < from.count; ++k) {
    const Vec3 start = to_tip + to.segments[k].from - tip - from.segments[k].from;
    const Vec3 end = start + to.segments[k].along - from.segments[k].along;
    most = std::max({most, glm::length(start), glm::length(end)});
  }
  return most;
}

/// Adds the contacts of one soft object to a rendering.
void add_contacts(const SoftObject& object, const SoftObjectState& state, const ToolPose& tool,
                  bool sides, bool has_tool, Rendering& r) {
  const SoftContact* strongest = nullptr;
  const double length = sides ? glm::length(tool.d) : 0;
  const Vec3 axis = length > 0 ? tool.d / length : Vec3(0);
  Vec3 force(0), torque(0), device2(0);
  for (const SoftContact& c : state.contact.contacts) {
    if (!(c.force > 0)) continue;
    const Vec3 lever = c.axis_point + state.contact.shift - tool.tip, own = c.force * c.normal;
    force += own;
    ++r.contacts;
    if (sides) torque += glm::cross(lever, own);
    if (length > 0) device2 += glm::dot(lever, axis) / length * glm::dot(own, axis) * axis;
    if (strongest == nullptr || c.force > strongest->force) strongest = &c;
  }
  if (state.contact.dropped) r.faults |= render_fault::kContactsDropped;
  if (state.off) r.faults |= render_fault::kStartedInside;
  if (strongest == nullptr) return;
  if (length > 0) device2 += glm::cross(torque, axis) / length;
  r.force += force;
  r.torque += torque;
  r.device2 += device2;
  r.device1 += force - device2;
  const double depth = glm::length(state.contact.shift);
  if (r.object >= 0 && r.deepest.depth >= depth) return;
  const bool at_end = strongest->along <= 0 || strongest->along >= 1;
  r.deepest.point = strongest->axis_point + state.contact.shift;
  r.deepest.normal = depth > 0 ? state.contact.shift / depth : strongest->normal;
  r.deepest.depth = depth;
  r.deepest.along = sides ? glm::dot(r.deepest.point - tool.tip - state.contact.shift, axis) : 0;
  r.deepest.type = at_end || !sides ? ContactType::point_polygon : ContactType::segment_edge;
  r.ideal = {tool.tip + state.contact.shift, tool.tip + tool.d + state.contact.shift};
  r.object = object.object;
  if (has_tool) r.segment = strongest->segment;
}

class SoftMotion final : public SceneMotion {
 public:
  SoftMotion(Scene others, std::vector<std::shared_ptr<const SoftObject>> soft)
      : others_(std::move(others)), soft_(std::move(soft)) {}

  const std::vector<std::shared_ptr<const SoftObject>>& soft() const { return soft_; }

  std::unique_ptr<MotionState> initial_state() const override {
    auto state = std::make_unique<SoftMotionState>();
    state->others = others_.initial_state();
    state->soft.reserve(soft_.size());  // growth would copy them without their capacity
    for (const auto& object : soft_) state->soft.push_back(rendering::initial_state(*object));
    return state;
  }

  Rendering tick(const Renderer& renderer, RenderState& outer, const LineProbe& probe,
                 double dt) const noexcept override {
    auto& state = static_cast<SoftMotionState&>(*outer.motion.get());
    if (!is_pose(probe.tip) || !is_pose(probe.tail) || !is_pose(outer.measured_side) ||
        !std::isfinite(dt)) {
      Rendering none;
      none.ideal = outer.last;
      none.faults = render_fault::kNonFinite;
      return none;
    }
    state.others.measured_side = outer.measured_side;
    Rendering result;
    result.ideal = probe;
    if (!others_.parts().empty() || others_.motion() != nullptr)
      result = renderer.tick(others_, state.others, probe, dt);
    const bool sides = renderer.side_contact();
    const Tool* const tool = others_.tool();
    ToolPose pose{probe.tip, probe.tail - probe.tip};
    if (tool != nullptr)
      pose.frame =
          tool_frame(pose.d, state.has_last ? &state.last.frame : nullptr, outer.measured_side);
    if (state.by_tick) result.faults |= pace(state, std::max(0.0, dt));
    follow(state, pose, tool, sides, std::max(0.0, dt));
    if (tool != nullptr) result.ideal_side = pose.frame[0];
    for (std::size_t i = 0; i < soft_.size(); ++i)
      add_contacts(*soft_[i], state.soft[i], pose, sides, tool != nullptr, result);
    const Vec3 all = result.force + result.torque;
    const bool failed = std::ranges::any_of(state.soft, &SoftObjectState::failed);
    const bool stalled = std::ranges::any_of(state.soft, is_stalled);
    if (failed || stalled || !std::isfinite(all.x + all.y + all.z)) {
      Rendering none;
      none.ideal = probe;
      none.faults =
          result.faults | (stalled ? render_fault::kSoftStalled : render_fault::kNonFinite);
      result = none;
    }
    state.last = pose;
    state.has_last = true;
    outer.last = probe;
    outer.has_last = true;
    return result;
  }

 private:
  /// Decides which steps arrive in a tick of dt.
  /// \return kSoftLate: a step was due and none arrived
  std::uint32_t pace(SoftMotionState& state, double dt) const noexcept {
    bool due = false, late = state.hold;
    for (std::size_t i = 0; i < soft_.size(); ++i) {
      SoftObjectState& own = state.soft[i];
      const bool own_due = step_is_due(*soft_[i], own, dt);
      own.pace = own_due ? SoftPace::this_tick : SoftPace::hold;
      due = due || own_due;
      late = late || (own_due && own.stepper != nullptr && !own.stepper->ready());
    }
    if (!due || !late) return 0;
    for (SoftObjectState& own : state.soft) own.pace = SoftPace::hold;
    return render_fault::kSoftLate;
  }

  /// Advances all bodies while the hand moves evenly from the last pose to this one.
  void follow(SoftMotionState& state, const ToolPose& to, const Tool* tool, bool sides,
              double dt) const noexcept {
    const ToolPose from = state.has_last ? state.last : to;
    const double moved = way(place(tool, sides, from), from.tip, place(tool, sides, to), to.tip);
    for (std::size_t i = 0; i < soft_.size(); ++i) {
      const double stride = std::min(soft_[i]->contact.radius * kStride, kLongestStride);
      const double wanted =
          std::max({1.0, std::ceil(moved / stride - 1e-9), std::ceil(dt / kLongestTick - 1e-6)});
      const int most = state.by_tick ? kMostPiecesOfServo : kMostPieces;
      const int pieces = static_cast<int>(std::min<double>(wanted, most));
      const double piece = state.by_tick ? dt / pieces : std::min(dt / pieces, kLongestTick);
      for (int k = 1; k <= pieces; ++k) {
        const ToolPose at = k < pieces ? between(from, to, static_cast<double>(k) / pieces) : to;
        advance(*soft_[i], state.soft[i], at.tip, place(tool, sides, at), moved / pieces, piece);
      }
    }
  }

  static constexpr double kLongestStride = 0.002;  // m; for tools thicker than elements

  Scene others_;
  std::vector<std::shared_ptr<const SoftObject>> soft_;
};

const SoftMotion* soft_motion(const Scene& scene) {
  return dynamic_cast<const SoftMotion*>(scene.motion());
}

}  // namespace

Scene soft_scene(Scene others, std::vector<SceneObject> shown,
                 std::vector<std::shared_ptr<const SoftObject>> soft, bool side_contact,
                 const Tool& tool) {
  return Scene(std::move(shown), side_contact, tool,
               std::make_shared<const SoftMotion>(std::move(others), std::move(soft)));
}

void visit_soft_contacts(const RenderState& state, SoftContactVisit visit, void* whom) noexcept {
  const auto* const own = dynamic_cast<const SoftMotionState*>(state.motion.get());
  if (own == nullptr) return;
  for (const SoftObjectState& soft : own->soft) {
    for (const SoftContact& contact : soft.contact.contacts) {
      if (contact.force > 0)
        visit(whom, contact.axis_point + soft.contact.shift, contact.force * contact.normal);
    }
  }
}

void pace_by_tick(RenderState& state) {
  if (auto* const own = dynamic_cast<SoftMotionState*>(state.motion.get())) own->by_tick = true;
}

void hold_steps(RenderState& state, bool held) noexcept {
  if (auto* const own = dynamic_cast<SoftMotionState*>(state.motion.get())) own->hold = held;
}

void step_elsewhere(RenderState& state, std::span<SoftStepper* const> steppers) {
  pace_by_tick(state);
  auto* const own = dynamic_cast<SoftMotionState*>(state.motion.get());
  if (own == nullptr) return;
  for (std::size_t i = 0; i < own->soft.size() && i < steppers.size(); ++i)
    own->soft[i].stepper = steppers[i];
}

std::vector<SoftShape> soft_shapes(const Scene& scene, const RenderState& state) {
  std::vector<SoftShape> shapes;
  const SoftMotion* const motion = soft_motion(scene);
  const auto* const own = dynamic_cast<const SoftMotionState*>(state.motion.get());
  if (motion == nullptr || own == nullptr) return shapes;
  for (std::size_t i = 0; i < own->soft.size(); ++i) {
    const SoftObject& object = *motion->soft()[i];
    shapes.push_back({object.object, object.rest, own->soft[i].view.x, object.surface.triangles()});
  }
  return shapes;
}

std::span<const std::shared_ptr<const SoftObject>> soft_objects(const Scene& scene) {
  const SoftMotion* const motion = soft_motion(scene);
  if (motion == nullptr) return {};
  return motion->soft();
}

}  // namespace palpate::rendering
