#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "analysis/figures/svg.h"
#include "data/base/text.h"
#include "protocols/parse.h"
#include "runner/commands/shared/command.h"
#include "runner/devices/device_delay.h"
#include "runner/devices/registry.h"
#include "runner/evidence/reports/boundary_report.h"
#include "runner/evidence/reports/stability_report.h"
#include "runner/evidence/reports/stability_study.h"
#include "runner/evidence/stability/effect_stability.h"
#include "runner/evidence/stability/soft_rest.h"
#include "runner/output/outputs.h"
#include "runner/output/progress_line.h"
#include "runner/touch/forces.h"

namespace palpate::runner::commands {
namespace {

namespace po = boost::program_options;

/// The known properties of a device: its nominal damping, and its delay where that was measured.
evidence::BuzzingDevice device_of(const po::variables_map& values) {
  const std::string name = values["device"].as<std::string>();
  const std::string calibration = text_of(values, "calibration");
  for (const devices::DeviceKind& kind : devices::device_kinds()) {
    if (name != kind.name) continue;
    const servo::DeviceCapabilities can = kind.nominal(servo::DeviceConfig());
    evidence::BuzzingDevice device{.name = name};
    device.ends.rate = servo::DeviceConfig().rate;
    // Of the whole device, which holds both ends.
    device.ends.damping = 0.5 * can.damping;
    device.ends.friction = 0.5 * can.friction;
    device.ends.resolution = can.resolution;
    if (calibration.empty()) return device;
    for (const devices::ChainTiming& chain :
         devices::stored_chains(devices::chain_file(calibration))) {
      if (chain.device != name) continue;
      device.delay = chain.counted();
      device.measured = true;
      constexpr double kMostDelay = 16;  // ticks
      device.ends.delay =
          static_cast<int>(std::min(kMostDelay, std::ceil(device.delay * device.ends.rate - 1e-9)));
    }
    if (!device.measured) {
      throw UsageError("--calibration: " + devices::chain_file(calibration) +
                       " has no delay of this device; make it with palpate devices --timing "
                       "--device NAME --calibration FILE");
    }
    return device;
  }
  throw UsageError("no device '" + printable(name) + "'; palpate devices lists them");
}

/// `palpate stability SCENE.json`.
void study_users_scene(const po::variables_map& values, output::Outputs& outputs, int jobs) {
  const std::string path = values["scene"].as<std::string>();
  const rendering::Renderer& renderer = touch::renderer_named(values["renderer"].as<std::string>());
  evidence::BoundaryReport report;
  report.scene = std::filesystem::path(path).filename().string();
  report.renderer = renderer.name();
  if (values.count("device")) report.device = device_of(values);
  const protocols::SceneSpec spec = protocols::parse_scene(path);
  for (const stimuli::ObjectSpec& object : spec.objects) outputs.protect(object);
  {
    output::ProgressLine progress("loops");
    report.boundary = evidence::scene_boundary(path, spec, renderer,
                                               report.device ? &report.device->ends : nullptr, jobs,
                                               [&progress](double done) { progress.show(done); });
  }
  outputs.put("json", evidence::boundary_json(report).dump(1) + "\n");
  if (outputs.wanted("figure")) {
    outputs.put("figure",
                analysis::figure_svg(evidence::boundary_figure(report), analysis::light_palette()));
  }
  if (outputs.wanted("report")) outputs.put("report", evidence::boundary_page(report));
  outputs.write();
  std::cout << evidence::boundary_text(report);
}

}  // namespace

int stability_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage =
      "palpate stability SCENE.json [--renderer point|ray] [--device NAME [--calibration FILE]]\n"
      "                 [--report FILE.html] [--figure FILE.svg] [--json FILE]\n"
      "       palpate stability [--full] [--report FILE.html] [--json FILE]\n"
      "       palpate stability --effects\n"
      "       palpate stability --soft [--seed S] [--figure FILE.svg]";
  line.summary =
      "At what stiffness does a contact become unstable (buzz)? Simulates the closed loop of\n"
      "hand, two devices and renderer against a wall, an edge, a sphere, two objects, a body on a\n"
      "wall, a groove, a concave edge, and with a tool, and compares the stability boundary with\n"
      "the passivity condition of theory. With a scene: the damping that each of its places of\n"
      "contact needs at 100 Hz to 10 kHz and delays of 0 to 3 ticks, and whether it buzzes on a\n"
      "device.\n"
      "Textures, fields and knocks follow; --effects gives them alone.\n"
      "Status 1 if theory is violated. With --soft: does a tool come to rest on a soft body\n"
      "that is stepped at its own rate? Status 1 if it does not although scenes allow it.";
  line.example =
      "  palpate stability\n"
      "  palpate stability SCENE.json --device simulated --report buzz.html\n"
      "  palpate stability --soft\n"
      "  palpate stability --full --report stability.html --json stability.json";
  std::string json, page, figure;
  int jobs = 0;
  std::uint64_t seed = 0;
  auto add = line.options.add_options();
  add("scene", po::value<std::string>()->value_name("FILE"),
      "scene, JSON; or a mesh file, alone: its own boundary");
  add("renderer", po::value<std::string>()->value_name("NAME")->default_value("ray"),
      "of the scene: point or ray");
  add("device", po::value<std::string>()->value_name("NAME"),
      "of the scene: whether it buzzes there, by the device's damping");
  add("calibration", po::value<std::string>()->value_name("FILE"),
      "with --device: with the delay that `palpate devices --timing` stored beside it");
  add("full", "four stiffnesses a decade instead of one");
  add("soft", "only the map of soft bodies: moduli, springs, rates of the body (a minute)");
  add("effects", "only textures, fields and knocks (some seconds)");
  add("seed", po::value(&seed)->value_name("S"),
      "with --soft: other places, depths and speeds, drawn with this seed");
  add("report", po::value(&page)->value_name("FILE"),
      "write a report with figures as an HTML page");
  add("figure", po::value(&figure)->value_name("FILE"), "write the map as SVG");
  add("json", po::value(&json)->value_name("FILE"), "write every number as JSON");
  add("jobs", po::value(&jobs)->value_name("J"), "threads; default: one for each core");
  add("force", "replace existing files");
  line.positional.add("scene", 1);
  const auto values = line.parse(args);
  if (!values) return 0;
  if (values->count("jobs") && (jobs < 1 || jobs > 256)) {
    throw UsageError("--jobs: must be 1 to 256, not " + std::to_string(jobs));
  }
  output::Outputs outputs(*values, {"json", "report", "figure"}, {"scene", "calibration"});
  if (jobs == 0) jobs = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  if (values->count("scene")) {
    for (const char* const other : {"full", "soft", "seed", "effects"}) {
      if (values->count(other) > 0)
        throw UsageError(std::string("--") + other + ": cannot be combined with a scene");
    }
    if (values->count("calibration") > 0 && values->count("device") == 0)
      throw UsageError("--calibration: requires --device");
    study_users_scene(*values, outputs, jobs);
    return 0;
  }
  for (const char* const other : {"device", "calibration"}) {
    if (values->count(other) > 0)
      throw UsageError(std::string("--") + other + ": requires a scene");
  }
  std::optional<output::ProgressLine> progress("loops");
  const evidence::StudyJobs work{jobs, [&](double share) { progress->show(share); },
                                 output::now_ns};
  if (values->count("soft") > 0) {
    for (const char* const other : {"full", "report", "json"}) {
      if (values->count(other) > 0)
        throw UsageError(std::string("--soft: expected without --") + other);
    }
    const std::vector<evidence::SoftSwing> map = evidence::soft_study(
        values->count("seed") > 0 ? evidence::soft_cases_elsewhere(seed) : evidence::soft_cases(),
        work);
    progress.reset();
    if (outputs.wanted("figure"))
      outputs.put("figure",
                  analysis::figure_svg(evidence::soft_map_figure(map), analysis::light_palette()));
    outputs.write();
    std::cout << evidence::soft_map_text(map);
    const auto is_good = [](const evidence::SoftSwing& one) {
      return !one.accepted || one.settles();
    };
    return std::ranges::all_of(map, is_good) ? 0 : 1;
  }
  if (values->count("seed") > 0) throw UsageError("--seed: expected with --soft");
  const std::vector<evidence::EffectStability> effects = evidence::effect_stability();
  const bool effects_hold =
      std::ranges::all_of(effects, [](const auto& one) { return one.holds(); });
  if (values->count("effects") > 0) {
    for (const char* const other : {"full", "report", "json", "figure"}) {
      if (values->count(other) > 0)
        throw UsageError(std::string("--effects: expected without --") + other);
    }
    progress.reset();
    std::cout << evidence::effect_stability_text(effects);
    return effects_hold ? 0 : 1;
  }
  const evidence::StabilityReport report =
      evidence::stability_study(values->count("full") > 0, work);
  progress.reset();
  if (outputs.wanted("json")) {
    auto all = evidence::stability_json(report);
    for (const evidence::EffectStability& one : effects)
      all["effects"].push_back({{"case", one.what},
                                {"measured_ns_per_m", one.measured},
                                {"theory_ns_per_m", one.theory}});
    outputs.put("json", all.dump(1) + "\n");
  }
  if (outputs.wanted("figure"))
    outputs.put("figure", analysis::figure_svg(evidence::stability_figure(report),
                                               analysis::light_palette()));
  if (outputs.wanted("report")) outputs.put("report", evidence::stability_page(report));
  outputs.write();
  std::cout << evidence::stability_text(report) << evidence::effect_stability_text(effects);
  return effects_hold && report.unsafe() == 0 && report.worst_disagreement() <= 0.05 ? 0 : 1;
}

}  // namespace palpate::runner::commands
