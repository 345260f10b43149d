#include "runner/evidence/scenes/stage_costs.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <limits>
#include <map>
#include <set>
#include <sstream>
#include <utility>

#include "rendering/bodies/moving_scene.h"
#include "rendering/bodies/soft/soft_object.h"
#include "rendering/bodies/soft/soft_scene.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/parts/convex_parts.h"

namespace palpate::runner::evidence {
namespace {

/// ns for a call: the least of several runs, each long enough for the clock.
double cost_of(const StageTiming& timing) {
  constexpr int kRuns = 15;
  constexpr std::chrono::milliseconds kLong{1};
  volatile double sink = 0;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kRuns; ++i) {
    std::chrono::steady_clock::duration passed{};
    std::size_t calls = 0;
    while (passed < kLong) {
      timing.prepare();
      const auto start = std::chrono::steady_clock::now();
      sink = sink + timing.run();
      passed += std::chrono::steady_clock::now() - start;
      calls += timing.calls;
    }
    const std::chrono::duration<double, std::nano> ns = passed;
    least = std::min(least, ns.count() / static_cast<double>(calls));
  }
  return least;
}

StageCost soft_stage(const rendering::SoftObject& object) {
  const rendering::SoftBody& body = *object.body;
  const auto& mesh = body.mesh();
  char text[200];
  std::snprintf(text, sizeof text,
                "object %d: %zu nodes, %zu elements, %g steps a second; between them the surface "
                "gives by its compliance",
                object.object, mesh.nodes.size(), mesh.hexahedra.size() + mesh.tetrahedra.size(),
                1 / body.settings().step);
  return {{"soft body", StageTime::tick, true, text}, std::nullopt};
}

/// The cost of bodies beside the contact law, with all of them in motion and the probe far away.
StageCost bodies_stage(const rendering::Scene& scene, const rendering::Renderer& renderer,
                       const rendering::MovingSummary& moving) {
  constexpr int kIdleTicks = 500;
  const auto now = [] { return std::chrono::steady_clock::now(); };
  rendering::RenderState state = scene.initial_state();
  const rendering::LineProbe far{Vec3(1e3), Vec3(1e3) + Vec3(0, 0, 0.12)};
  const auto began = now();
  for (int i = 0; i < kIdleTicks; ++i) renderer.tick(scene, state, far, 1e-3);
  const std::chrono::duration<double, std::nano> took = now() - began;
  std::ostringstream text;
  text.precision(3);
  text << moving.bodies << (moving.bodies == 1 ? " object moves" : " objects move") << " ("
       << moving.lightest << " to " << moving.heaviest << " kg), " << moving.obstacles
       << " stand still; " << moving.part_pairs << " pairs of convex parts or surfaces may meet; "
       << 1e-3 * took.count() / kIdleTicks
       << " us a tick over the first half second without the probe; what rests sleeps";
  return {{"moving bodies", StageTime::tick, true, text.str()}, std::nullopt};
}

}  // namespace

std::optional<double> share_of_contact(const Explanation& e, const StageCost& cost) {
  if (!cost.ns || !e.contact_ns) return std::nullopt;
  if (cost.stage.time != StageTime::tick && cost.stage.time != StageTime::contact)
    return std::nullopt;
  return *cost.ns / *e.contact_ns;
}

Explanation explain_with_costs(const rendering::Scene& scene, const rendering::Renderer& renderer) {
  Explanation explanation;
  explanation.renderer = renderer.name();
  explanation.parts = scene.parts().size();
  std::set<int> objects;
  for (const rendering::ScenePart& part : scene.parts()) {
    objects.insert(part.object);
    explanation.facets += part.mesh->facets().size();
    explanation.edges += part.mesh->edges().size();
  }
  explanation.surfaces = scene.surfaces().size();
  for (const rendering::PlacedSurface& placed : scene.surfaces()) {
    objects.insert(placed.of_shell.begin(), placed.of_shell.end());
    explanation.facets += placed.surface->triangles().size();
    explanation.edges += placed.surface->triangles().size() / 2 * 3;
  }
  explanation.objects = objects.size();
  std::map<std::string, double> costs;
  const auto soft = rendering::soft_objects(scene);
  if (soft.empty()) {  // else the stages are a scene's within, whose parts are not the ones shown
    for (const StageTiming& timing : stage_timings(scene, renderer)) {
      if (timing.calls > 0) costs[timing.name] = cost_of(timing);
    }
  }
  const auto cost = [&](const std::string& name) -> std::optional<double> {
    const auto found = costs.find(name);
    if (found == costs.end()) return std::nullopt;
    return found->second;
  };
  explanation.contact_ns = cost(kTickInContact);
  explanation.free_ns = cost(kTickInFreeSpace);
  if (!explanation.contact_ns) {
    // Made of closed surfaces, or soft.
    const WholeTick whole = time_whole_tick(scene, renderer);
    explanation.contact_ns = whole.contact_ns;
    explanation.free_ns = whole.free_ns;
  }
  explanation.saved = features_saved(scene, renderer);
  for (TickStage& stage : explain(scene, renderer)) {
    StageCost with{std::move(stage), std::nullopt};
    if (with.stage.runs) with.ns = cost(with.stage.name);
    explanation.stages.push_back(std::move(with));
  }
  if (const auto moving = rendering::moving_summary(scene))
    explanation.stages.push_back(bodies_stage(scene, renderer, *moving));
  for (const auto& object : soft) explanation.stages.push_back(soft_stage(*object));
  explanation.rest_ns = explanation.contact_ns;
  for (const StageCost& c : explanation.stages) {
    if (share_of_contact(explanation, c)) *explanation.rest_ns -= *c.ns;
  }
  return explanation;
}

}  // namespace palpate::runner::evidence
