#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <glm/geometric.hpp>
#include <iostream>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "analysis/figures/svg.h"
#include "protocols/parse.h"
#include "rendering/first_contact.h"
#include "rendering/renderer.h"
#include "runner/commands/shared/command.h"
#include "runner/evidence/reports/accuracy_report.h"
#include "runner/evidence/reports/scene_report.h"
#include "runner/evidence/scenes/scene_study.h"
#include "runner/output/outputs.h"
#include "runner/output/progress_line.h"
#include "runner/touch/forces.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"

namespace palpate::runner::commands {
namespace {

namespace po = boost::program_options;

void study_first_contacts(evidence::AccuracyReport& report, int entries) {
  struct Shape {
    const char* name;
    stimuli::PolygonSoup soup;
  };
  const Shape shapes[] = {{"sphere of 1,280 triangles", stimuli::icosphere(0.03, 3)},
                          {"cone of 64 segments", stimuli::cone(0.03, 0.06, 64)},
                          {"cylinder of 64 segments", stimuli::cylinder(0.03, 0.06, 64)},
                          {"cube", stimuli::cube(0.06)},
                          {"plate of 60 x 60 x 1 mm", [] {
                             stimuli::PolygonSoup plate = stimuli::cube(0.06);
                             for (Vec3& v : plate.vertices) v.z /= 60;
                             return plate;
                           }()}};
  output::ProgressLine progress("first contacts");
  constexpr double kSpeeds[] = {0.1, 0.5, 1, 5};
  const double steps = static_cast<double>(std::size(shapes) * std::size(kSpeeds));
  double done = 0;
  for (const Shape& shape : shapes) {
    const stimuli::ConvexMesh mesh(shape.soup);
    evidence::FirstContactStudy study{shape.name, {}};
    for (const double speed : kSpeeds) {
      progress.show(done / steps);
      study.speeds.push_back(evidence::first_contact_loss(mesh, speed, 2, entries, 1));
      done += 1;
    }
    report.first_contacts.push_back(std::move(study));
  }
}

/// Cost of one test where neither has a tree: 6 facets and 12 edges, a motion that stays off.
void time_first_contact(evidence::AccuracyReport& report) {
  const stimuli::ConvexMesh mesh(stimuli::cube(0.06));
  const rendering::ContactTrees trees(mesh, true);
  const auto pose = [](int i) {
    const double height = 0.031 + 1e-5 * (i % 7);
    return rendering::LineProbe{Vec3(-0.02, 0.01, height), Vec3(0.1, 0.02, height + 0.01)};
  };
  constexpr int kTests = 20000;
  int found = 0;
  const auto time = [&](const std::function<bool(const rendering::LineProbe&,
                                                 const rendering::LineProbe&)>& test) {
    double fastest = HUGE_VAL;
    for (int round = 0; round < 5; ++round) {
      const double start = output::now_ns();
      for (int i = 0; i < kTests; ++i) found += test(pose(i), pose(i + 1)) ? 1 : 0;
      fastest = std::min(fastest, (output::now_ns() - start) / kTests);
    }
    return fastest;
  };
  report.paper_test_ns =
      time([&](const rendering::LineProbe& before, const rendering::LineProbe& after) {
        return evidence::paper_first_contact(mesh, before, after);
      });
  report.exact_test_ns =
      time([&](const rendering::LineProbe& before, const rendering::LineProbe& after) {
        return rendering::first_contact_segment(mesh, trees, before, after, 1e-12 * mesh.size())
                   .feature.kind != rendering::ContactFeature::Kind::none;
      });
  if (found > 0) throw std::runtime_error("a motion off the cube was taken for a contact");
}

/// Scenes of every kind, with the times of each method.
void study_every_scene(evidence::AccuracyReport& report, bool quick) {
  output::ProgressLine progress("scenes");
  evidence::SceneStudySettings settings;
  if (quick) {
    settings.ticks = std::min(500, 10 * report.settings.contact_ticks);
    settings.rounds = 1;
    settings.cold = 50;
  }
  std::vector<evidence::StudiedScene> scenes = evidence::study_scenes();
  const auto count = static_cast<double>(scenes.size());
  double done = 0;
  for (evidence::StudiedScene& scene : scenes) {
    report.scenes.push_back(evidence::study_scene(
        std::move(scene), settings, [&](double part) { progress.show((done + part) / count); }));
    done += 1;
  }
}

/// \param quick  skips the case whose mesh takes seconds to build
void run_extreme_cases(evidence::AccuracyReport& report, bool quick) {
  output::ProgressLine progress("extreme cases");
  const std::span<const evidence::ExtremeCase> cases = evidence::extreme_cases();
  double done = 0;
  for (const evidence::ExtremeCase& one : cases) {
    progress.show(done++ / static_cast<double>(cases.size()));
    if (quick && std::string_view(one.name) == "million-triangles") continue;
    for (const rendering::Renderer* renderer :
         {&rendering::ray_renderer(), &rendering::point_renderer()}) {
      report.extremes.push_back(
          {one.name, one.title, one.measure, renderer->name(), one.run(*renderer)});
    }
  }
}

/// \param search  called with (seed, first walk, walks)
template <class Counts>
Counts in_threads(Counts (*search)(std::uint64_t, std::uint64_t, std::uint64_t),
                  std::uint64_t ticks, std::uint64_t seed, int jobs) {
  const std::uint64_t walks = (ticks + evidence::kTicksPerWalk - 1) / evidence::kTicksPerWalk;
  constexpr std::uint64_t kBatch = 20;  // walks a thread takes at a time
  Counts all;
  output::ProgressLine progress("search");
  for (std::uint64_t first = 0; first < walks;) {
    progress.show(static_cast<double>(first) / static_cast<double>(walks));
    std::vector<Counts> parts(static_cast<std::size_t>(jobs));
    std::vector<std::thread> threads;
    for (Counts& part : parts) {
      const std::uint64_t count = std::min(kBatch, walks - first);
      threads.emplace_back(
          [&part, search, seed, first, count] { part = search(seed, first, count); });
      first += count;
      if (first == walks) break;
    }
    for (std::thread& thread : threads) thread.join();
    for (const Counts& part : parts) all += part;
  }
  return all;
}

// The measurements of `palpate accuracy`. Shows progress on a terminal.
evidence::SearchCounts search_in_threads(std::uint64_t ticks, std::uint64_t seed, int jobs) {
  return in_threads(evidence::search_walks, ticks, seed, jobs);
}

/// The same search over unions of convex parts and tools.
evidence::UnionCounts search_unions_in_threads(std::uint64_t ticks, std::uint64_t seed, int jobs) {
  return in_threads(evidence::search_unions, ticks, seed, jobs);
}

/// Fills in the whole report, by report.settings: errors and run times, first contacts, unions,
/// extreme cases, short searches.
/// \param quick  skips the extreme case whose mesh takes seconds to build
/// \param seed   of the searches
void measure_accuracy(evidence::AccuracyReport& report, bool quick, int jobs, std::uint64_t seed) {
  {
    output::ProgressLine progress("errors and times");
    report.rows = evidence::accuracy_study(report.settings, output::now_ns,
                                           [&](double done) { progress.show(done); });
  }
  // In proportion to the other studies: 2000 of each by default.
  study_first_contacts(report,
                       std::max(10, report.settings.paths * report.settings.contact_ticks / 2));
  time_first_contact(report);
  {
    output::ProgressLine progress("unions");
    if (quick) report.union_settings = {2, 500, 1};
    report.unions = evidence::union_study(report.union_settings, output::now_ns,
                                          [&](double done) { progress.show(done); });
  }
  {
    output::ProgressLine progress("bodies");
    report.bodies =
        evidence::body_study(quick, output::now_ns, [&](double done) { progress.show(done); });
    report.body_tick = evidence::body_tick_cost(quick, output::now_ns);
  }
  {
    output::ProgressLine progress("soft bodies");
    report.soft = evidence::soft_study(quick, output::now_ns,
                                       [&progress](double done) { progress.show(done); });
  }
  study_every_scene(report, quick);
  run_extreme_cases(report, quick);
  constexpr std::uint64_t kShortSearch = 100'000;
  report.search_seed = seed;
  report.search = search_in_threads(kShortSearch, seed, jobs);
  report.union_search = search_unions_in_threads(kShortSearch, seed, jobs);
}

evidence::AccuracySettings quick_settings() {
  evidence::AccuracySettings quick;
  quick.paths = 2;
  quick.contact_ticks = 500;
  quick.most_triangles = 20480;
  quick.visits = 1e7;
  return quick;
}

void check_range(const char* option, int value, int low, int high) {
  if (value >= low && value <= high) return;
  throw UsageError(std::string("--") + option + ": must be " + std::to_string(low) + " to " +
                   std::to_string(high) + ", not " + std::to_string(value));
}

/// The path of a scene's study. \throws InputError: a pose that no hand has
std::vector<touch::TimedPose> compared_path(const std::string& path) {
  constexpr double kFarthest = 1e6;  // m; the renderers take no pose beyond it (rendering/tick.h)
  std::vector<touch::TimedPose> poses = touch::read_trajectory(path);
  for (const touch::TimedPose& pose : poses) {
    for (const Vec3& end : {pose.probe.tip, pose.probe.tail}) {
      if (glm::length(end) <= kFarthest) continue;  // not so for NaN
      throw protocols::InputError({{path, "line " + std::to_string(pose.line),
                                    "expected tip and tail within 1e6 m: methods are compared on "
                                    "poses that a hand can have"}});
    }
  }
  return poses;
}

/// `palpate accuracy SCENE.json`.
void study_users_scene(const po::variables_map& values, output::Outputs& outputs) {
  const std::string path = values["scene"].as<std::string>();
  evidence::StudiedScene scene;
  scene.name = std::filesystem::path(path).filename().string();
  scene.spec = protocols::parse_scene(path);
  const auto surfaceless =
      std::ranges::find(scene.spec.objects, stimuli::ShapeKind::none, &stimuli::ObjectSpec::shape);
  if (surfaceless != scene.spec.objects.end())
    throw UsageError(path + ": /objects/" +
                     std::to_string(surfaceless - scene.spec.objects.begin()) +
                     "/shape: expected an object with a surface: the methods differ in contacts, "
                     "not in fields");
  for (const stimuli::ObjectSpec& object : scene.spec.objects) outputs.protect(object);
  if (values.count("trajectory"))
    scene.paths = {compared_path(values["trajectory"].as<std::string>())};
  evidence::SceneStudySettings settings;
  const std::string renderer = values["renderer"].as<std::string>();
  settings.ray = &touch::renderer_named(renderer) == &rendering::ray_renderer();
  settings.seed = values["seed"].as<std::uint64_t>();
  if (values.count("ticks")) settings.ticks = values["ticks"].as<int>();
  if (values.count("quick")) {
    settings.rounds = 1;
    settings.cold = 100;
  }
  output::ProgressLine progress("methods");
  const evidence::SceneStudy study = evidence::study_scene(
      std::move(scene), settings, [&progress](double done) { progress.show(done); });
  outputs.put("json", evidence::scene_json(study).dump(1) + "\n");
  if (outputs.wanted("figure")) {
    outputs.put("figure",
                analysis::figure_svg(evidence::scene_figure({study}), analysis::light_palette()));
  }
  if (outputs.wanted("report")) outputs.put("report", evidence::scene_page(study));
  outputs.write();
  std::cout << evidence::scene_text(study);
}

void check_ticks(std::uint64_t ticks, bool searching) {
  constexpr std::uint64_t kMost = 1'000'000'000'000;
  if (searching && (ticks == 0 || ticks > kMost)) {
    throw UsageError("--search: must be 1 to " + std::to_string(kMost) + " ticks");
  }
}

}  // namespace

int accuracy_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage =
      "palpate accuracy SCENE.json [--renderer point|ray] [--trajectory T.csv] [--report "
      "FILE.html] "
      "[--figure FILE.svg]\n"
      "                [--json FILE]\n"
      "       palpate accuracy [--quick | --search TICKS [--unions]] [--report FILE.html] "
      "[--figure "
      "FILE.svg] "
      "[--json FILE]";
  line.summary =
      "Error of the rendered forces against run time: every method over every tessellation of\n"
      "every analytic shape, and which tessellation to choose; contact with concave objects and\n"
      "with tools of several segments, compared with simpler methods; soft bodies; scenes of "
      "every\n"
      "kind. Takes five minutes, with --quick one. Status 1 when a tick of the search is wrong or\n"
      "an extreme case fails. With a scene: the same for it, with every method that can show it\n"
      "(the renderer, coarser meshes, convex hulls, other libraries), beside the exact answer, "
      "and\n"
      "which to choose.";
  line.example =
      "  palpate accuracy SCENE.json --report accuracy.html\n"
      "  palpate accuracy --quick\n"
      "  palpate accuracy --report accuracy.html --json accuracy.json\n"
      "  palpate accuracy --search 10000000   (random solids and paths against brute force)\n"
      "  palpate accuracy --search 10000000 --unions --seed 2";
  std::string json, figure, page;
  std::uint64_t search_ticks = 0, seed = 1;
  evidence::AccuracySettings settings;
  int jobs = 0;
  auto add = line.options.add_options();
  add("quick", "fewer and shorter paths, at most 20,480 triangles");
  add("scene", po::value<std::string>()->value_name("FILE"),
      "scene, JSON; or a mesh file, alone: compare methods on it");
  add("renderer", po::value<std::string>()->value_name("NAME")->default_value("ray"),
      "of the scene: point or ray");
  add("trajectory", po::value<std::string>()->value_name("FILE"),
      "of the scene: path of the stylus, CSV as of palpate render; default: a hand strokes each "
      "object, up to four");
  add("paths", po::value<int>()->value_name("N"), "paths for each shape and probe; default 4");
  add("ticks", po::value<int>()->value_name("N"), "ticks of contact of each path; default 1000");
  add("most-triangles", po::value<int>()->value_name("N"),
      "of the finest tessellation; default 327680");
  add("json", po::value(&json)->value_name("FILE"), "write every number as JSON");
  add("figure", po::value(&figure)->value_name("FILE"),
      "write the figure of error against run time as SVG");
  add("report", po::value(&page)->value_name("FILE"),
      "write all of it, with the figure, as one HTML page");
  add("search", po::value(&search_ticks)->value_name("TICKS"),
      "only search this many random ticks for errors");
  add("unions", "search clusters of 3 to 8 convex parts with tools of 1 to 3 segments");
  add("seed", po::value(&seed)->value_name("N")->default_value(1), "of the search");
  add("jobs", po::value(&jobs)->value_name("J"),
      "threads of the search; default: one for each core");
  add("force", "replace existing files");
  line.positional.add("scene", 1);
  const auto values = line.parse(args);
  if (!values) return 0;
  const bool searching = values->count("search") > 0;
  check_ticks(search_ticks, searching);
  if (values->count("quick")) settings = quick_settings();
  const auto take = [&](const char* option, int& setting, int low, int high) {
    if (!values->count(option)) return;
    setting = (*values)[option].as<int>();
    check_range(option, setting, low, high);
  };
  take("paths", settings.paths, 1, 10000);
  take("ticks", settings.contact_ticks, 1, 1000000);
  take("most-triangles", settings.most_triangles, 20, 1310720);
  if (values->count("jobs")) check_range("jobs", jobs, 1, 256);
  const bool unions = values->count("unions") > 0;
  if (unions && !searching) throw UsageError("--unions: requires --search");
  if (searching && !figure.empty()) throw UsageError("--figure: a search has no figure");
  output::Outputs outputs(*values, {"json", "figure", "report"}, {"scene", "trajectory"});
  if (values->count("scene")) {
    for (const char* other : {"search", "unions", "paths", "most-triangles", "jobs"}) {
      if (values->count(other))
        throw UsageError("--" + std::string(other) + ": cannot be combined with a scene");
    }
    study_users_scene(*values, outputs);
    return 0;
  }
  if (values->count("trajectory")) throw UsageError("--trajectory: requires a scene");
  evidence::AccuracyReport report;
  if (jobs == 0) jobs = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  if (searching) {
    report.search_seed = seed;
    if (unions) {
      report.union_search = search_unions_in_threads(search_ticks, seed, jobs);
    } else {
      report.search = search_in_threads(search_ticks, seed, jobs);
    }
  } else {
    report.settings = settings;
    measure_accuracy(report, values->count("quick") > 0, jobs, seed);
  }
  if (outputs.wanted("json")) outputs.put("json", evidence::accuracy_json(report).dump(1) + "\n");
  if (outputs.wanted("figure"))
    outputs.put("figure",
                analysis::figure_svg(evidence::accuracy_figure(report), analysis::light_palette()));
  if (outputs.wanted("report")) outputs.put("report", evidence::accuracy_page(report));
  outputs.write();
  std::cout << evidence::accuracy_text(report);
  const bool extremes_hold =
      std::all_of(report.extremes.begin(), report.extremes.end(),
                  [](const evidence::ExtremeRow& row) { return row.result.passed; });
  const std::uint64_t wrong = (report.search ? report.search->wrong() : 0) +
                              (report.union_search ? report.union_search->wrong() : 0);
  return extremes_hold && wrong == 0 ? 0 : 1;
}

}  // namespace palpate::runner::commands
