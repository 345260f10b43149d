#include "runner/session/field_power.h"

#include <algorithm>

namespace palpate::runner::session {

void FieldPower::begin(const rendering::Scene& scene, bool side_contact) {
  using Kind = stimuli::FieldSpec::Kind;
  fields_.clear();
  side_contact_ = side_contact;
  has_last_ = false;
  watts_ = 0;
  if (scene.effects() == nullptr) return;
  grip_ = scene.effects()->grip;
  for (const rendering::ObjectEffects& object : scene.effects()->objects) {
    if (object.moves) continue;
    for (const stimuli::FieldSpec& spec : object.fields) {
      if (spec.kind != Kind::viscous && spec.kind != Kind::curl) continue;
      fields_.push_back({spec, object.pose.orientation, Vec3(0), Vec3(0), Vec3(0)});
    }
  }
}

void FieldPower::add(const servo::Sample& sample) noexcept {
  const double period = 1e-9 * static_cast<double>(sample.period_ns);
  if (fields_.empty() || !(period > 0)) return;
  const rendering::LineProbe& probe = sample.probe;
  const double length = glm::distance(probe.tip, probe.tail);
  double work = 0;
  for (Field& field : fields_) {
    const bool at_grip = field.spec.at_grip && side_contact_ && length > 0;
    const double share = at_grip ? std::min(grip_, length) / length : 0;
    const Vec3 place = probe.tip + share * (probe.tail - probe.tip);
    if (has_last_) {
      const Vec3 step = place - field.last;
      work += glm::dot(field.force, step);
      field.velocity +=
          rendering::low_pass_share(period, field.spec.low_pass) * (step / period - field.velocity);
    }
    field.last = place;
    const Vec3 own = glm::conjugate(field.orientation) * field.velocity;
    field.force = field.orientation * rendering::field_force(field.spec, Vec3(0), own, 0, false);
  }
  if (has_last_) watts_ += rendering::low_pass_share(period, kMemory) * (work / period - watts_);
  has_last_ = true;
}

}  // namespace palpate::runner::session
