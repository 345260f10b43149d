#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <iterator>

#include "protocols/parse.h"
#include "runner/commands/command.h"
#include "runner/commands/outputs.h"
#include "runner/commands/render_explain.h"
#include "runner/scene_builder.h"

namespace palpate {
namespace {

namespace po = boost::program_options;

struct TrajectoryRow {
  double t = 0;
  LineProbe probe;
};

constexpr const char* kTrajectoryHeader = "t,tip_x,tip_y,tip_z,tail_x,tail_y,tail_z";
constexpr const char* kForceHeader =
    "t,force_x,force_y,force_z,torque_x,torque_y,torque_z,ideal_tip_x,ideal_tip_y,ideal_tip_z,"
    "ideal_tail_x,ideal_tail_y,ideal_tail_z,contact_x,contact_y,contact_z,device1_x,device1_y,"
    "device1_z,"
    "device2_x,device2_y,device2_z,depth,contacts,contact_type,object";

/// The seven numbers of a line. Empty where it holds anything else.
std::optional<std::array<double, 7>> seven_numbers(const std::string& line) {
  std::array<double, 7> out{};
  const char* at = line.data();
  const char* const end = at + line.size();
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (i > 0 && (at == end || *at++ != ',')) return std::nullopt;
    const auto [next, error] = std::from_chars(at, end, out[i]);
    if (error != std::errc{}) return std::nullopt;
    at = next;
  }
  if (at != end) return std::nullopt;
  return out;
}

std::vector<TrajectoryRow> read_trajectory(const std::string& path) {
  constexpr std::size_t kFaultsShown = 20;
  std::ifstream in(path, std::ios::binary);
  if (!in) throw InputError({{path, "", "a readable file was expected"}});
  std::vector<TrajectoryRow> rows;
  std::vector<Fault> faults;
  std::string line;
  for (std::size_t number = 1; std::getline(in, line) && faults.size() < kFaultsShown; ++number) {
    const std::string place = "line " + std::to_string(number);
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (number == 1) {
      if (line.starts_with("\xEF\xBB\xBF")) line.erase(0, 3);
      if (line != kTrajectoryHeader) {
        throw InputError(
            {{path, place, std::string("the header ") + kTrajectoryHeader + " was expected"}});
      }
      continue;
    }
    if (line.empty()) continue;
    const auto values = seven_numbers(line);
    if (!values) {
      faults.push_back({path, place, "seven numbers were expected"});
    } else if (!std::isfinite((*values)[0])) {
      faults.push_back({path, place, "a finite time was expected"});
    } else if (!rows.empty() && (*values)[0] <= rows.back().t) {
      faults.push_back({path, place, "a time later than the line before was expected"});
    } else {
      const auto& v = *values;
      rows.push_back({v[0], {{v[1], v[2], v[3]}, {v[4], v[5], v[6]}}});
    }
  }
  if (faults.size() == kFaultsShown)
    faults.push_back({path, "", "and perhaps more; the first are shown"});
  if (!faults.empty()) throw InputError(std::move(faults));
  if (rows.empty()) throw InputError({{path, "", "at least one row was expected"}});
  return rows;
}

void append(std::string& out, double value) {
  char text[40];
  out.append(text, static_cast<std::size_t>(std::snprintf(text, sizeof text, "%.17g", value)));
}

void append(std::string& out, const Vec3& v) {
  for (int k = 0; k < 3; ++k) {
    out += ',';
    append(out, v[k]);
  }
}

void append_row(std::string& out, double t, const Rendering& r) {
  append(out, t);
  for (const Vec3& v :
       {r.force, r.torque, r.ideal.tip, r.ideal.tail, r.deepest.point, r.device1, r.device2}) {
    append(out, v);
  }
  out += ',';
  append(out, r.deepest.depth);
  out += ',' + std::to_string(r.contacts) + ',' + to_string(r.deepest.type) + ',' +
         std::to_string(r.object) + '\n';
}

Scene build_scene(const std::string& path, const std::vector<ObjectSpec>& objects,
                  const Renderer& renderer) {
  try {
    return SceneBuilder().build(objects, renderer.side_contact());
  } catch (const MeshError& error) {
    std::vector<std::string> faults;
    for (const std::string& fault : error.faults()) {
      faults.push_back(std::string(path).append(": ").append(fault));
    }
    throw MeshError(std::move(faults));
  }
}

/// An option's value; \throws UsageError where it was not given.
std::string given(const po::variables_map& values, const char* option, const char* because) {
  if (values.count(option) == 0)
    throw UsageError("the option '--" + std::string(option) + "' is required " + because);
  return values[option].as<std::string>();
}

void explain_scene(Outputs& outputs, const Scene& scene, const Renderer& renderer) {
  const Explanation explanation = explain_with_costs(scene, renderer);
  std::cout << to_text(explanation);
  outputs.put("json", to_json(explanation).dump(2) + "\n");
  outputs.write();
}

std::string forces_along(const Scene& scene, const Renderer& renderer,
                         const std::vector<TrajectoryRow>& rows) {
  RenderState state = scene.initial_state();
  std::string out = std::string(kForceHeader) + '\n';
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double dt = i > 0 ? rows[i].t - rows[i - 1].t : 0;
    const Rendering rendering = renderer.tick(scene, state, rows[i].probe, dt);
    append_row(out, rows[i].t, rendering);
  }
  return out;
}

}  // namespace

