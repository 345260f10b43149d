#include "runner/session/device_check.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

#include "data/base/json_text.h"
#include "data/files/utc.h"
#include "protocols/schedule.h"
#include "protocols/tasks/levels.h"
#include "runner/servo/field_demand.h"
#include "runner/session/effect_check.h"

namespace palpate::runner::session {
namespace {

constexpr double kRounding = 1e-9;  // N
constexpr double kEnough = 1e-3;    // N, by which the last force may fall short

std::string newtons(const char* before, double a, const char* between, double b) {
  char text[160];
  std::snprintf(text, sizeof text, "%s%.2f N%s%.2f N", before, a, between, b);
  return text;
}

/// Checks every commanded tick against the limits.
class CommandCheck {
 public:
  explicit CommandCheck(const ForceDirectionCheck& settings) : settings_(settings) {}

  /// \return the fault of the tick; empty: none
  std::string check(const servo::Sample& sample) {
    if (sample.faults & servo::servo_fault::kTripped) {
      const std::string why = servo::advice(sample.trouble);
      return "the forces went off" + (why.empty() ? why : ": " + why);
    }
    if (sample.phase != servo::Phase::feeling) return "";
    if (sample.tick == 0) began_ns_ = sample.time_ns;
    elapsed_ = static_cast<double>(sample.time_ns - began_ns_) * 1e-9;
    size_ = std::max(glm::length(sample.device1), glm::length(sample.device2));
    const double change =
        std::max(glm::length(sample.device1 - last1_), glm::length(sample.device2 - last2_));
    last1_ = sample.device1;
    last2_ = sample.device2;
    const servo::ForceLimits& limits = settings_.limits();
    if (size_ > limits.max_force + kRounding)
      return newtons("", size_, " were commanded, above the limit of ", limits.max_force);
    if (size_ > settings_.force() + kRounding)
      return newtons("", size_, " were commanded for a push of ", settings_.force());
    const bool gap = (sample.faults & servo::servo_fault::kSamplesLost) != 0;
    if (change > limits.max_change + kRounding && !gap)
      return newtons("the force changed by ", change, " in a tick, above the limit of ",
                     limits.max_change);
    return "";
  }
  bool over() const { return elapsed_ >= ForceDirectionCheck::kSeconds; }
  std::string verdict() const {
    if (size_ >= settings_.force() - kEnough) return "";
    return newtons("no more than ", size_, " were commanded for a push of ", settings_.force());
  }

