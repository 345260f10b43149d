#include "runner/serve/why_off.h"

#include "rendering/render_fault.h"
#include "runner/serve/messages.h"
#include "runner/servo/sample.h"
#include "runner/session/session_end.h"

namespace palpate::runner::serve {
namespace {

constexpr const char* kEmergencyCode = "emergency";

const char* code_of(servo::DeviceTrouble trouble) {
  using servo::DeviceTrouble;
  switch (trouble) {
    case DeviceTrouble::none:
      return "device-lost";
    case DeviceTrouble::late:
      return "late";
    case DeviceTrouble::unplugged:
      return "unplugged";
    case DeviceTrouble::silent:
      return "silent";
    case DeviceTrouble::not_homed:
      return "not-homed";
    case DeviceTrouble::implausible:
      return "implausible";
    case DeviceTrouble::apart:
      return "apart";
    case DeviceTrouble::guarded:
      return "guarded";
    case DeviceTrouble::guard_late:
      return "guard-late";
    case DeviceTrouble::guard_lost:
      return "guard-lost";
    case DeviceTrouble::reopening:
      return "reopening";
    case DeviceTrouble::not_calibrated:
      return "not-calibrated";
    case DeviceTrouble::stopped_by_device:
      return "stopped-by-device";
    case DeviceTrouble::service_gone:
      return "service-gone";
    case DeviceTrouble::in_use:
      return "in-use";
    case DeviceTrouble::unreadable:
      return "unreadable";
  }
  return "device-lost";
}

std::string code_of(std::uint32_t faults, servo::DeviceTrouble trouble) {
  using namespace servo::servo_fault;
  if (faults & kEmergency) return kEmergencyCode;
  if (faults & kStalled) return "stalled";
  if (faults & kDeviceLost) return code_of(trouble);
  if (faults & kMissedTicks) return "missed-ticks";
  if (faults & rendering::render_fault::kNonFinite) return "not-finite";
  if (faults & rendering::render_fault::kSoftStalled) return "soft-stalled";
  return "not-cleared";
}

}  // namespace

WhyOff why_off(std::uint32_t faults, servo::DeviceTrouble trouble) {
  return {code_of(faults, trouble), session::trip_reason(faults, trouble)};
}

bool Emergencies::raise(std::uint64_t client) {
  const std::lock_guard lock(mutex_);
  return by_.insert(client).second;
}

bool Emergencies::any() const {
  const std::lock_guard lock(mutex_);
  return !by_.empty();
}

bool Emergencies::raised_by(std::uint64_t client) const {
  const std::lock_guard lock(mutex_);
  return by_.contains(client);
}

std::set<std::uint64_t> Emergencies::lift(std::uint64_t client) {
  std::set<std::uint64_t> lifted;
  {
    const std::lock_guard lock(mutex_);
    if (client == kHere || by_.empty() || (by_.size() == 1 && by_.contains(client))) {
      lifted.swap(by_);
      return lifted;
    }
  }
  throw MessageRefused(kEmergencyCode, why().words);
}

void Emergencies::restore(const std::set<std::uint64_t>& lifted) {
  const std::lock_guard lock(mutex_);
  by_.insert(lifted.begin(), lifted.end());
}

WhyOff Emergencies::why() const {
  std::string clients;
  const std::lock_guard lock(mutex_);
  for (const std::uint64_t client : by_)
    clients += (clients.empty() ? " " : ", ") + std::to_string(client);
  return {kEmergencyCode, "emergency by client" + clients +
                              ": cleared there, or with the word clear where palpate serve runs"};
}

}  // namespace palpate::runner::serve
