#include <algorithm>
#include <chrono>
#include <cstdio>
#include <iostream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "data/base/text.h"
#include "protocols/parse.h"
#include "rendering/bodies/moving_scene.h"
#include "rendering/bodies/soft/soft_scene.h"
#include "runner/commands/shared/command.h"
#include "runner/evidence/scenes/feature_costs.h"
#include "runner/evidence/verification/explain.h"
#include "runner/output/outputs.h"
#include "runner/touch/forces.h"
#include "runner/touch/scene_notes.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/parts/convex_parts.h"

namespace palpate::runner::commands {
namespace {

namespace po = boost::program_options;

// `palpate render --explain`: the stages of a tick over a scene, and their costs.

/// A stage with its cost on this machine.
struct StageCost {
  evidence::TickStage stage;
  /// ns for a call, run in isolation over recorded ticks; empty: left out, did not happen, or
  /// cannot be separated from others.
  std::optional<double> ns;
};

struct Explanation {
  std::string renderer;
  std::size_t objects = 0, parts = 0, surfaces = 0, facets = 0, edges = 0;
  std::optional<double> contact_ns, free_ns;  ///< of a whole tick
  std::optional<double> rest_ns;              ///< of contact_ns: not accounted for by the stages
  std::vector<StageCost> stages;
  std::vector<std::string> notes = {};               ///< on the scene, a sentence each
  std::vector<evidence::FeatureTime> features = {};  ///< that the scene has
  std::vector<evidence::FeatureSaved> saved = {};    ///< that it does not need
};

/// ns for a call: the least of several runs, each long enough for the clock.
double cost_of(const evidence::StageTiming& timing) {
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
  if (cost.stage.time != evidence::StageTime::tick &&
      cost.stage.time != evidence::StageTime::contact)
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
  return {{"soft body", evidence::StageTime::tick, true, text}, std::nullopt};
}

/// The cost of bodies beside the contact law, with all of them in motion and the probe far away.
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
  return {{"moving bodies", evidence::StageTime::tick, true, text.str()}, std::nullopt};
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
    for (const evidence::StageTiming& timing : evidence::stage_timings(scene, renderer)) {
      if (timing.calls > 0) costs[timing.name] = cost_of(timing);
    }
  }
  const auto cost = [&](const std::string& name) -> std::optional<double> {
    const auto found = costs.find(name);
    if (found == costs.end()) return std::nullopt;
    return found->second;
  };
  explanation.contact_ns = cost(evidence::kTickInContact);
  explanation.free_ns = cost(evidence::kTickInFreeSpace);
  if (!explanation.contact_ns) {
    // Made of closed surfaces, or soft.
    const evidence::WholeTick whole = evidence::time_whole_tick(scene, renderer);
    explanation.contact_ns = whole.contact_ns;
    explanation.free_ns = whole.free_ns;
  }
  explanation.saved = evidence::features_saved(scene, renderer);
  for (evidence::TickStage& stage : evidence::explain(scene, renderer)) {
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

/// What its features cost, and what those that it does not need would.
std::string features_text(const Explanation& e) {
  std::string out;
  const auto put = [&out](const std::string& name, const std::string& number,
                          const std::string& what) {
    std::string line = "  " + name;
    pad(line, 35 - number.size());
    out += line + number + "  " + what + '\n';
  };
  if (!e.features.empty()) out += "\nfeatures of this scene: more ns for a tick in contact\n";
  for (const evidence::FeatureTime& one : e.features)
    put(one.name, nanoseconds(one.ns), "than " + one.without);
  if (e.saved.empty()) return out;
  out += "\nleft out, because this scene does not need it: instructions saved a tick\n";
  for (const evidence::FeatureSaved& one : e.saved) {
    char number[32];
    std::snprintf(number, sizeof number, "%.0f", one.instructions);
    put(one.name, number, "");
    out.erase(out.find_last_not_of(" \n") + 1);
    out += '\n';
  }
  return out + "  " + evidence::kCostsMeasured + '\n';
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
    line += c.stage.runs ? evidence::to_string(c.stage.time) : "left out";
    const std::string ns = nanoseconds(c.ns), part = percent(share_of_contact(e, c));
    pad(line, 49 - ns.size());
    line += ns;
    pad(line, 56 - part.size());
    line += part;
    pad(line, 58);
    out += line + c.stage.why + '\n';
  }
  out += features_text(e);
  for (const std::string& note : e.notes) out += "\nNote: " + note + ".";
  if (!e.notes.empty()) out += '\n';
  if (e.rest_ns && e.features.empty()) {
    out += "\nThe rest of a tick in contact: " + nanoseconds(e.rest_ns) +
           " ns: writing results, prefetching, tracking other parts.";
  }
  out +=
      "\nEach stage was timed in isolation, over a hand that strokes the first part (0.1 m/s, 1 to "
      "2\n"
      "mm deep); in a tick they overlap, so shares of the tick in contact need not add up to 100 "
      "%.\n"
      "-: does not run, did not happen, or cannot be separated.\n";
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
                      {"when", evidence::to_string(c.stage.time)},
                      {"runs", c.stage.runs},
                      {"why", c.stage.why},
                      {"ns", figure(c.ns)},
                      {"share_of_contact", figure(share_of_contact(e, c))}});
  }
  Json features = Json::array(), saved = Json::array();
  for (const evidence::FeatureTime& one : e.features)
    features.push_back({{"feature", one.name}, {"than", one.without}, {"more_ns", figure(one.ns)}});
  for (const evidence::FeatureSaved& one : e.saved)
    saved.push_back({{"feature", one.name}, {"instructions", one.instructions}});
  return {{"program_version", PALPATE_VERSION},
          {"build", PALPATE_BUILD},
          {"renderer", e.renderer},
          {"objects", e.objects},
          {"parts", e.parts},
          {"surfaces", e.surfaces},
          {"facets", e.facets},
          {"edges", e.edges},
          {"contact_ns", figure(e.contact_ns)},
          {"free_ns", figure(e.free_ns)},
          {"rest_of_contact_ns", figure(e.rest_ns)},
          {"stages", std::move(stages)},
          {"features", std::move(features)},
          {"left_out", std::move(saved)},
          {"left_out_measured", evidence::kCostsMeasured},
          {"notes", e.notes}};
}

