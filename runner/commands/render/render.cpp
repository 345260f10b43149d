#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "data/base/text.h"
#include "protocols/parse.h"
#include "runner/commands/shared/command.h"
#include "runner/evidence/scenes/feature_costs.h"
#include "runner/evidence/scenes/stage_costs.h"
#include "runner/evidence/verification/explain.h"
#include "runner/output/outputs.h"
#include "runner/touch/forces.h"
#include "runner/touch/scene_notes.h"
#include "stimuli/parts/convex_parts.h"

namespace palpate::runner::commands {
namespace {

namespace po = boost::program_options;

using evidence::Explanation;
using evidence::StageCost;
using Json = nlohmann::ordered_json;

std::string nanoseconds(const std::optional<double>& ns) {
  if (!ns) return "-";
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", *ns);
  return text;
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

/// The cost of each feature of the scene, and the cost that absent features save.
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
    const std::string ns = nanoseconds(c.ns), part = percent(evidence::share_of_contact(e, c));
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
  Explanation explanation = evidence::explain_with_costs(scene, renderer);
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
  if (!explains && values->count("json") > 0) throw UsageError("--json requires --explain");
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
