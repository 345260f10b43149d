#include "runner/commands/accuracy/measure.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <span>
#include <stdexcept>
#include <string_view>
#include <thread>

#include "rendering/first_contact.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/shared/progress_line.h"
#include "stimuli/primitives.h"

namespace palpate::runner {
namespace {

void study_first_contacts(AccuracyReport& report, int entries) {
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
  ProgressLine progress("first contacts");
  constexpr double kSpeeds[] = {0.1, 0.5, 1, 5};
  const double steps = static_cast<double>(std::size(shapes) * std::size(kSpeeds));
  double done = 0;
  for (const Shape& shape : shapes) {
    const stimuli::ConvexMesh mesh(shape.soup);
    FirstContactStudy study{shape.name, {}};
    for (const double speed : kSpeeds) {
      progress.show(done / steps);
      study.speeds.push_back(rendering::first_contact_loss(mesh, speed, 2, entries, 1));
      done += 1;
    }
    report.first_contacts.push_back(std::move(study));
  }
}

/// Cost of one test where neither has a tree: 6 facets and 12 edges, a motion that stays off.
void time_first_contact(AccuracyReport& report) {
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
      const double start = now_ns();
      for (int i = 0; i < kTests; ++i) found += test(pose(i), pose(i + 1)) ? 1 : 0;
      fastest = std::min(fastest, (now_ns() - start) / kTests);
    }
    return fastest;
  };
  report.paper_test_ns =
      time([&](const rendering::LineProbe& before, const rendering::LineProbe& after) {
        return rendering::paper_first_contact(mesh, before, after);
      });
  report.exact_test_ns =
      time([&](const rendering::LineProbe& before, const rendering::LineProbe& after) {
        return rendering::first_contact_segment(mesh, trees, before, after, 1e-12 * mesh.size())
                   .feature.kind != rendering::ContactFeature::Kind::none;
      });
  if (found > 0) throw std::runtime_error("a motion off the cube was taken for a contact");
}

/// \param quick  without the case whose mesh takes seconds to build
void run_extreme_cases(AccuracyReport& report, bool quick) {
  ProgressLine progress("extreme cases");
  const std::span<const rendering::ExtremeCase> cases = rendering::extreme_cases();
  double done = 0;
  for (const rendering::ExtremeCase& one : cases) {
    progress.show(done++ / static_cast<double>(cases.size()));
    if (quick && std::string_view(one.name) == "million-triangles") continue;
    for (const rendering::Renderer* renderer :
         {&rendering::ray_renderer(), &rendering::point_renderer()}) {
      report.extremes.push_back(
          {one.name, one.title, one.measure, renderer->name(), one.run(*renderer)});
    }
  }
}

/// \param search  of (seed, first walk, walks)
template <class Counts>
Counts in_threads(Counts (*search)(std::uint64_t, std::uint64_t, std::uint64_t),
                  std::uint64_t ticks, std::uint64_t seed, int jobs) {
  const std::uint64_t walks = (ticks + rendering::kTicksPerWalk - 1) / rendering::kTicksPerWalk;
  constexpr std::uint64_t kBatch = 20;  // walks a thread takes at a time
  Counts all;
  ProgressLine progress("search");
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

}  // namespace

rendering::SearchCounts search_in_threads(std::uint64_t ticks, std::uint64_t seed, int jobs) {
  return in_threads(rendering::search_walks, ticks, seed, jobs);
}

rendering::UnionCounts search_unions_in_threads(std::uint64_t ticks, std::uint64_t seed, int jobs) {
  return in_threads(rendering::search_unions, ticks, seed, jobs);
}

void measure_accuracy(AccuracyReport& report, bool quick, int jobs, std::uint64_t seed) {
  {
    ProgressLine progress("errors and times");
    report.rows = rendering::accuracy_study(report.settings, now_ns,
                                            [&](double done) { progress.show(done); });
  }
  // In proportion to the rest: 2000 of each by default.
  study_first_contacts(report,
                       std::max(10, report.settings.paths * report.settings.contact_ticks / 2));
  time_first_contact(report);
  {
    ProgressLine progress("unions");
    if (quick) report.union_settings = {2, 500, 1};
    report.unions = rendering::union_study(report.union_settings, now_ns,
                                           [&](double done) { progress.show(done); });
  }
  {
    ProgressLine progress("bodies");
    report.bodies = rendering::body_study(quick, now_ns, [&](double done) { progress.show(done); });
    report.body_tick = rendering::body_tick_cost(quick, now_ns);
  }
  {
    ProgressLine progress("soft bodies");
    report.soft =
        rendering::soft_study(quick, now_ns, [&progress](double done) { progress.show(done); });
  }
  run_extreme_cases(report, quick);
  constexpr std::uint64_t kShortSearch = 100'000;
  report.search_seed = seed;
  report.search = search_in_threads(kShortSearch, seed, jobs);
  report.union_search = search_unions_in_threads(kShortSearch, seed, jobs);
}

}  // namespace palpate::runner
