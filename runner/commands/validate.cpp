#include <algorithm>
#include <array>
#include <cstddef>
#include <iomanip>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>

#include "data/base/text.h"
#include "protocols/json_document.h"
#include "protocols/parse.h"
#include "protocols/schedule.h"
#include "protocols/tasks/block_order.h"
#include "protocols/tasks/texts.h"
#include "runner/commands/shared/command.h"
#include "runner/devices/device_delay.h"
#include "runner/devices/registry.h"
#include "runner/devices/simulated.h"
#include "runner/serve/served_scene.h"
#include "runner/session/device_check.h"
#include "runner/session/simulated_study.h"
#include "runner/study/task_words.h"
#include "runner/touch/forces.h"
#include "runner/touch/scene_notes.h"
#include "stimuli/closed_surface.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/parts/convex_parts.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"
#include "stimuli/solids/solid_mesh.h"

namespace palpate::runner::commands {
namespace {

constexpr double kTypicalTrial = 10;  // s; a little more than in the paper

/// Builds every mesh of an object, as a session does, and adds its faults.
void check_meshes(const stimuli::ObjectSpec& object, const std::string& pointer,
                  const std::string& file, SceneBuilder& builder,
                  std::vector<protocols::Fault>& faults) {
  if (object.shape == stimuli::ShapeKind::compound) {
    for (std::size_t i = 0; i < object.parts.size(); ++i) {
      check_meshes(object.parts[i], pointer + "/parts/" + std::to_string(i), file, builder, faults);
    }
    return;
  }
  const std::string where = object.shape == stimuli::ShapeKind::mesh ? pointer + "/file" : pointer;
  try {
    if (stimuli::is_gmsh_file_name(object.file)) {
      stimuli::solid_of_file(object);
    } else if (object.shape == stimuli::ShapeKind::mesh) {
      builder.mesh(object);
    } else {
      stimuli::convex_parts(object);
    }
  } catch (const stimuli::MeshError& error) {
    for (const std::string& fault : error.faults()) faults.push_back({file, where, fault});
  } catch (const std::runtime_error& error) {
    faults.push_back({file, where, error.what()});
  }
}

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

std::string list(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

std::string time_in_words(double seconds) {
  std::ostringstream out;
  out << std::fixed << std::setprecision(0);
  if (seconds < 60) {
    out << seconds << " s";
  } else if (seconds < 5400) {
    out << seconds / 60 << " min";
  } else {
    out << std::setprecision(1) << seconds / 3600 << " h";
  }
  return out.str();
}

/// The summary's line about masking noise, if there is any.
std::string masking(const protocols::Protocol& protocol) {
  if (!protocol.masking_noise) return "";
  std::ostringstream out;
  out << "  noise       " << protocols::to_string(protocol.masking_noise->kind) << ", "
      << protocol.masking_noise->level_db << " dB re full scale, through headphones\n";
  return out.str();
}

/// Prints the summary of a protocol of version 2.
void print_task_summary(const protocols::Protocol& protocol, std::ostream& out) {
  std::vector<std::string> renderers, stimuli;
  for (const protocols::RendererKind kind : protocol.renderers)
    renderers.emplace_back(protocols::to_string(kind));
  for (const protocols::StimulusSpec& stimulus : protocol.stimuli) stimuli.push_back(stimulus.name);
  long long trials = 0;
  out << protocol.name << (protocol.title.empty() ? "" : ": " + printable(protocol.title))
      << "\n  renderers   " << list(renderers) << "\n  stimuli     " << list(stimuli)
      << "\n  blocks      " << protocol.blocks.size() << ", in " << protocol.sessions.count
      << (protocol.sessions.count == 1 ? " session" : " sessions")
      << (protocol.blocks_counterbalanced ? ", their order counterbalanced\n" : "\n");
  for (const protocols::TaskBlock& block : protocol.blocks) {
    trials += protocols::most_trials_of(block);
    out << "    " << block.name << "\n";
    for (const std::string& line : study::in_words(protocol, block))
      out << "      " << line << "\n";
  }
  if (protocol.groups.any()) out << "  groups      " << study::groups_in_words(protocol) << "\n";
  for (const protocols::PageSpec& page : protocol.pages) {
    constexpr std::array kPlaces = {"before the first block", "before block ", "after the last"};
    out << "  page        " << page.name << ", " << kPlaces[static_cast<std::size_t>(page.when)]
        << page.before_block << "\n";
  }
  const std::vector<std::string> typed = study::keyboard_parts(protocol);
  if (!typed.empty())
    out << "  keyboard    needed beside a device's buttons for " << list(typed) << "\n";
  out << "  trials      at most " << trials << " for each participant\n"
      << masking(protocol) << "  seed        " << protocol.seed << "\n"
      << "  sha256      " << protocol.sha256 << "\n";
}

void print_summary(const protocols::Protocol& protocol, std::ostream& out) {
  if (protocol.version == 2) return print_task_summary(protocol, out);
  const std::vector<protocols::Trial> trials = protocols::schedule(protocol, 1);
  const long long counted = protocols::main_trials(protocol);
  const int sessions = protocol.sessions.count;
  std::vector<std::string> renderers, stimuli;
  for (const protocols::RendererKind kind : protocol.renderers)
    renderers.emplace_back(protocols::to_string(kind));
  for (const protocols::StimulusSpec& stimulus : protocol.stimuli) stimuli.push_back(stimulus.name);
  constexpr std::array kOrders = {"in this order", "counterbalanced", "interleaved"};
  const double rest = protocol.home.rest, time_out = protocol.blocks.front().time_out;
  const double trial = std::min(kTypicalTrial, time_out);
  const auto n = static_cast<double>(trials.size());

  out << protocol.name << (protocol.title.empty() ? "" : ": " + printable(protocol.title)) << "\n"
      << "  renderers   " << list(renderers) << " ("
      << kOrders[static_cast<std::size_t>(protocol.renderer_order)] << ")\n"
      << "  stimuli     " << list(stimuli) << "\n"
      << "  trials      " << counted << " for each participant ("
      << counted / static_cast<long long>(protocol.renderers.size()) << " with each renderer), "
      << trials.size() - static_cast<std::size_t>(counted) << " of practice and warm-up besides\n"
      << "  blocks      " << trials.back().block << ", in " << sessions
      << (sessions == 1 ? " session\n" : " sessions\n") << "  duration    about "
      << time_in_words(n * (trial + rest)) << " at " << trial << " s a trial, at most "
      << time_in_words(n * (time_out + rest)) << "; breaks"
      << (protocol.practice.criterion ? " and further rounds of practice besides\n" : " besides\n")
      << masking(protocol) << "  seed        " << protocol.seed << "\n"
      << "  sha256      " << protocol.sha256 << "\n";
}

void print_verdict(const std::string& what, const std::vector<std::string>& reasons,
                   const std::vector<session::LimitedMaterial>& limited, std::ostream& out) {
  out << "    " << std::left << std::setw(17) << what
      << (reasons.empty() ? limited.empty() ? "yes" : "yes, with limits:" : "no:") << "\n";
  for (const std::string& reason : reasons) out << "      " << printable(reason) << "\n";
  if (!reasons.empty()) return;
  for (const session::LimitedMaterial& one : limited)
    out << "      " << printable(one.text) << "\n";
}

/// What a device is told of a protocol before it is opened.
servo::DeviceConfig config_for(const protocols::Protocol& protocol) {
  servo::DeviceConfig config;
  config.rate = protocol.servo_rate;
  config.stylus_length = protocol.stylus.length;
  config.stylus_grip = protocol.stylus.grip;
  return config;
}

/// Prints whether each kind of device and simulated participants can run the protocol, or why not.
/// \param measured  delays of devices, which lower the stiffness that they can show
void print_fitness(const protocols::Protocol& protocol, const StimulusLibrary& library,
                   const std::vector<devices::ChainTiming>& measured, std::ostream& out) {
  const servo::DeviceConfig config = config_for(protocol);
  out << "  can be shown by (run --device NAME)\n";
  for (const devices::DeviceKind& kind : devices::device_kinds()) {
    servo::DeviceCapabilities can = kind.nominal(config);
    const auto chain = std::ranges::find(measured, kind.name, &devices::ChainTiming::device);
    if (chain != measured.end())
      can = devices::with_delay(can, chain->counted(), protocol.servo_rate);
    protocols::Protocol shown = protocol;
    const std::vector<session::LimitedMaterial> limited = session::limit_materials(shown, can);
    print_verdict(kind.name, session::incompatibilities(shown, library, can), limited, out);
    if (chain != measured.end())
      out << "      with its delay of " << chain->counted() * 1e3
          << " ms from pose to force, measured " << printable(chain->made_utc) << "\n";
  }
  const participants::SimulatedSettings settings = participants::load_simulated_settings("");
  const devices::SimulatedStylus stylus(settings.device, settings.hand, protocol.stylus.length,
                                        protocol.stylus.grip, 1 / protocol.servo_rate);
  protocols::Protocol shown = protocol;
  const std::vector<session::LimitedMaterial> limited =
      session::limit_materials(shown, stylus.capabilities());
  out << "  can be tried with simulated participants\n";
  print_verdict("simulate", session::simulation_faults(shown, library, settings), limited, out);
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

/// Prints which devices can show the materials of a scene, through its tool and reach, or why not.
void print_scene_fitness(const protocols::SceneSpec& spec, std::ostream& out) {
  const protocols::Protocol shown =
      serve::protocol_of(spec, renderer_for(protocols::RendererKind::ray));
  const servo::DeviceConfig config = config_for(shown);
  out << "  materials can be shown by (explore, serve --device NAME)\n";
  for (const devices::DeviceKind& kind : devices::device_kinds()) {
    const servo::DeviceCapabilities can = kind.nominal(config);
    if (can.actuated_freedom == 0) continue;
    std::vector<std::string> reasons;
    for (std::size_t i = 0; i < spec.objects.size(); ++i)
      add_buzzing(spec.objects[i], "/objects/" + std::to_string(i), shown, can, reasons);
    print_verdict(kind.name, reasons, {}, out);
  }
}

/// Checks a scene, or a mesh alone, as both renderers show it.
/// \throws protocols::InputError, stimuli::MeshError with every fault
void validate_scene(const std::string& text, const std::string& path, std::ostream& out) {
  const protocols::SceneSpec spec = protocols::parse_scene_text(text, path);
  std::vector<protocols::Fault> faults;
  SceneBuilder builder;
  for (std::size_t i = 0; i < spec.objects.size(); ++i)
    check_meshes(spec.objects[i], "/objects/" + std::to_string(i), path, builder, faults);
  if (!faults.empty()) throw protocols::InputError(faults);
  touch::build_scene(builder, path, spec, touch::renderer_named("point"));
  const rendering::Scene scene =
      touch::build_scene(builder, path, spec, touch::renderer_named("ray"));
  out << printable(path) << "\n  objects     " << spec.objects.size() << "\n";
  for (const std::string& note : touch::scene_notes(spec, scene, builder))
    out << "  note        " << note << "\n";
  for (std::size_t i = 0; i < spec.objects.size(); ++i)
    print_overlaps(spec.objects[i], "/objects/" + std::to_string(i), builder, out);
  print_scene_fitness(spec, out);
  out << "  touch it    palpate explore " << printable(shell_quoted(path)) << "\n";
}

}  // namespace

int validate_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage =
      "palpate validate PROTOCOL.json [--language CODE | --texts] [--calibration FILE]\n"
      "       palpate validate SCENE.json\n"
      "       palpate validate MESH.stl";
  line.summary =
      "Checks a protocol with its meshes and its schedule, and lists all faults. Lists the\n"
      "devices that can run it, whether it can be simulated, and the reasons if not.\n"
      "Or checks a scene, or a mesh file alone: its size in mm, what was cleaned, and which\n"
      "devices can show its materials without buzzing.";
  line.example = R"(  palpate validate protocols/ho2000.json
  palpate validate bunny.stl
  palpate validate protocols/roughness-magnitude.json --texts > texts.de.json   to be translated
  palpate validate protocols/roughness-magnitude.json --language de)";
  std::string language, calibration;
  bool texts = false;
  line.options.add_options()  //
      ("language", boost::program_options::value(&language)->value_name("CODE"),
       "check the translation of its texts, too: NAME.texts.CODE.json or texts.CODE.json beside "
       "it")  //
      ("texts", boost::program_options::bool_switch(&texts),
       "print only the texts that a participant reads, as JSON")  //
      ("calibration", boost::program_options::value(&calibration)->value_name("FILE"),
       "use the delays that `palpate devices --timing --device NAME` stored beside it");
  line.positional_names = {"PROTOCOL.json"};
  const auto values = line.parse(args);
  if (!values) return 0;
  const auto file = (*values)["PROTOCOL.json"].as<std::string>();

