#include "runner/session/device_check.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

namespace palpate::runner {
namespace {

using Json = nlohmann::ordered_json;
constexpr const char* kLimitedEvent = "material_limited";

template <class... Values>
std::string sentence(const Values&... values) {
  std::ostringstream text;
  (text << ... << values);
  return text.str();
}

/// The stiffest that the probe can meet in it, N/m.
double stiffest(const stimuli::Material& material) {
  double out = material.stiffness;
  for (const stimuli::Layer& layer : material.layers) out = std::max(out, layer.stiffness);
  return out;
}

/// Calls visit(material) for the object and the parts of a compound.
template <class Object, class Visit>
void visit_materials(Object& object, const Visit& visit) {
  visit(object.material);
  for (auto& part : object.parts) visit_materials(part, visit);
}

void scale_down(stimuli::Material& material, double fraction) {
  material.stiffness *= fraction;
  material.damping *= fraction;
  for (stimuli::Layer& layer : material.layers) layer.stiffness *= fraction;
}

/// \throws std::invalid_argument
stimuli::Material& material_of(protocols::Protocol& protocol, const std::string& stimulus,
                               int part) {
  stimuli::Material* found = nullptr;
  for (protocols::StimulusSpec& candidate : protocol.stimuli) {
    if (candidate.name != stimulus) continue;
    int at = 0;
    visit_materials(candidate.object, [&](stimuli::Material& material) {
      if (at++ == part) found = &material;
    });
  }
  if (found == nullptr)
    throw std::invalid_argument("the protocol has no part " + std::to_string(part) +
                                " of a stimulus '" + stimulus +
                                "', which the record says was limited");
  return *found;
}

/// Hz: the protocol's, or the device's highest (a protocol that asks for more is refused as such).
double shown_rate(const protocols::Protocol& protocol, const DeviceCapabilities& device) {
  return std::min(protocol.servo_rate, device.max_rate);
}

/// What the passivity controller would do for a material that cannot be shown whole.
std::string passivity_advice(const protocols::Protocol& protocol, const stimuli::Material& material,
                             const DeviceCapabilities& device, const ShowableMaterial& without) {
  if (protocol.passivity_controller) return "";
  const double with =
      showable(material, device, shown_rate(protocol, device), protocol.workspace.scale, true)
          .fraction;
  if (with <= without.fraction) return "(/servo/passivity_controller would not help here) ";
  return sentence("set /servo/passivity_controller to true (",
                  with < 1 ? sentence("then up to ", stiffest(material) * with, " N/m")
                           : std::string("then it can be shown"),
                  "), ");
}

}  // namespace

ShowableMaterial showable(const stimuli::Material& material, const DeviceCapabilities& device,
                          double rate, double scale, bool passivity_controller) {
  ShowableMaterial out;
  const double stiffness = stiffest(material) * scale, damping = std::abs(material.damping) * scale;
  const auto bound = [&out](double fraction, const auto&... reason) {
    // A hair of rounding does not refuse a material that stands at the bound.
    if (fraction >= out.fraction || fraction >= 1 - 1e-9) return;
    out = {std::max(0.0, fraction), sentence(reason...)};
  };
  const std::string shown = scale == 1 ? "" : sentence(" (", stiffness, " N/m at the hand)");
  if (stiffness > 0) {
    const double most = device.max_stiffness * rate / device.max_rate;
    bound(most / stiffness, stiffest(material), " N/m", shown, ", and '", device.name,
          "' shows up to ", most, " N/m at ", rate, " Hz");
    if (device.friction > 0 && device.resolution > 0) {
      const double held = 2 * device.friction / device.resolution;
      bound(held / stiffness, stiffest(material), " N/m", shown, ", and the friction of '",
            device.name, "', ", device.friction, " N, holds up to ", held, " N/m against steps of ",
            device.resolution, " m");
    }
  }
  const double needed = stiffness / rate / 2 + damping;
  if (device.damping > 0 && needed > 0) {
    const double b = device.damping * (passivity_controller ? kPassivityExtension : 1);
    bound(b / needed, stiffest(material), " N/m and ", material.damping, " N s/m", shown, " at ",
          rate, " Hz, which need ", needed, " N s/m of physical damping, and '", device.name,
          "' has ", device.damping,
          passivity_controller ? " with the passivity controller on" : "");
  }
  return out;
}

std::vector<LimitedMaterial> limit_materials(protocols::Protocol& protocol,
                                             const DeviceCapabilities& device) {
  std::vector<LimitedMaterial> out;
  if (protocol.material_limit != protocols::MaterialLimit::limit || device.actuated_freedom == 0)
    return out;
  for (protocols::StimulusSpec& stimulus : protocol.stimuli) {
    int part = -1;
    visit_materials(stimulus.object, [&](stimuli::Material& material) {
      ++part;
      const ShowableMaterial can =
          showable(material, device, shown_rate(protocol, device), protocol.workspace.scale,
                   protocol.passivity_controller);
      if (can.reason.empty() || can.fraction == 0) return;  // nothing to show: incompatible
      const double shown = can.fraction * (1 - 1e-12);      // rounding stays below the bound
      out.push_back(
          {stimulus.name, part, shown, material.stiffness, material.damping,
           sentence("stimulus '", stimulus.name, "' has ", can.reason, ": limited to ",
                    material.stiffness * shown, " N/m and ", material.damping * shown, " N s/m")});
      scale_down(material, shown);
    });
  }
  return out;
}

std::string to_json_text(const std::vector<LimitedMaterial>& limited,
                         const DeviceCapabilities& device, double rate) {
  Json materials = Json::array();
  for (const LimitedMaterial& one : limited) {
    materials.push_back({{"stimulus", one.stimulus},
                         {"part", one.part},
                         {"share", one.fraction},
                         {"asked_stiffness_n_per_m", one.stiffness},
                         {"asked_damping_ns_per_m", one.damping},
                         {"shown_stiffness_n_per_m", one.stiffness * one.fraction},
                         {"shown_damping_ns_per_m", one.damping * one.fraction}});
  }
  return Json{{kLimitedEvent, std::move(materials)}, {"device", device.name}, {"rate_hz", rate}}
      .dump();
}

bool limit_as_recorded(protocols::Protocol& protocol, const std::string& event) {
  const Json json = Json::parse(event, nullptr, false);
  if (!json.is_object() || !json.contains(kLimitedEvent)) return false;
  try {
    for (const Json& one : json.at(kLimitedEvent)) {
      stimuli::Material& material =
          material_of(protocol, one.at("stimulus").get<std::string>(), one.at("part").get<int>());
      if (material.stiffness != one.at("asked_stiffness_n_per_m").get<double>() ||
          material.damping != one.at("asked_damping_ns_per_m").get<double>()) {
        throw std::invalid_argument("the record limits another material than the protocol has");
      }
      scale_down(material, one.at("share").get<double>());
    }
  } catch (const Json::exception& error) {
    throw std::invalid_argument(std::string("the record of limited materials is damaged: ") +
                                error.what());
  }
  return true;
}

std::vector<std::string> incompatibilities(const protocols::Protocol& protocol,
                                           const StimulusLibrary& library,
                                           const DeviceCapabilities& device) {
  std::vector<std::string> out;
  const auto add = [&out](const auto&... parts) {
    std::ostringstream text;
    (text << ... << parts);
    out.push_back(text.str());
  };
  for (const protocols::RendererKind kind : protocol.renderers) {
    const int needed = renderer_for(kind).side_contact() ? 5 : 3;
    if (device.sensed_freedom < needed) {
      add("renderer '", protocols::to_string(kind), "' needs a device that senses ", needed,
          " degrees of freedom; '", device.name, "' senses ", device.sensed_freedom);
    }
  }
  if (protocol.servo_rate > device.max_rate) {
    add("/servo/rate_hz is ", protocol.servo_rate, "; '", device.name, "' runs at up to ",
        device.max_rate, " Hz");
  }
  for (std::size_t i = 0; i < protocol.stimuli.size(); ++i) {
    const protocols::StimulusSpec& stimulus = protocol.stimuli[i];
    const auto check_material = [&](const stimuli::Material& material) {
      const ShowableMaterial can =
          showable(material, device, shown_rate(protocol, device), protocol.workspace.scale,
                   protocol.passivity_controller);
      if (device.actuated_freedom == 0 || can.reason.empty()) return;
      add("stimulus '", stimulus.name, "' has ", can.reason, ": soften /material, raise ",
          "/servo/rate_hz, ", passivity_advice(protocol, material, device, can),
          "or have it limited by /servo/material_limit \"limit\"");
    };
    visit_materials(stimulus.object, check_material);
    const double needed =
        glm::length(protocol.workspace.centre) +
        (library.reach(static_cast<int>(i)) + protocol.home.margin) / protocol.workspace.scale;
    constexpr double kRounding = 1e-9;  // m: sums of decimals are no whole decimals
    if (needed > device.workspace_radius + kRounding) {
      add("stimulus '", stimulus.name, "' with its home zone needs ", needed,
          " m about the centre of '", device.name, "', which reaches ", device.workspace_radius,
          " m: move /workspace/centre_m or raise /workspace/scale");
    }
  }
  return out;
}

}  // namespace palpate::runner
