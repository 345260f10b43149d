#include "runner/commands/render/explain.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <limits>
#include <map>
#include <set>
#include <sstream>

#include "rendering/bodies/moving_scene.h"
#include "rendering/bodies/soft/soft_scene.h"

namespace palpate::runner {
namespace {

/// ns for a call: the least of several runs, each long enough for the clock.
double cost_of(const rendering::StageTiming& timing) {
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

std::string nanoseconds(const std::optional<double>& ns) {
  if (!ns) return "-";
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", *ns);
  return text;
}

/// Fraction of the whole tick in contact, where the stage is part of it.
std::optional<double> share_of_contact(const Explanation& e, const StageCost& cost) {
  if (!cost.ns || !e.contact_ns) return std::nullopt;
  if (cost.stage.time != rendering::StageTime::tick &&
      cost.stage.time != rendering::StageTime::contact)
    return std::nullopt;
  return *cost.ns / *e.contact_ns;
}

std::string percent(const std::optional<double>& value) {
  if (!value) return "-";
  char text[32];
  std::snprintf(text, sizeof text, "%.0f %%", 100 * *value);
  return text;
}

void pad(std::string& line, std::size_t column) {
  line.append(line.size() < column ? column - line.size() : 1, ' ');
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
  return {{"soft body", rendering::StageTime::tick, true, text}, std::nullopt};
}

/// What bodies do beside the contact law, with all of them in motion and the probe far away.
StageCost bodies_stage(const rendering::Scene& scene, const rendering::Renderer& renderer,
                       const rendering::MovingSummary& moving) {
  constexpr int kTicks = 500;
  const auto now = [] { return std::chrono::steady_clock::now(); };
  rendering::RenderState state = scene.initial_state();
  const rendering::LineProbe far{Vec3(1e3), Vec3(1e3) + Vec3(0, 0, 0.12)};
  const auto began = now();
  for (int i = 0; i < kTicks; ++i) renderer.tick(scene, state, far, 1e-3);
  const std::chrono::duration<double, std::nano> took = now() - began;
  std::ostringstream text;
  text.precision(3);
  text << moving.bodies << (moving.bodies == 1 ? " object moves" : " objects move") << " ("
       << moving.lightest << " to " << moving.heaviest << " kg), " << moving.obstacles
       << " stand still; " << moving.part_pairs << " pairs of convex parts may meet; "
       << 1e-3 * took.count() / kTicks
       << " us a tick over the first half second without the probe; what rests sleeps";
  return {{"moving bodies", rendering::StageTime::tick, true, text.str()}, std::nullopt};
}

}  // namespace

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
    objects.insert(placed.object);
    explanation.facets += placed.surface->triangles().size();
    explanation.edges += placed.surface->triangles().size() / 2 * 3;
  }
  explanation.objects = objects.size();
  std::map<std::string, double> costs;
  const auto soft = rendering::soft_objects(scene);
  if (soft.empty()) {  // else the stages are a scene's within, whose parts are not the ones shown
    for (const rendering::StageTiming& timing : rendering::stage_timings(scene, renderer)) {
      if (timing.calls > 0) costs[timing.name] = cost_of(timing);
    }
  }
  const auto cost = [&](const std::string& name) -> std::optional<double> {
    const auto found = costs.find(name);
    if (found == costs.end()) return std::nullopt;
    return found->second;
  };
  explanation.contact_ns = cost(rendering::kTickInContact);
  explanation.free_ns = cost(rendering::kTickInFreeSpace);
  for (rendering::TickStage& stage : rendering::explain(scene, renderer)) {
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

std::string to_text(const Explanation& e) {
  std::string out = e.renderer + " renderer; objects: " + std::to_string(e.objects) +
                    ", convex parts: " + std::to_string(e.parts) +
                    (e.surfaces > 0 ? ", closed surfaces: " + std::to_string(e.surfaces) : "") +
                    ", facets: " + std::to_string(e.facets) +
                    ", edges: " + std::to_string(e.edges) + "\n";
  out += "a tick, ns: " + nanoseconds(e.contact_ns) + " in contact, " + nanoseconds(e.free_ns) +
         " in free space\n\n";
  std::string head = "stage";
  pad(head, 25);
  head += "when";
  pad(head, 43);
  head += "    ns  share";
  out += head + "  what, or why not\n";
  for (const StageCost& c : e.stages) {
    std::string line = c.stage.name;
    pad(line, 25);
    line += c.stage.runs ? rendering::to_string(c.stage.time) : "left out";
    const std::string ns = nanoseconds(c.ns), part = percent(share_of_contact(e, c));
    pad(line, 49 - ns.size());
    line += ns;
    pad(line, 56 - part.size());
    line += part;
    pad(line, 58);
    out += line + c.stage.why + '\n';
  }
  for (const std::string& note : e.notes) out += "\nNote: " + note + ".";
  if (!e.notes.empty()) out += '\n';
  if (e.rest_ns) {
    out += "\nThe rest of a tick in contact: " + nanoseconds(e.rest_ns) +
           " ns: writing results, prefetching, tracking other parts.";
  }
  out +=
      "\nEach stage was timed in isolation, over a hand that strokes the first part (0.1 m/s, 1 to "
      "2\n"
      "mm deep); in a tick they overlap, so shares of the tick in contact need not add up to 100 "
      "%.\n"
      "-: does not run, did not happen, or cannot be told apart.\n";
  return out;
}

nlohmann::ordered_json to_json(const Explanation& e) {
  using Json = nlohmann::ordered_json;
  const auto figure = [](const std::optional<double>& value) {
    return value ? Json(*value) : Json(nullptr);
  };
  Json stages = Json::array();
  for (const StageCost& c : e.stages) {
    stages.push_back({{"stage", c.stage.name},
                      {"when", rendering::to_string(c.stage.time)},
                      {"runs", c.stage.runs},
                      {"why", c.stage.why},
                      {"ns", figure(c.ns)},
                      {"share_of_contact", figure(share_of_contact(e, c))}});
  }
  return {{"program_version", PALPATE_VERSION},
          {"build", PALPATE_BUILD},
          {"renderer", e.renderer},
          {"objects", e.objects},
          {"parts", e.parts},
          {"facets", e.facets},
          {"edges", e.edges},
          {"contact_ns", figure(e.contact_ns)},
          {"free_ns", figure(e.free_ns)},
          {"rest_of_contact_ns", figure(e.rest_ns)},
          {"stages", std::move(stages)},
          {"notes", e.notes}};
}

}  // namespace palpate::runner
