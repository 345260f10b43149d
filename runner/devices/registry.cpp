#include "runner/devices/registry.h"

#include <stdexcept>
#include <string_view>

#include "runner/devices/falcon/open.h"
#include "runner/devices/falcon/parameters.h"
#include "runner/devices/mouse.h"
#include "runner/devices/stroking.h"

namespace palpate::runner {
namespace {

std::vector<ConnectedDevice> always_there() { return {{}}; }
void nothing_to_check(const DeviceConfig& /*config*/) {}

std::unique_ptr<Device> open_simulated(const DeviceConfig& config) {
  return std::make_unique<StrokingStylus>(config.stylus_length, config.stylus_grip, config.rate);
}

std::unique_ptr<Device> open_mouse(const DeviceConfig& config) {
  return std::make_unique<MouseStylus>(config.stylus_length, config.rate);
}

constexpr DeviceKind kKinds[] = {
    {"falcon", "a Novint Falcon: position and force of one point, no orientation", true,
     falcon::check_falcon, falcon::connected_falcons, falcon::open_falcon},
    {"falcon2", "two Novint Falcons that hold the ends of a stylus", true, falcon::check_falcon2,
     falcon::connected_falcons, falcon::open_falcon2},
    {"mouse", "the pointer moves a stylus in the window; contact is seen, not felt", false,
     nothing_to_check, always_there, open_mouse},
    {"simulated",
     "a stylus held by two simulated devices and a simulated hand that moves to and fro", false,
     nothing_to_check, always_there, open_simulated},
};

}  // namespace

std::span<const DeviceKind> device_kinds() { return kKinds; }

DeviceCapabilities nominal_capabilities(const DeviceKind& kind, const DeviceConfig& config) {
  if (!kind.has_force_feedback) return kind.open(config)->capabilities();
  const int freedom = std::string_view(kind.name) == "falcon" ? 3 : 5;
  DeviceCapabilities can;
  can.name = kind.name;
  can.sensed_freedom = can.actuated_freedom = freedom;
  can.max_stiffness = falcon::kMaxStiffness;
  can.max_rate = falcon::kMaxRate;
  can.workspace_radius = falcon::kWorkspaceRadius;
  can.resolution = falcon::kResolution;
  return can;
}

const DeviceKind& device_kind(const std::string& name) {
  std::string known;
  for (const DeviceKind& kind : kKinds) {
    if (name == kind.name) return kind;
    if (!known.empty()) known += ", ";
    known += kind.name;
  }
  throw std::invalid_argument("no device '" + name + "'; there are: " + known);
}

}  // namespace palpate::runner
