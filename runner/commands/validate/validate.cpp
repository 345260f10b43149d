#include <algorithm>
#include <cstddef>
#include <iomanip>
#include <iostream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <utility>

#include "data/base/text.h"
#include "data/base/words.h"
#include "protocols/fault_list.h"
#include "protocols/json_document.h"
#include "protocols/parse.h"
#include "protocols/tasks/texts.h"
#include "runner/commands/shared/command.h"
#include "runner/devices/device_delay.h"
#include "runner/devices/registry.h"
#include "runner/devices/simulated.h"
#include "runner/serve/served_scene.h"
#include "runner/servo/field_demand.h"
#include "runner/session/device_check.h"
#include "runner/session/effect_check.h"
#include "runner/session/simulated_study.h"
#include "runner/station/protocol_check.h"
#include "runner/study/schedule_text.h"
#include "runner/touch/checked_meshes.h"
#include "runner/touch/forces.h"
#include "runner/touch/scene_notes.h"
#include "stimuli/closed_surface.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/parts/convex_parts.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"

namespace palpate::runner::commands {
namespace {

/// Prints overlapping groups of a mesh file: accepted, but probably unintended if parts should
/// abut.
void print_overlaps(const stimuli::ObjectSpec& object, const std::string& name,
                    SceneBuilder& builder, std::ostream& out) {
  if (object.soft) return;  // tetrahedra do not overlap
  for (const stimuli::ObjectSpec& part : object.parts) print_overlaps(part, name, builder, out);
  if (object.shape != stimuli::ShapeKind::mesh || !builder.mesh(object).has_groups) return;
  for (const std::string& overlap : stimuli::group_overlaps(object))
    out << "  note        " << name << " (" << printable(object.file_name)
        << "): " << printable(overlap) << "\n";
}

void print_verdict(const std::string& what, const std::vector<std::string>& reasons,
                   const protocols::Protocol& protocol,
                   const std::vector<session::LimitedMaterial>& limited, std::ostream& out) {
  out << "    " << std::left << std::setw(17) << what
      << (reasons.empty() ? limited.empty() ? "yes" : "yes, with limits:" : "no:") << "\n";
  for (const station::GroupedReason& reason : station::grouped(reasons, protocol)) {
    out << "      " << printable(reason.text);
    if (reason.others > 0) out << "; likewise " << reason.others << " more";
    out << "\n";
  }
  if (!reasons.empty()) return;
  for (const session::LimitedMaterial& one : limited)
    out << "      " << printable(one.text) << "\n";
}

/// Prints whether each kind of device and simulated participants can run the protocol, or why not.
/// \param measured  delays of devices, which lower the stiffness that they can show
void print_fitness(const protocols::Protocol& protocol, const StimulusLibrary& library,
                   const std::vector<devices::ChainTiming>& measured, std::ostream& out) {
  out << "  can be shown by (run --device NAME)\n";
  for (const station::Verdict& verdict : station::device_verdicts(protocol, library, measured)) {
    print_verdict(verdict.name, verdict.reasons, protocol, verdict.limited, out);
    if (verdict.chain)
      out << "      with its delay of " << verdict.chain->counted() * 1e3
          << " ms from pose to force, measured " << printable(verdict.chain->made_utc) << "\n";
  }
  const station::Verdict simulated = station::simulation_verdict(protocol, library);
  out << "  can be tried with simulated participants\n";
  print_verdict(simulated.name, simulated.reasons, protocol, simulated.limited, out);
}

/// Whether it is a scene: those have no version. Else it is a protocol, or what should be one.
bool is_scene(const std::string& text, const std::string& path) {
  protocols::FaultList faults(path);
  const nlohmann::json root = protocols::read_json(text, faults);
  return root.is_object() && root.contains("objects") && !root.contains("version");
}

/// Adds the reasons that a device would buzz on a material of an object, with their places.
void add_buzzing(const stimuli::ObjectSpec& object, const std::string& place,
                 const protocols::Protocol& shown, const servo::DeviceCapabilities& device,
                 std::vector<std::string>& reasons) {
  for (std::size_t i = 0; i < object.parts.size(); ++i)
    add_buzzing(object.parts[i], place + "/parts/" + std::to_string(i), shown, device, reasons);
  if (!object.parts.empty()) return;
  const session::ShowableMaterial can = session::showable(object.material, device, shown.servo_rate,
                                                          session::felt_gain(shown), false);
  if (!can.reason.empty()) reasons.push_back(place + " has " + can.reason);
}

/// The same with what its texture, fields and knock ask of the device.
void add_faults(const stimuli::ObjectSpec& object, const std::string& place,
                const protocols::Protocol& shown, const servo::DeviceCapabilities& device,
                std::vector<std::string>& reasons) {
  if (object.shape != stimuli::ShapeKind::none) add_buzzing(object, place, shown, device, reasons);
  for (const std::string& fault : session::effect_faults(object, shown.servo_rate, device))
    reasons.push_back(place + fault);
  const servo::FieldDemand demand =
      servo::demand_of(object.fields, shown.servo_rate, device.resolution);
  stimuli::Material fields;
  fields.stiffness = demand.stiffness;
  fields.damping = demand.damping;
  const session::ShowableMaterial can =
      session::showable(fields, device, shown.servo_rate, session::felt_gain(shown), false);
  if (!can.reason.empty()) reasons.push_back(place + "/fields has " + can.reason);
}

/// Which devices can show the materials of a scene, through its tool and reach, or why not.
std::vector<station::Verdict> scene_verdicts(const protocols::SceneSpec& spec) {
  const protocols::Protocol shown =
      serve::protocol_of(spec, renderer_for(protocols::RendererKind::ray));
  std::vector<station::Verdict> out;
  const servo::DeviceConfig config = station::device_config(shown);
  for (const devices::DeviceKind& kind : devices::device_kinds()) {
    const servo::DeviceCapabilities can = kind.nominal(config);
    if (can.actuated_freedom == 0) continue;
    station::Verdict& verdict = out.emplace_back();
    verdict.name = kind.name;
    for (std::size_t i = 0; i < spec.objects.size(); ++i)
      add_faults(spec.objects[i], "/objects/" + std::to_string(i), shown, can, verdict.reasons);
  }
  return out;
}

std::string json_line(const nlohmann::ordered_json& json) {
  return json.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

/// \param notes  what there is to say of its objects
std::string scene_json(const std::string& path, const protocols::SceneSpec& spec,
                       const std::vector<std::string>& notes) {
  nlohmann::ordered_json out = station::faults_json(path, {});
  out["summary"] = {{"kind", "scene"}, {"objects", spec.objects.size()}};
  out["notes"] = notes;
  out["devices"] = nlohmann::ordered_json::array();
  for (const station::Verdict& verdict : scene_verdicts(spec)) {
    nlohmann::ordered_json& one = out["devices"].emplace_back();
    one = {{"name", verdict.name},
           {"can", verdict.reasons.empty()},
           {"reasons", nlohmann::ordered_json::array()}};
    for (const std::string& reason : verdict.reasons) {
      // "/objects/0 has ..."
      const std::string place = reason.substr(0, reason.find(' '));
      one["reasons"].push_back({{"text", reason}, {"where", {place}}});
    }
  }
  return json_line(out);
}

/// Checks a scene, or a mesh alone, as both renderers show it.
/// \throws protocols::InputError, stimuli::MeshError with every fault
void validate_scene(const std::string& text, const std::string& path, bool json,
                    std::ostream& out) {
  const protocols::SceneSpec spec = protocols::parse_scene_text(text, path);
  std::vector<protocols::Fault> faults;
  SceneBuilder builder;
  for (std::size_t i = 0; i < spec.objects.size(); ++i)
    touch::check_meshes(spec.objects[i], "/objects/" + std::to_string(i), path, builder, faults);
  if (!faults.empty()) throw protocols::InputError(faults);
  touch::build_scene(builder, path, spec, touch::renderer_named("point"));
  const rendering::Scene scene =
      touch::build_scene(builder, path, spec, touch::renderer_named("ray"));
  const std::vector<std::string> notes = touch::scene_notes(spec, scene, builder);
  if (json) {
    out << scene_json(path, spec, notes);
    return;
  }
  out << printable(path) << "\n  objects     " << spec.objects.size() << "\n";
  for (const std::string& note : notes) out << "  note        " << note << "\n";
  for (std::size_t i = 0; i < spec.objects.size(); ++i)
    print_overlaps(spec.objects[i], "/objects/" + std::to_string(i), builder, out);
  out << "  materials can be shown by (explore, serve --device NAME)\n";
  for (const station::Verdict& verdict : scene_verdicts(spec))
    print_verdict(verdict.name, verdict.reasons, {}, {}, out);
  out << "  touch it    palpate explore " << printable(shell_quoted(path)) << "\n";
}

/// The delays that were stored beside a calibration. \throws UsageError
std::vector<devices::ChainTiming> measured_chains(const std::string& calibration) {
  if (calibration.empty()) return {};
  std::vector<devices::ChainTiming> measured =
      devices::stored_chains(devices::chain_file(calibration));
  if (measured.empty())
    throw UsageError("--calibration: there is no " + printable(devices::chain_file(calibration)) +
                     "; make it with palpate devices --timing --device NAME --calibration FILE");
  return measured;
}

void print_protocol(const protocols::Protocol& protocol, SceneBuilder builder,
                    const std::vector<devices::ChainTiming>& measured, std::ostream& out) {
  out << study::summary_text(protocol);
  const std::vector<std::string> built_in = protocols::built_in_texts(protocol);
  if (!built_in.empty())
    out << "  texts       built in, in English; a protocol in another language gives its own: "
        << listed(built_in) << "\n";
  for (const std::string& note : touch::stimulus_notes(protocol, builder))
    out << "  mesh        " << note << "\n";
  for (const protocols::StimulusSpec& stimulus : protocol.stimuli)
    print_overlaps(stimulus.object, "stimulus " + stimulus.name, builder, out);
  const StimulusLibrary library(protocol, std::move(builder));
  for (std::size_t i = 0; i < protocol.stimuli.size(); ++i) {
    const rendering::SoftObject* const soft = library.soft(i);
    const auto felt = soft != nullptr ? touch::elements_felt(*soft) : std::nullopt;
    if (felt) out << "  note        stimulus " << protocol.stimuli[i].name << ": " << *felt << "\n";
  }
  for (const std::string& note : station::effect_notes(protocol, library))
    out << "  note        " << note << "\n";
  if (!protocol.groups.any()) print_fitness(protocol, library, measured, out);
  for (std::size_t i = 0; i < protocol.group_protocols.size(); ++i) {
    const protocols::Protocol& group = *protocol.group_protocols[i];
    out << "group " << protocol.groups.true_name(i) << "\n";
    out << study::summary_text(group);
    print_fitness(group, StimulusLibrary(group), measured, out);
  }
}

struct ValidateRequest {
  std::string file, language;
  bool texts = false, json = false;
  const std::vector<devices::ChainTiming>& measured;
};

/// \throws UsageError, protocols::InputError, stimuli::MeshError with every fault
void validate_file(const ValidateRequest& request, std::ostream& out) {
  const std::string& file = request.file;
  const std::string text = protocols::read_scene_text(file);
  if (is_scene(text, file)) {
    if (request.texts || !request.language.empty() || !request.measured.empty())
      throw UsageError(printable(file) +
                       " is no protocol: leave out --texts, --language and --calibration");
    return validate_scene(text, file, request.json, out);
  }
  protocols::Protocol protocol = protocols::parse_protocol_text(text, file);
  if (!request.language.empty()) protocols::translate(protocol, file, request.language);
  if (request.texts) {
    out << protocols::texts_json(protocol);
    return;
  }
  SceneBuilder builder;
  std::vector<protocols::Fault> faults = touch::mesh_faults(protocol, file, builder);
  std::ranges::move(station::sound_faults(protocol, file), std::back_inserter(faults));
  if (!faults.empty()) throw protocols::InputError(faults);
  if (!request.json) return print_protocol(protocol, std::move(builder), request.measured, out);
  const std::vector<std::string> notes = touch::stimulus_notes(protocol, builder);
  const StimulusLibrary library(protocol, std::move(builder));
  out << json_line(station::protocol_json(file, protocol, library, request.measured, notes));
}

}  // namespace

int validate_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage =
      "palpate validate PROTOCOL.json [--language CODE | --texts] [--calibration FILE] [--json]\n"
      "       palpate validate SCENE.json [--json]\n"
      "       palpate validate MESH.stl [--json]";
  line.summary =
      "Checks a protocol with its meshes and its schedule, and lists all faults. Lists the\n"
      "devices that can run it, whether it can be simulated, and the reasons if not.\n"
      "Or checks a scene, or a mesh file alone: its size in mm, what was cleaned, and which\n"
      "devices can show its materials without buzzing.";
  line.example = R"(  palpate validate protocols/ho2000.json
  palpate validate bunny.stl
  palpate validate protocols/roughness-magnitude.json --texts > texts.de.json   to be translated
  palpate validate protocols/roughness-magnitude.json --language de
  palpate validate protocols/ho2000.json --json   for editors and scripts)";
  std::string language, calibration;
  bool texts = false, json = false;
  line.options.add_options()  //
      ("language", boost::program_options::value(&language)->value_name("CODE"),
       "check the translation of its texts, too: NAME.texts.CODE.json or texts.CODE.json beside "
       "it")  //
      ("texts", boost::program_options::bool_switch(&texts),
       "print only the texts that a participant reads, as JSON")  //
      ("json", boost::program_options::bool_switch(&json),
       "print faults, summary, devices and duration as JSON; exit status 2 with faults")  //
      ("calibration", boost::program_options::value(&calibration)->value_name("FILE"),
       "use the delays that `palpate devices --timing --device NAME` stored beside it");
  line.positional_names = {"PROTOCOL.json"};
  const auto values = line.parse(args);
  if (!values) return 0;
  const auto file = (*values)["PROTOCOL.json"].as<std::string>();
  if (texts && json) throw UsageError("--json: --texts prints JSON of its own; leave one out");
  const std::vector<devices::ChainTiming> measured = measured_chains(calibration);
  const ValidateRequest request{file, language, texts, json, measured};
  if (!json) {
    validate_file(request, std::cout);
    return 0;
  }
  std::vector<protocols::Fault> faults;
  try {
    validate_file(request, std::cout);
    return 0;
  } catch (const protocols::InputError& error) {
    faults = error.faults();
  } catch (const stimuli::MeshError& error) {
    for (const std::string& fault : error.faults()) faults.push_back({file, "", fault});
  }
  std::cout << json_line(station::faults_json(file, faults));
  return 2;
}

}  // namespace palpate::runner::commands
