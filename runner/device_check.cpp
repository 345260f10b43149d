#include "runner/device_check.h"

#include <glm/geometric.hpp>
#include <sstream>

namespace palpate {

std::vector<std::string> misfits(const Protocol& protocol, const StimulusLibrary& library,
                                 const DeviceCapabilities& device) {
  std::vector<std::string> out;
  const auto add = [&out](const auto&... parts) {
    std::ostringstream text;
    (text << ... << parts);
    out.push_back(text.str());
  };
  for (const RendererKind kind : protocol.renderers) {
    const int needed = renderer_for(kind).side_contact() ? 5 : 3;
    if (device.sensed_freedom < needed) {
      add("renderer '", to_string(kind), "' needs a device that senses ", needed,
          " degrees of freedom; '", device.name, "' senses ", device.sensed_freedom);
    }
  }
  if (protocol.servo_rate > device.max_rate) {
    add("/servo/rate_hz is ", protocol.servo_rate, "; '", device.name, "' runs at up to ",
        device.max_rate, " Hz");
  }
  for (std::size_t i = 0; i < protocol.stimuli.size(); ++i) {
    const StimulusSpec& stimulus = protocol.stimuli[i];
    const double stiffness = stimulus.object.material.stiffness;
    if (stiffness > device.max_stiffness) {
      add("stimulus '", stimulus.name, "' has ", stiffness, " N/m; '", device.name,
          "' shows up to ", device.max_stiffness, " N/m");
    }
    const double needed =
        glm::length(protocol.workspace.centre) +
        (library.reach(static_cast<int>(i)) + protocol.home.margin) / protocol.workspace.scale;
    if (needed > device.workspace_radius) {
      add("stimulus '", stimulus.name, "' with its home zone needs ", needed,
          " m about the centre of '", device.name, "', which reaches ", device.workspace_radius,
          " m: move /workspace/centre_m or raise /workspace/scale");
    }
  }
  return out;
}

}  // namespace palpate