 private:
  const ForceDirectionCheck& settings_;
  std::int64_t began_ns_ = 0;
  double elapsed_ = 0, size_ = 0;
  Vec3 last1_, last2_;
};

constexpr double kSecond = 1e9, kDay = 86400 * kSecond, kYear = 365.25 * kDay;  // ns
// 2024-01-01, earlier than this program: a computer without a battery starts with such a date.
constexpr std::int64_t kBeforeThisProgram_ns = 1'704'067'200'000'000'000;
// Clocks are corrected by a second or so; disks of other systems keep local time.
constexpr double kRecordSlack = 2 * kSecond, kFileSlack = kDay;
constexpr double kStudyRests = 2 * kYear, kProtocolRests = 5 * kYear;

std::string span(double ns) {
  const auto words = [](double value, const char* unit) {
    const auto whole = std::lround(value);
    return std::to_string(whole) + " " + unit + (whole == 1 ? "" : "s");
  };
  if (ns >= kYear) return words(ns / kYear, "year");
  if (ns >= kDay) return words(ns / kDay, "day");
  if (ns >= 3600 * kSecond) return words(ns / (3600 * kSecond), "hour");
  return ns >= 60 * kSecond ? words(ns / (60 * kSecond), "minute") : words(ns / kSecond, "second");
}

std::string day_and_minute(std::int64_t ns) {
  std::string text = data::format_utc(ns).substr(0, 16);
  text[10] = ' ';
  return text + " UTC";
}

using Json = nlohmann::ordered_json;
constexpr const char* kLimitedEvent = "material_limited";

template <class... Values>
std::string sentence(const Values&... values) {
  std::ostringstream text;
  (text << ... << values);
  return text.str();
}

/// N/m, of the surface and all layers together: a deep press feels them all.
double whole_stiffness(const stimuli::Material& material) {
  double out = material.stiffness;
  for (const stimuli::Layer& layer : material.layers) out += layer.stiffness;
  return out;
}

/// N s/m; likewise.
double whole_damping(const stimuli::Material& material) {
  double out = material.damping;
  for (const stimuli::Layer& layer : material.layers) out += layer.damping;
  return out;
}

/// Calls visit(material) for the object and the parts of a compound.
template <class Object, class Visit>
void visit_materials(Object& object, const Visit& visit) {
  visit(object.material);
  for (auto& part : object.parts) visit_materials(part, visit);
}

/// Adds the stiffest material that a stimulus can show. Its parts have one ideal tool for each
/// layer, which may rest on any part, so each layer counts as the stiffest of the parts' layers of
/// its number.
void add_felt(const stimuli::ObjectSpec& object, stimuli::Material& felt) {
  for (const stimuli::ObjectSpec& part : object.parts) add_felt(part, felt);
  if (!object.parts.empty()) return;
  const auto larger = [](double a, double b) { return std::abs(a) < std::abs(b) ? b : a; };
  const stimuli::Material& material = object.material;
  felt.stiffness = larger(felt.stiffness, material.stiffness);
  felt.damping = larger(felt.damping, material.damping);
  if (felt.layers.size() < material.layers.size()) felt.layers.resize(material.layers.size());
  for (std::size_t i = 0; i < material.layers.size(); ++i) {
    felt.layers[i].stiffness = larger(felt.layers[i].stiffness, material.layers[i].stiffness);
    felt.layers[i].damping = larger(felt.layers[i].damping, material.layers[i].damping);
  }
}

stimuli::Material felt_material(const stimuli::ObjectSpec& object) {
  stimuli::Material felt;
  felt.stiffness = 0;
  add_felt(object, felt);
  return felt;
}

void scale_down(stimuli::Material& material, double fraction) {
  material.stiffness *= fraction;
  material.damping *= fraction;
  for (stimuli::Layer& layer : material.layers) {
    layer.stiffness *= fraction;
    layer.damping *= fraction;
  }
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

/// Hz: the protocol's, or the device's highest (a protocol that asks for more is refused
/// elsewhere).
double shown_rate(const protocols::Protocol& protocol, const servo::DeviceCapabilities& device) {
  return std::min(protocol.servo_rate, device.max_rate);
}

/// How the passivity controller could help with a material that cannot be shown whole.
std::string passivity_advice(const protocols::Protocol& protocol, const stimuli::Material& material,
                             const servo::DeviceCapabilities& device,
                             const ShowableMaterial& without) {
  if (protocol.passivity_controller) return "";
  const double with =
      showable(material, device, shown_rate(protocol, device), felt_gain(protocol), true).fraction;
  if (with <= without.fraction) return "(/servo/passivity_controller would not help here) ";
  return sentence("set /servo/passivity_controller to true (",
                  with < 1 ? sentence("then up to ", whole_stiffness(material) * with, " N/m")
                           : std::string("then it can be shown"),
                  "), ");
}

/// The reason that the virtual tip cannot reach all sides of a stimulus of this radius about the
/// workspace's origin (m, device frame); empty: it can.
std::string workspace_fault(const protocols::Protocol& protocol, double radius,
                            const servo::DeviceCapabilities& device) {
  constexpr double kDecimalRounding = 1e-9;  // m: sums of decimal fractions are rounded
  const WorkspaceMap map = workspace_of(protocol);
  const double far = glm::length(protocol.workspace.centre), held = device.workspace_radius;
  if (!map.reach) {
    const double needed = far + radius;
    if (needed <= held + kDecimalRounding) return "";
    return sentence(" with its home zone needs ", needed, " m about the centre of '", device.name,
                    "', which reaches ", held,
                    " m: move /workspace/centre_m or raise /workspace/scale");
  }
  const rendering::Reach& reach = *map.reach;
  double nearest = 0, farthest = 0, distance = far;
  if (reach.in_world) {  // all places of the tip, scaled about the pivot
    const Vec3 centre = stretched(reach, {map.to_virtual(Vec3(0)), Vec3(0)}).tip / map.scale;
    distance = glm::length(centre);
    farthest = reach.factor * held;
  } else {  // the stylus may point anywhere from a grip that is anywhere in the workspace
    const double length = grip_from_virtual_tip(protocol) / map.scale;
    nearest = std::max(0.0, length - held);
    farthest = length + held;
  }
  if (distance + radius <= farthest + kRounding &&
      std::max(0.0, distance - radius) >= nearest - kRounding)
    return "";
  return sentence(" with its home zone stands from ", std::max(0.0, distance - radius), " to ",
                  distance + radius, " m from ",
                  reach.in_world ? "where the virtual tip is while the device is at its centre"
                                 : "the device's centre",
                  "; with /reach the virtual tip gets from ", nearest, " to ", farthest,
                  " m with '", device.name, "': move /workspace/centre_m or change /reach/factor");
}

/// Whether a stimulus is, or has, a mesh too large for any hand: its lengths are probably in
/// millimetres. \param radius  m, of the device
bool in_millimetres(const stimuli::ObjectSpec& object, double radius) {
  constexpr double kBeyondHands = 1;  // m
  if (object.shape == stimuli::ShapeKind::mesh) return radius > kBeyondHands;
  return std::any_of(
      object.parts.begin(), object.parts.end(),
      [radius](const stimuli::ObjectSpec& part) { return in_millimetres(part, radius); });
}

/// Makes one sentence for all levels of a stimulus that fail the same check, which may be hundreds:
/// it describes the last one and counts the others.
class StimulusFaults {
 public:
  enum class Check { material, workspace, effects };
  /// \param name  of the stimulus; at a level: "NAME at LEVEL"
  void add(const std::string& name, Check check, const std::string& fault) {
    const std::size_t at = name.rfind(" at ");
    for (Group& group : groups_) {
      if (at == std::string::npos || group.check != check || group.of != name.substr(0, at))
        continue;
      ++group.others;
      group.last = name;
      group.fault = fault;
      return;
    }
    groups_.push_back({check, at == std::string::npos ? "" : name.substr(0, at), name, fault, 0});
  }
  void append_to(std::vector<std::string>& out) const {
    for (const Group& group : groups_) {
      out.push_back("stimulus '" + group.last + "'" + group.fault);
      if (group.others > 0)
        out.back() += sentence("; likewise ", group.others, " other levels of '", group.of, "'");
    }
  }

 private:
  struct Group {
    Check check;
    std::string of, last, fault;  ///< of: ""  where it is no level
    int others;
  };
  std::vector<Group> groups_;
};

}  // namespace

ForceDirectionCheck::ForceDirectionCheck(const servo::ForceLimits& limits, int driven)
    : limits_(limits), force_(std::min(1.0, 0.5 * limits.max_force)), both_ends_(driven >= 5) {}

rendering::Rendering ForceDirectionCheck::tick(const rendering::Scene&, rendering::RenderState&,
                                               const rendering::LineProbe& probe,
                                               double) const noexcept {
  rendering::Rendering out;
  out.device1 = Vec3(force_, 0, 0);
  if (both_ends_) out.device2 = out.device1;
  out.force = out.device1 + out.device2;
  out.ideal = probe;
  return out;
}

std::string ForceDirectionCheck::push(servo::TickSource& servo,
                                      const std::function<bool()>& stop) const {
  const rendering::Scene nothing({}, false);
  constexpr servo::HomeZone kAnywhere{0, 0};
  CommandCheck check(*this);
  std::string fault;
  servo.prepare(nothing, *this, kAnywhere);
  while (fault.empty() && !check.over()) {
    fault = stop() ? "it was stopped" : check.check(servo.next());
  }
  servo.stop();
  return fault.empty() ? check.verdict() : fault;
}

std::string clock_warning(const ClockEvidence& evidence) {
  const std::int64_t now = evidence.now_ns;
  const auto doubt = [now](const std::string& why) {
    return "the computer's clock says " + day_and_minute(now) + ", " + why +
           "; every date on record follows it: if it is wrong, end here and set it (timedatectl)";
  };
  // As doubles: the difference of two dates of a damaged file may overflow an integer.
  const auto ahead = [now](std::int64_t then) {
    return static_cast<double>(now) - static_cast<double>(then);
  };
  if (const auto& record = evidence.newest_record_ns) {
    const std::string of = "the newest record of this database (" + day_and_minute(*record) + ")";
    if (ahead(*record) < -kRecordSlack) return doubt(span(-ahead(*record)) + " before " + of);
    if (ahead(*record) > kStudyRests) return doubt(span(ahead(*record)) + " after " + of);
  }
  if (now < kBeforeThisProgram_ns) return doubt("which is before this program existed");
  if (const auto& file = evidence.newest_file_ns) {
    const std::string of =
        "the protocol or the program was written last (" + day_and_minute(*file) + ")";
    if (ahead(*file) < -kFileSlack) return doubt(span(-ahead(*file)) + " before " + of);
    if (!evidence.newest_record_ns && ahead(*file) > kProtocolRests)
      return doubt(span(ahead(*file)) + " after " + of);
  }
  return "";
}

double felt_gain(const protocols::Protocol& protocol) {
  const WorkspaceMap map = workspace_of(protocol);
  const rendering::Reach reach = map.reach.value_or(rendering::Reach{});
  const double length = protocol.stylus.length * protocol.workspace.scale;  // m, virtual frame
  bool sides = false;
  for (const protocols::RendererKind kind : protocol.renderers)
    sides = sides || renderer_for(kind).side_contact();
  double lever2 = std::max(reach.factor * reach.factor, stiffness_gain(reach, 0));
  if (!sides) return map.scale * lever2;
  if (protocol.tool.segments.empty()) return map.scale * std::max(lever2, stiffness_gain(reach, 1));
  for (const protocols::ToolSegmentSpec& segment : protocol.tool.segments) {
    for (const Vec3& at : {segment.from, segment.to}) {
      // A force along the stylus that acts beside its axis also turns the stylus.
      const double aside = std::hypot(at.x, at.y) / length;
      lever2 = std::max(lever2,
                        stiffness_gain(reach, at.z / (reach.factor * length)) + 2 * aside * aside);
    }
  }
  return map.scale * lever2;
}

ShowableMaterial showable(const stimuli::Material& material,
                          const servo::DeviceCapabilities& device, double rate, double gain,
                          bool passivity_controller) {
  ShowableMaterial out;
  const double whole = whole_stiffness(material), stiffness = whole * gain;
  const double damping = std::abs(whole_damping(material)) * gain;
  const auto bound = [&out](double fraction, const auto&... reason) {
    // Rounding must not refuse a material exactly at the bound.
    if (fraction >= out.fraction || fraction >= 1 - 1e-9) return;
    out = {std::max(0.0, fraction), sentence(reason...)};
  };
  const std::string shown =
      sentence(material.layers.empty() ? "" : " with its layers",
               gain == 1 ? "" : sentence(" (", stiffness, " N/m at the hand)"));
  if (stiffness > 0) {
    const double most = device.max_stiffness * rate / device.max_rate;
    bound(most / stiffness, whole, " N/m", shown, ", and '", device.name, "' shows up to ", most,
          " N/m at ", rate, " Hz");
    if (device.friction > 0 && device.resolution > 0) {
      const double held = 2 * device.friction / device.resolution;
      bound(held / stiffness, whole, " N/m", shown, ", and the friction of '", device.name, "', ",
            device.friction, " N, holds up to ", held, " N/m against steps of ", device.resolution,
            " m");
    }
  }
  const double needed = stiffness / rate / 2 + damping;
  if (device.damping > 0 && needed > 0) {
    const double b = device.damping * (passivity_controller ? kPassivityExtension : 1);
    bound(b / needed, whole, " N/m and ", whole_damping(material), " N s/m", shown, " at ", rate,
          " Hz, which need ", needed, " N s/m of physical damping, and '", device.name, "' has ",
          device.damping, passivity_controller ? " with the passivity controller on" : "");
  }
  return out;
}

bool torque_is_left_out(const servo::DeviceCapabilities& device) {
  return device.sensed_freedom >= 5 && device.actuated_freedom == 3;
}

std::vector<LimitedMaterial> limit_materials(protocols::Protocol& protocol,
                                             const servo::DeviceCapabilities& device) {
  std::vector<LimitedMaterial> out;
  if (protocol.material_limit != protocols::MaterialLimit::limit || device.actuated_freedom == 0)
    return out;
  for (protocols::StimulusSpec& stimulus : protocol.stimuli) {
    const auto share_of = [&](const stimuli::Material& material) {
      const ShowableMaterial can = showable(material, device, shown_rate(protocol, device),
                                            felt_gain(protocol), protocol.passivity_controller);
      if (can.reason.empty() || can.fraction == 0)  // nothing to show: incompatible
        return ShowableMaterial{};
      return ShowableMaterial{can.fraction * (1 - 1e-12), can.reason};  // rounding stays below
    };
    // First limit each material that is too stiff alone; parts keep their differences where
    // possible.
    std::vector<ShowableMaterial> shares;
    stimuli::ObjectSpec limited = stimulus.object;
    visit_materials(limited, [&](stimuli::Material& material) {
      shares.push_back(share_of(material));
      if (!shares.back().reason.empty()) scale_down(material, shares.back().fraction);
    });
    const ShowableMaterial together = share_of(felt_material(limited));
    int part = -1;
    visit_materials(stimulus.object, [&](stimuli::Material& material) {
      const ShowableMaterial& alone = shares[static_cast<std::size_t>(++part)];
      if (alone.reason.empty() && together.reason.empty()) return;
      const double shown = alone.fraction * together.fraction;
      out.push_back(
          {stimulus.name, part, shown, material.stiffness, material.damping,
           sentence("stimulus '", stimulus.name, "' has ",
                    alone.reason.empty() ? "in all its parts " + together.reason : alone.reason,
                    ": limited to ", whole_stiffness(material) * shown, " N/m and ",
                    whole_damping(material) * shown, " N s/m")});
      scale_down(material, shown);
    });
  }
  return out;
}

std::string to_json_text(const std::vector<LimitedMaterial>& limited,
                         const servo::DeviceCapabilities& device, double rate) {
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
  const nlohmann::json json = json_or_discarded(event);
  if (!json.is_object() || !json.contains(kLimitedEvent)) return false;
  try {
    for (const nlohmann::json& one : json.at(kLimitedEvent)) {
      stimuli::Material& material =
          material_of(protocol, one.at("stimulus").get<std::string>(), one.at("part").get<int>());
      if (material.stiffness != one.at("asked_stiffness_n_per_m").get<double>() ||
          material.damping != one.at("asked_damping_ns_per_m").get<double>()) {
        throw std::invalid_argument("the recorded limit does not match the protocol's material");
      }
      scale_down(material, one.at("share").get<double>());
    }
  } catch (const nlohmann::json::exception& error) {
    throw std::invalid_argument(std::string("the record of limited materials is damaged: ") +
                                error.what());
  }
  return true;
}

std::vector<std::string> incompatibilities(const protocols::Protocol& protocol,
                                           const StimulusLibrary& library,
                                           const servo::DeviceCapabilities& device) {
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
    } else if (needed == 5 && torque_is_left_out(device) &&
               protocol.torque != protocols::TorqueRule::left_out) {
      add("renderer '", protocols::to_string(kind), "' gives torque, and '", device.name,
          "' drives force alone: set /torque to \"left_out\" to show the force without it, which "
          "is on record");
    }
  }
  if (protocol.reach && protocol.reach->pivot != protocols::ReachSpec::Pivot::point &&
      device.sensed_freedom < 5) {
    add("/reach about a point of the stylus needs a device that senses 5 degrees of freedom; '",
        device.name, "' senses ", device.sensed_freedom, ": give /reach/pivot a point [x, y, z]");
  }
  if (protocol.servo_rate > device.max_rate) {
    add("/servo/rate_hz is ", protocol.servo_rate, "; '", device.name, "' runs at up to ",
        device.max_rate, " Hz");
  }
  const std::vector<protocols::StimulusSpec> shown = protocols::with_all_levels(protocol).stimuli;
  StimulusFaults faults;
  for (std::size_t i = 0; i < shown.size(); ++i) {
    const protocols::StimulusSpec& stimulus = shown[i];
    bool refused = false;
    const auto check_material = [&](const stimuli::Material& material, const char* of_parts) {
      const ShowableMaterial can = showable(material, device, shown_rate(protocol, device),
                                            felt_gain(protocol), protocol.passivity_controller);
      if (device.actuated_freedom == 0 || can.reason.empty()) return;
      refused = true;
      faults.add(stimulus.name, StimulusFaults::Check::material,
                 sentence(" has ", of_parts, can.reason, ": soften /material, raise ",
                          "/servo/rate_hz, ", protocol.reach ? "lessen /reach/factor, " : "",
                          passivity_advice(protocol, material, device, can),
                          protocol.materials_vary
                              ? "or keep the levels below"
                              : "or have it limited by /servo/material_limit \"limit\""));
    };
    const bool surface = stimulus.object.shape != stimuli::ShapeKind::none;
    if (surface)
      visit_materials(stimulus.object,
                      [&](const stimuli::Material& material) { check_material(material, ""); });
    if (surface && !refused) check_material(felt_material(stimulus.object), "in all its parts ");
    const double rate = shown_rate(protocol, device);
    if (!refused && !stimulus.object.fields.empty()) {
      stimuli::Material all = felt_material(stimulus.object);
      if (!surface) all.stiffness = all.damping = 0;
      const servo::FieldDemand demand =
          servo::demand_of(stimulus.object.fields, rate, device.resolution);
      all.stiffness += demand.stiffness;
      all.damping = std::abs(all.damping) + demand.damping;
      check_material(all, "with its /fields ");
    }
    for (const std::string& fault : effect_faults(stimulus.object, rate, device))
      faults.add(stimulus.name, StimulusFaults::Check::effects, fault);
    const double radius =
        (library.reach(static_cast<int>(i)) + protocol.home.margin) / protocol.workspace.scale;
    const std::string fault = workspace_fault(protocol, radius, device);
    if (!fault.empty())
      faults.add(stimulus.name, StimulusFaults::Check::workspace,
                 fault + (in_millimetres(stimulus.object, radius)
                              ? "; or its mesh file is in millimetres and must be in metres"
                              : ""));
  }
  faults.append_to(out);
  return out;
}

}  // namespace palpate::runner::session