/// An option's value; \throws UsageError if it was not given.
std::string given(const po::variables_map& values, const char* option, const char* because) {
  if (values.count(option) == 0)
    throw UsageError("the option '--" + std::string(option) + "' is required " + because);
  return values[option].as<std::string>();
}

/// Of groups of mesh files that overlap.
void add_overlaps(const stimuli::ObjectSpec& object, const std::string& pointer,
                  SceneBuilder& builder, std::vector<std::string>& notes) {
  for (std::size_t i = 0; i < object.parts.size(); ++i)
    add_overlaps(object.parts[i], pointer + "/parts/" + std::to_string(i), builder, notes);
  if (object.shape != stimuli::ShapeKind::mesh || !builder.mesh(object).has_groups) return;
  for (const std::string& overlap : stimuli::group_overlaps(object))
    notes.push_back(pointer + " (" + printable(object.file_name) + "): " + printable(overlap));
}

void explain_scene(output::Outputs& outputs, const std::string& path,
                   const protocols::SceneSpec& spec, const rendering::Renderer& renderer) {
  SceneBuilder builder;
  const rendering::Scene scene = touch::build_scene(builder, path, spec, renderer);
  Explanation explanation = explain_with_costs(scene, renderer);
  explanation.features = evidence::feature_times(path, spec, renderer);
  for (std::size_t i = 0; i < spec.objects.size(); ++i) {
    if (!spec.objects[i].soft)
      add_overlaps(spec.objects[i], "/objects/" + std::to_string(i), builder, explanation.notes);
  }
  for (std::string& note : touch::scene_notes(spec, scene, builder))
    explanation.notes.push_back(std::move(note));
  std::cout << to_text(explanation);
  outputs.put("json", to_json(explanation).dump(2) + "\n");
  outputs.write();
}

}  // namespace