int render_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage =
      "palpate render --scene SCENE.json --renderer point|ray --trajectory T.csv --out O.csv\n"
      "               [--force]\n"
      "       palpate render --scene SCENE.json --renderer point|ray --explain [--json FILE]";
  line.summary =
      "Renders the forces along a recorded path, offline. A row goes out for each row that comes "
      "in. Or tells what a tick over the scene consists of, what was left out and why, and what "
      "each stage costs.";
  line.example =
      "  palpate render --scene cube.json --renderer ray --trajectory path.csv --out forces.csv\n"
      "  palpate render --scene cube.json --renderer ray --explain\n";
  line.options.add_options()                                                                  //
      ("scene", po::value<std::string>()->required()->value_name("FILE"), "scene, JSON")      //
      ("renderer", po::value<std::string>()->required()->value_name("NAME"), "point or ray")  //
      ("trajectory", po::value<std::string>()->value_name("FILE"),
       (std::string("path of the stylus, CSV with the columns ") + kTrajectoryHeader + " (s, m)")
           .c_str())                                                                              //
      ("out", po::value<std::string>()->value_name("FILE"), "forces, CSV")                        //
      ("explain", po::bool_switch(), "list the stages of a tick instead of rendering")            //
      ("json", po::value<std::string>()->value_name("FILE"), "with --explain: the same as JSON")  //
      ("force", "replace a file that is there");
  const auto values = line.parse(args);
  if (!values) return 0;
  const std::string name = (*values)["renderer"].as<std::string>();
  if (name != "point" && name != "ray") {
    throw UsageError("--renderer: point or ray was expected, not '" + name + "'");
  }
  const bool explains = (*values)["explain"].as<bool>();
  if (explains && (values->count("trajectory") > 0 || values->count("out") > 0))
    throw UsageError("--explain renders nothing: leave out --trajectory and --out");
  if (!explains && values->count("json") > 0) throw UsageError("--json goes with --explain");
  const Renderer& renderer = renderer_for(name == "ray" ? RendererKind::ray : RendererKind::point);
  const std::string scene_path = (*values)["scene"].as<std::string>();
  Outputs outputs(*values, {"out", "json"}, {"scene", "trajectory"});
  if (explains) {
    const std::vector<ObjectSpec> objects = parse_scene(scene_path);
    for (const ObjectSpec& object : objects) outputs.keep(object);
    explain_scene(outputs, build_scene(scene_path, objects, renderer), renderer);
    return 0;
  }
  const std::string trajectory = given(*values, "trajectory", "unless --explain is given");
  given(*values, "out", "unless --explain is given");
  const std::vector<ObjectSpec> objects = parse_scene(scene_path);
  for (const ObjectSpec& object : objects) outputs.keep(object);
  const std::vector<TrajectoryRow> rows = read_trajectory(trajectory);
  outputs.put("out", forces_along(build_scene(scene_path, objects, renderer), renderer, rows));
  outputs.write();
  return 0;
}

}  // namespace palpate