  const std::vector<devices::ChainTiming> measured =
      calibration.empty() ? std::vector<devices::ChainTiming>()
                          : devices::stored_chains(devices::chain_file(calibration));
  if (!calibration.empty() && measured.empty())
    throw UsageError("--calibration: there is no " + printable(devices::chain_file(calibration)) +
                     "; make it with palpate devices --timing --device NAME --calibration FILE");
  const std::string text = protocols::read_scene_text(file);
  if (is_scene(text, file)) {
    if (texts || !language.empty() || !calibration.empty())
      throw UsageError(printable(file) +
                       " is no protocol: leave out --texts, --language and --calibration");
    validate_scene(text, file, std::cout);
    return 0;
  }
  protocols::Protocol protocol = protocols::parse_protocol_text(text, file);
  if (!language.empty()) protocols::translate(protocol, file, language);
  if (texts) {
    std::cout << protocols::texts_json(protocol);
    return 0;
  }
  std::vector<protocols::Fault> faults;
  SceneBuilder builder;
  for (std::size_t i = 0; i < protocol.stimuli.size(); ++i) {
    check_meshes(protocol.stimuli[i].object, "/stimuli/" + std::to_string(i), file, builder,
                 faults);
  }
  if (!faults.empty()) throw protocols::InputError(faults);
  print_summary(protocol, std::cout);
  const std::vector<std::string> built_in = protocols::built_in_texts(protocol);
  if (!built_in.empty())
    std::cout
        << "  texts       built in, in English; a protocol in another language gives its own: "
        << list(built_in) << "\n";
  for (const protocols::StimulusSpec& stimulus : protocol.stimuli) {
    for (const std::string& note : touch::mesh_notes(stimulus.object, builder))
      std::cout << "  mesh        stimulus " << stimulus.name << ": " << note << "\n";
    print_overlaps(stimulus.object, "stimulus " + stimulus.name, builder, std::cout);
  }
  const StimulusLibrary library(protocol, std::move(builder));
  for (std::size_t i = 0; i < protocol.stimuli.size(); ++i) {
    const rendering::SoftObject* const soft = library.soft(i);
    const auto felt = soft != nullptr ? touch::elements_felt(*soft) : std::nullopt;
    if (felt)
      std::cout << "  note        stimulus " << protocol.stimuli[i].name << ": " << *felt << "\n";
  }
  if (!protocol.groups.any()) print_fitness(protocol, library, measured, std::cout);
  for (std::size_t i = 0; i < protocol.group_protocols.size(); ++i) {
    const protocols::Protocol& group = *protocol.group_protocols[i];
    std::cout << "group " << protocol.groups.names[i] << "\n";
    print_fitness(group, StimulusLibrary(group), measured, std::cout);
  }
  return 0;
}

}  // namespace palpate::runner::commands
