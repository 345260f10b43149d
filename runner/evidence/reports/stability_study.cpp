#include "runner/evidence/reports/stability_study.h"

#include <atomic>
#include <cmath>
#include <cstddef>
#include <string>
#include <thread>
#include <utility>

#include "runner/evidence/reports/accuracy_report.h"

namespace palpate::runner::evidence {
namespace {

constexpr double kRates[] = {500, 1000, 2000, 5000, 10000};  // Hz
constexpr double kEndDamping = 0.25,
                 kEndFriction = 0.025;  // N s/m, N: half of the simulated device
constexpr double kResolution = 3e-5;    // m

std::string in_khz(double rate) { return significant(rate / 1000) + " kHz"; }

BoundaryCurve curve(const char* panel, std::string name, const LoopCase& loop) {
  return {panel, std::move(name), loop, {}};
}

std::vector<BoundaryCurve> theory_curves() {
  std::vector<BoundaryCurve> out;
  for (const int delay : {0, 1}) {
    for (const double rate : kRates) {
      LoopCase loop;
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
    for (const ContactCase contact_case : kContactCases) {
      LoopCase loop;
      loop.contact_case = contact_case;
      loop.renderer = renderer;
      out.push_back(
          curve(renderer == protocols::RendererKind::point ? "scenes, point" : "scenes, ray",
                to_string(contact_case), loop));
    }
  }
  for (const protocols::RendererKind renderer :
       {protocols::RendererKind::point, protocols::RendererKind::ray}) {
    const bool point = renderer == protocols::RendererKind::point;
    for (const ContactCase contact_case : kConcaveCases) {
      if (point && contact_case == ContactCase::tool) continue;
      LoopCase loop;
      loop.contact_case = contact_case;
      loop.renderer = renderer;
      out.push_back(curve(point ? "concave, point" : "concave and tools, ray",
                          to_string(contact_case), loop));
    }
  }
  for (const double rate : kRates) {
    LoopCase loop;
    loop.settings.rate = rate;
    out.push_back(curve("rates, wall", in_khz(rate), loop));
  }
  for (const double damping : {0.0, 0.1, 1.0, 10.0}) {
    LoopCase loop;
    loop.virtual_damping = damping;
    out.push_back(curve("damping of the wall", "B " + significant(damping) + " N s/m", loop));
  }
  struct Hand {
    const char* name;
    EndImpedance impedance;
  };
  const Hand hands[] = {{"none", {}},
                        {"soft: 50 N/m", {50, 1, 0.02}},
                        {"relaxed: 200 N/m", {200, 5, 0.05}},
                        {"stiff: 1000 N/m", {1000, 10, 0.05}}};
  for (const Hand& hand : hands) {
    LoopCase loop;
    loop.settings.hand = hand.impedance;
    out.push_back(curve("hand, wall", hand.name, loop));
  }
  LoopCase layered;
  layered.layer_share = 1;
  out.push_back(curve("layers and reach, wall", "a layer as stiff as the surface", layered));
  for (const double fraction : {1.0, 0.5}) {
    LoopCase far;
    far.settings.reach = rendering::Reach{.factor = 5, .fraction = fraction};
    out.push_back(curve("layers and reach, wall",
                        fraction == 1 ? "reach 5 about the tail" : "reach 5 about the middle",
                        far));
  }
  // The same where several places carry.
  for (const ContactCase contact_case : {ContactCase::edge, ContactCase::groove}) {
    LoopCase with_layer;
    with_layer.contact_case = contact_case;
    with_layer.layer_share = 1;
    out.push_back(curve("layers and reach, others",
                        std::string("a layer, ") + to_string(contact_case), with_layer));
    LoopCase far;
    far.contact_case = contact_case;
    far.settings.reach = rendering::Reach{.factor = 5, .fraction = 1};
    out.push_back(
        curve("layers and reach, others", std::string("reach 5, ") + to_string(contact_case), far));
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
    LoopCase loop;
    loop.settings.friction = device.friction;
    loop.settings.resolution = device.resolution;
    loop.settings.delay = device.delay;
    out.push_back(curve("device, wall", device.name, loop));
  }
  return out;
}

std::vector<ControllerGain> gain_cases() {
  std::vector<ControllerGain> out;
  const auto add = [&](const LoopCase& loop) { out.push_back({loop, kEndDamping, 0, 0}); };
  for (const protocols::RendererKind renderer :
       {protocols::RendererKind::point, protocols::RendererKind::ray}) {
    for (const ContactCase contact_case : kContactCases) {
      LoopCase loop;
      loop.contact_case = contact_case;
      loop.renderer = renderer;
      add(loop);
    }
  }
  for (const double rate : kRates) {
    LoopCase loop;
    loop.settings.rate = rate;
    if (rate != 1000) add(loop);
  }
  LoopCase coarse;
  coarse.settings.friction = kEndFriction;
  coarse.settings.resolution = kResolution;
  add(coarse);
  LoopCase late;
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
void run_all(const std::vector<std::function<void()>>& tasks, const StudyJobs& jobs) {
  std::atomic<std::size_t> next{0};
  std::vector<std::thread> threads;
  const auto work = [&](bool shows) {
    for (std::size_t i = next++; i < tasks.size(); i = next++) {
      tasks[i]();
      if (shows) jobs.progress(static_cast<double>(i + 1) / static_cast<double>(tasks.size()));
    }
  };
  for (int j = 1; j < jobs.threads; ++j) threads.emplace_back(work, false);
  work(true);
  for (std::thread& thread : threads) thread.join();
}

}  // namespace

StabilityReport stability_study(bool full, const StudyJobs& jobs) {
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
            [&one, i, k = stiffnesses[i]] { one.points[i] = boundary_at(one.loop, k); });
      }
    }
  }
  for (ControllerGain& gain : report.gains) {
    tasks.emplace_back([&gain] { gain.without = stiffest_stable(gain.loop, gain.damping); });
    tasks.emplace_back([&gain] {
      LoopCase with = gain.loop;
      with.settings.passivity_controller = true;
      gain.with = stiffest_stable(with, gain.damping);
    });
  }
  run_all(tasks, jobs);
  report.integrators = compare_integrators(jobs.now_ns);
  return report;
}

std::vector<SoftSwing> soft_study(const std::vector<SoftCase>& cases, const StudyJobs& jobs) {
  std::vector<SoftSwing> map(cases.size());
  std::vector<std::function<void()>> tasks;
  for (std::size_t i = 0; i < cases.size(); ++i)
    tasks.emplace_back([&, i] { map[i] = press_and_hold(cases[i]); });
  run_all(tasks, jobs);
  return map;
}

}  // namespace palpate::runner::evidence
