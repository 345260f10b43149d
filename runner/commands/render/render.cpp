#include <iostream>

#include "data/base/text.h"
#include "protocols/parse.h"
#include "runner/commands/render/explain.h"
#include "runner/commands/render/forces.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/shared/outputs.h"
#include "runner/commands/shared/scene_notes.h"
#include "stimuli/parts/overlaps.h"

namespace palpate::runner {
namespace {

namespace po = boost::program_options;

/// An option's value; \throws UsageError where it was not given.
std::string given(const po::variables_map& values, const char* option, const char* because) {
  if (values.count(option) == 0)
    throw UsageError("the option '--" + std::string(option) + "' is required " + because);
  return values[option].as<std::string>();
}

/// Of groups of mesh files that overlap.
void add_overlaps(const stimuli::ObjectSpec& object, const std::string& pointer,
                  std::vector<std::string>& notes) {
  for (std::size_t i = 0; i < object.parts.size(); ++i)
    add_overlaps(object.parts[i], pointer + "/parts/" + std::to_string(i), notes);
  for (const std::string& overlap : stimuli::group_overlaps(object))
    notes.push_back(pointer + " (" + printable(object.file_name) + "): " + printable(overlap));
}

void explain_scene(Outputs& outputs, const rendering::Scene& scene,
                   const protocols::SceneSpec& spec, const rendering::Renderer& renderer) {
  Explanation explanation = explain_with_costs(scene, renderer);
  for (std::size_t i = 0; i < spec.objects.size(); ++i) {
    if (!spec.objects[i].soft)
      add_overlaps(spec.objects[i], "/objects/" + std::to_string(i), explanation.notes);
  }
  for (std::string& note : scene_notes(spec, scene)) explanation.notes.push_back(std::move(note));
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
  line.options.add_options()                                                                  //
      ("scene", po::value<std::string>()->required()->value_name("FILE"), "scene, JSON")      //
      ("renderer", po::value<std::string>()->required()->value_name("NAME"), "point or ray")  //
      ("trajectory", po::value<std::string>()->value_name("FILE"),
       (std::string("path of the stylus, CSV with the columns ") + kTrajectoryHeader +
        " (s, m), and for a tool's +x " + (kSideHeader + 1) + "; at most " +
        std::to_string(kMostPoses) + " rows")
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
  const rendering::Renderer& renderer = renderer_named((*values)["renderer"].as<std::string>());
  const bool explains = (*values)["explain"].as<bool>();
  if (explains &&
      (values->count("trajectory") > 0 || values->count("out") > 0 || values->count("bodies") > 0))
    throw UsageError("--explain renders nothing: leave out --trajectory, --out and --bodies");
  if (!explains && values->count("json") > 0) throw UsageError("--json goes with --explain");
  const std::string scene_path = (*values)["scene"].as<std::string>();
  Outputs outputs(*values, {"out", "bodies", "json"}, {"scene", "trajectory"});
  if (explains) {
    const protocols::SceneSpec spec = protocols::parse_scene(scene_path);
    for (const stimuli::ObjectSpec& object : spec.objects) outputs.protect(object);
    explain_scene(outputs, build_scene(scene_path, spec, renderer), spec, renderer);
    return 0;
  }
  const std::string trajectory = given(*values, "trajectory", "unless --explain is given");
  given(*values, "out", "unless --explain is given");
  const protocols::SceneSpec spec = protocols::parse_scene(scene_path);
  for (const stimuli::ObjectSpec& object : spec.objects) outputs.protect(object);
  const std::vector<TimedPose> poses = read_trajectory(trajectory);
  const rendering::Scene scene = build_scene(scene_path, spec, renderer);
  ForceTable table(scene.tool() != nullptr);
  BodyTable bodies;
  render_along(scene, spec, renderer, poses,
               [&](const TimedPose& pose, const rendering::Rendering& rendering,
                   const rendering::RenderState& state) {
                 table.add(pose, rendering);
                 if (values->count("bodies") > 0) bodies.add(pose.t, state.motion.bodies());
               });
  outputs.put("out", table.text());
  outputs.put("bodies", bodies.text());
  outputs.write();
  for (const std::string& note : scene_notes(spec, scene))
    std::cerr << printable(scene_path) << ": " << note << '\n';
  std::cerr << printable_lines(table.warnings(trajectory));
  return 0;
}

}  // namespace palpate::runner