int render_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage =
      "palpate render --scene SCENE.json --renderer point|ray --trajectory T.csv --out O.csv\n"
      "               [--bodies B.csv] [--force]\n"
      "       palpate render --scene SCENE.json --renderer point|ray --explain [--json FILE]";
  line.summary =
      "Renders the forces along a recorded path, offline: one row out for each row in, with the\n"
      "faults of its tick in the column 'faults'; --bodies writes where moving objects are. Or,\n"
      "with --explain, lists the stages of a tick over the scene, which are left out and why,\n"
      "and what each costs.";
  line.example =
      "  palpate render --scene cube.json --renderer ray --trajectory path.csv --out forces.csv\n"
      "  palpate render --scene cube.json --renderer ray --explain\n";
  line.options.add_options()  //
      ("scene", po::value<std::string>()->required()->value_name("FILE"),
       "scene, JSON; or a mesh file, alone")                                                  //
      ("renderer", po::value<std::string>()->required()->value_name("NAME"), "point or ray")  //
      ("trajectory", po::value<std::string>()->value_name("FILE"),
       (std::string("path of the stylus, CSV with the columns ") + touch::kTrajectoryHeader +
        " (s, m), and for a tool's +x " + (touch::kSideHeader + 1) + "; at most " +
        std::to_string(touch::kMostPoses) + " rows")
           .c_str())                                                        //
      ("out", po::value<std::string>()->value_name("FILE"), "forces, CSV")  //
      ("bodies", po::value<std::string>()->value_name("FILE"),
       "moving objects, CSV: a row for each row in and each of them, with place, orientation, "
       "velocity and spin (centre of mass, world)")                                               //
      ("explain", po::bool_switch(), "list the stages of a tick instead of rendering")            //
      ("json", po::value<std::string>()->value_name("FILE"), "with --explain: the same as JSON")  //
      ("force", "replace an existing file");
  const auto values = line.parse(args);
  if (!values) return 0;
  const rendering::Renderer& renderer =
      touch::renderer_named((*values)["renderer"].as<std::string>());
  const bool explains = (*values)["explain"].as<bool>();
  if (explains &&
      (values->count("trajectory") > 0 || values->count("out") > 0 || values->count("bodies") > 0))
    throw UsageError("--explain renders nothing: leave out --trajectory, --out and --bodies");
  if (!explains && values->count("json") > 0) throw UsageError("--json goes with --explain");
  const std::string scene_path = (*values)["scene"].as<std::string>();
  output::Outputs outputs(*values, {"out", "bodies", "json"}, {"scene", "trajectory"});
  if (explains) {
    const protocols::SceneSpec spec = protocols::parse_scene(scene_path);
    for (const stimuli::ObjectSpec& object : spec.objects) outputs.protect(object);
    explain_scene(outputs, scene_path, spec, renderer);
    return 0;
  }
  const std::string trajectory = given(*values, "trajectory", "unless --explain is given");
  given(*values, "out", "unless --explain is given");
  const protocols::SceneSpec spec = protocols::parse_scene(scene_path);
  for (const stimuli::ObjectSpec& object : spec.objects) outputs.protect(object);
  const std::vector<touch::TimedPose> poses = touch::read_trajectory(trajectory);
  SceneBuilder builder;
  const rendering::Scene scene = touch::build_scene(builder, scene_path, spec, renderer);
  touch::ForceTable table(scene.tool() != nullptr);
  touch::BodyTable bodies;
  touch::render_along(scene, spec, renderer, poses,
                      [&](const touch::TimedPose& pose, const rendering::Rendering& rendering,
                          const rendering::RenderState& state) {
                        table.add(pose, rendering);
                        if (values->count("bodies") > 0) bodies.add(pose.t, state.motion.bodies());
                      });
  outputs.put("out", table.text());
  outputs.put("bodies", bodies.text());
  outputs.write();
  for (const std::string& note : touch::scene_notes(spec, scene, builder))
    std::cerr << printable(scene_path) << ": " << note << '\n';
  std::cerr << printable_lines(table.warnings(trajectory));
  return 0;
}

}  // namespace palpate::runner::commands
