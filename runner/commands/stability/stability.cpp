#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

#include "analysis/figures/svg.h"
#include "runner/commands/accuracy/report.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/shared/outputs.h"
#include "runner/commands/shared/progress_line.h"
#include "runner/commands/stability/report.h"
#include "runner/stability/soft_map.h"

namespace palpate::runner::commands {
namespace {

constexpr double kRates[] = {500, 1000, 2000, 5000, 10000};  // Hz
constexpr double kEndDamping = 0.25,
                 kEndFriction = 0.025;  // N s/m, N: half of the simulated device
constexpr double kResolution = 3e-5;    // m

std::string in_khz(double rate) { return significant(rate / 1000) + " kHz"; }

BoundaryCurve curve(const char* panel, std::string name, const stability::LoopCase& loop) {
  return {panel, std::move(name), loop, {}};
}

std::vector<BoundaryCurve> theory_curves() {
  std::vector<BoundaryCurve> out;
  for (const int delay : {0, 1}) {
    for (const double rate : kRates) {
      stability::LoopCase loop;
      loop.heavy = true;
      loop.settings.rate = rate;
      loop.settings.delay = delay;
      out.push_back(curve("theory", in_khz(rate) + (delay ? ", one tick late" : ""), loop));
    }
  }
  return out;
}

std::vector<BoundaryCurve> map_curves() {
  std::vector<BoundaryCurve> out;
  for (const protocols::RendererKind renderer :
       {protocols::RendererKind::point, protocols::RendererKind::ray}) {
    for (const stability::ContactCase contact_case : stability::kContactCases) {
      stability::LoopCase loop;
      loop.contact_case = contact_case;
      loop.renderer = renderer;
      out.push_back(
          curve(renderer == protocols::RendererKind::point ? "scenes, point" : "scenes, ray",
                stability::to_string(contact_case), loop));
    }
  }
  for (const double rate : kRates) {
    stability::LoopCase loop;
    loop.settings.rate = rate;
    out.push_back(curve("rates, wall", in_khz(rate), loop));
  }
  for (const double damping : {0.0, 0.1, 1.0, 10.0}) {
    stability::LoopCase loop;
    loop.virtual_damping = damping;
    out.push_back(curve("damping of the wall", "B " + significant(damping) + " N s/m", loop));
  }
  struct Hand {
    const char* name;
    stability::EndImpedance impedance;
  };
  const Hand hands[] = {{"none", {}},
                        {"soft: 50 N/m", {50, 1, 0.02}},
                        {"relaxed: 200 N/m", {200, 5, 0.05}},
                        {"stiff: 1000 N/m", {1000, 10, 0.05}}};
  for (const Hand& hand : hands) {
    stability::LoopCase loop;
    loop.settings.hand = hand.impedance;
    out.push_back(curve("hand, wall", hand.name, loop));
  }
  stability::LoopCase layered;
  layered.layer_share = 1;
  out.push_back(curve("layers and reach, wall", "a layer as stiff as the surface", layered));
  for (const double fraction : {1.0, 0.5}) {
    stability::LoopCase far;
    far.settings.reach = rendering::Reach{.factor = 5, .fraction = fraction};
    out.push_back(curve("layers and reach, wall",
                        fraction == 1 ? "reach 5 about the tail" : "reach 5 about the middle",
                        far));
  }
  struct Device {
    const char* name;
    double friction, resolution;
    int delay;
  };
  const Device devices[] = {{"friction 0.025 N", kEndFriction, 0, 0},
                            {"and resolution 30 um", kEndFriction, kResolution, 0},
                            {"friction 0.5 N, 30 um", 0.5, kResolution, 0},
                            {"one tick late", 0, 0, 1}};
  for (const Device& device : devices) {
    stability::LoopCase loop;
    loop.settings.friction = device.friction;
    loop.settings.resolution = device.resolution;
    loop.settings.delay = device.delay;
    out.push_back(curve("device, wall", device.name, loop));
  }
  return out;
}

std::vector<ControllerGain> gain_cases() {
  std::vector<ControllerGain> out;
  const auto add = [&](const stability::LoopCase& loop) {
    out.push_back({loop, kEndDamping, 0, 0});
  };
  for (const protocols::RendererKind renderer :
       {protocols::RendererKind::point, protocols::RendererKind::ray}) {
    for (const stability::ContactCase contact_case : stability::kContactCases) {
      stability::LoopCase loop;
      loop.contact_case = contact_case;
      loop.renderer = renderer;
      add(loop);
    }
  }
  for (const double rate : kRates) {
    stability::LoopCase loop;
    loop.settings.rate = rate;
    if (rate != 1000) add(loop);
  }
  stability::LoopCase coarse;
  coarse.settings.friction = kEndFriction;
  coarse.settings.resolution = kResolution;
  add(coarse);
  stability::LoopCase late;
  late.settings.delay = 1;
  add(late);
  return out;
}

/// Stiffnesses from 10 N/m to 100 kN/m.
std::vector<double> grid(bool fine) {
  std::vector<double> out;
  const int parts = fine ? 4 : 1;
  for (int i = 0; i <= 4 * parts; ++i)
    out.push_back(std::pow(10.0, 1 + static_cast<double>(i) / parts));
  return out;
}

/// Runs all tasks on several threads.
void run_all(const std::vector<std::function<void()>>& tasks, int jobs) {
  ProgressLine progress("loops");
  std::atomic<std::size_t> next{0};
  std::vector<std::thread> threads;
  const auto work = [&](bool shows) {
    for (std::size_t i = next++; i < tasks.size(); i = next++) {
      tasks[i]();
      if (shows) progress.show(static_cast<double>(i + 1) / static_cast<double>(tasks.size()));
    }
  };
  for (int j = 1; j < jobs; ++j) threads.emplace_back(work, false);
  work(true);
  for (std::thread& thread : threads) thread.join();
}

StabilityReport study(bool full, int jobs) {
  StabilityReport report;
  report.theory = theory_curves();
  report.curves = map_curves();
  report.gains = gain_cases();
  const std::vector<double> stiffnesses = grid(full);
  std::vector<std::function<void()>> tasks;
  for (auto* curves : {&report.theory, &report.curves}) {
    for (BoundaryCurve& one : *curves) {
      one.points.resize(stiffnesses.size());
      for (std::size_t i = 0; i < stiffnesses.size(); ++i) {
        tasks.emplace_back(
            [&one, i, k = stiffnesses[i]] { one.points[i] = stability::boundary_at(one.loop, k); });
      }
    }
  }
  for (ControllerGain& gain : report.gains) {
    tasks.emplace_back(
        [&gain] { gain.without = stability::stiffest_stable(gain.loop, gain.damping); });
    tasks.emplace_back([&gain] {
      stability::LoopCase with = gain.loop;
      with.settings.passivity_controller = true;
      gain.with = stability::stiffest_stable(with, gain.damping);
    });
  }
  run_all(tasks, jobs);
  report.integrators = stability::compare_integrators(now_ns);
  return report;
}

std::vector<stability::SoftSwing> study_soft(const std::vector<stability::SoftCase>& cases,
                                             int jobs) {
  std::vector<stability::SoftSwing> map(cases.size());
  std::vector<std::function<void()>> tasks;
  for (std::size_t i = 0; i < cases.size(); ++i)
    tasks.emplace_back([&, i] { map[i] = stability::press_and_hold(cases[i]); });
  run_all(tasks, jobs);
  return map;
}

}  // namespace

int stability_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage =
      "palpate stability [--full] [--report FILE.html] [--json FILE]\n"
      "       palpate stability --soft [--seed S] [--figure FILE.svg]";
  line.summary =
      "At what stiffness does a contact become unstable (buzz)? Simulates the closed loop of\n"
      "hand, two devices and renderer against a wall, an edge, a sphere, two objects and a body\n"
      "on a wall, and compares the stability boundary with the passivity condition of theory.\n"
      "Status 1 if theory is violated. With --soft: does a tool come to rest on a soft body\n"
      "that is stepped at its own rate? Status 1 if it does not although scenes allow it.";
  line.example =
      "  palpate stability\n"
      "  palpate stability --soft\n"
      "  palpate stability --full --report stability.html --json stability.json";
  std::string json, page, figure;
  int jobs = 0;
  std::uint64_t seed = 0;
  auto add = line.options.add_options();
  namespace po = boost::program_options;
  add("full", "four stiffnesses a decade instead of one");
  add("soft", "only the map of soft bodies: moduli, springs, rates of the body (a minute)");
  add("seed", po::value(&seed)->value_name("S"),
      "with --soft: other places, depths and speeds, drawn with this seed");
  add("report", po::value(&page)->value_name("FILE"),
      "write a report with figures as an HTML page");
  add("figure", po::value(&figure)->value_name("FILE"), "write the map as SVG");
  add("json", po::value(&json)->value_name("FILE"), "write every number as JSON");
  add("jobs", po::value(&jobs)->value_name("J"), "threads; default: one for each core");
  add("force", "replace existing files");
  const auto values = line.parse(args);
  if (!values) return 0;
  if (values->count("jobs") && (jobs < 1 || jobs > 256)) {
    throw UsageError("--jobs: must be 1 to 256, not " + std::to_string(jobs));
  }
  Outputs outputs(*values, {"json", "report", "figure"}, {});
  if (jobs == 0) jobs = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  if (values->count("soft") > 0) {
    for (const char* const other : {"full", "report", "json"}) {
      if (values->count(other) > 0)
        throw UsageError(std::string("--soft: expected without --") + other);
    }
    const std::vector<stability::SoftSwing> map = study_soft(
        values->count("seed") > 0 ? stability::soft_cases_elsewhere(seed) : stability::soft_cases(),
        jobs);
    if (outputs.wanted("figure"))
      outputs.put("figure", analysis::figure_svg(soft_map_figure(map), analysis::light_palette()));
    outputs.write();
    std::cout << stability::soft_map_text(map);
    const auto is_good = [](const stability::SoftSwing& one) {
      return !one.accepted || one.settles();
    };
    return std::ranges::all_of(map, is_good) ? 0 : 1;
  }
  if (values->count("seed") > 0) throw UsageError("--seed: expected with --soft");
  const StabilityReport report = study(values->count("full") > 0, jobs);
  if (outputs.wanted("json")) outputs.put("json", stability_json(report).dump(1) + "\n");
  if (outputs.wanted("figure"))
    outputs.put("figure",
                analysis::figure_svg(stability_figure(report), analysis::light_palette()));
  if (outputs.wanted("report")) outputs.put("report", stability_page(report));
  outputs.write();
  std::cout << stability_text(report);
  return report.unsafe() == 0 && report.worst_disagreement() <= 0.05 ? 0 : 1;
}

}  // namespace palpate::runner::commands
