// The renderer beside other people's collision libraries: the same meshes and the same path of a
// hand in one run. How long a tick takes, how that grows with the mesh, how often the depth is
// wrong.
//
// Usage: peers_bench [SECONDS]   spent on each row, timing; 5 if not given

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "rendering/renderer.h"
#include "runner/evidence/accuracy/local_depths.h"
#include "runner/evidence/accuracy/methods.h"
#include "runner/evidence/tick_meters.h"
#include "runner/evidence/verification/reference.h"
#include "runner/evidence/verification/surface_stroke.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/primitives.h"

namespace palpate::bench {
namespace {

constexpr double kRadius = 0.03;        // m
constexpr std::size_t kWarm = 2000;     // ticks
constexpr std::size_t kTicks = 60'000;  // at most, after them
constexpr double kWrong = 1e-6;         // of the size
constexpr double kRounding = 1e-12;     // of the size
constexpr std::size_t kCheckedVisits =
    30'000'000;  // facets that the exact reference looks at, a row

using Path = std::vector<rendering::LineProbe>;

/// In contact some 70 % of the time.
Path hand_over(const std::shared_ptr<const stimuli::ConvexMesh>& mesh, bool segment) {
  const rendering::Renderer& renderer =
      segment ? rendering::ray_renderer() : rendering::point_renderer();
  const rendering::Scene scene({{mesh, Pose{}, stimuli::Material{}, 0, nullptr}}, segment);
  rendering::RenderState state = scene.initial_state();
  runner::evidence::SurfaceStrokeSettings settings;
  settings.side = segment;
  settings.lifted = 0.27;
  runner::evidence::SurfaceStroke hand(settings);
  Path path(kWarm + kTicks);
  double depth = 0;
  for (rendering::LineProbe& probe : path) {
    probe = hand.next(depth);
    depth = renderer.tick(scene, state, probe, 1e-3).deepest.depth;
    if (!segment) probe.tail = probe.tip;
  }
  return path;
}

struct Row {
  std::string method;
  std::size_t triangles = 0, ticks = 0;
  double median_ns = 0, p99_ns = 0, worst_ns = 0;
  std::size_t touching = 0;
  std::size_t checked = 0, wrong = 0, lost = 0, gave_up = 0, other_side = 0;
  double worst_error = 0;  ///< m
};

double quantile(std::vector<std::uint64_t>& counts, double fraction) {
  const auto k = static_cast<std::ptrdiff_t>(fraction * static_cast<double>(counts.size() - 1));
  std::nth_element(counts.begin(), counts.begin() + k, counts.end());
  return static_cast<double>(counts[static_cast<std::size_t>(k)]);
}

/// Compares an estimate with the penetration depth. A method that keeps to its side may hold
/// another local minimum, and is then compared with that one.
void check(const stimuli::ConvexMesh& mesh, const rendering::LineProbe& probe,
           const runner::evidence::ReferenceDepth& exact,
           const runner::evidence::ContactEstimate& estimate, bool keeps_side, Row& row) {
  const double tolerance = kWrong * mesh.size();
  ++row.checked;
  if (std::isnan(estimate.depth)) {
    ++row.gave_up;
    ++row.wrong;
    return;
  }
  const double depth = estimate.touching ? estimate.depth : 0;
  double error = std::abs(depth - std::max(0.0, exact.depth));
  if (error > kRounding * mesh.size() && keeps_side && estimate.touching) {
    const double to_least = error;
    for (const runner::evidence::LocalDepth& local :
         runner::evidence::local_depths(mesh, probe, estimate.normal, 1e-3))
      error = std::min(error, std::abs(depth - local.depth));
    if (error < to_least) ++row.other_side;
  }
  row.worst_error = std::max(row.worst_error, error);
  if (error <= tolerance) return;
  ++row.wrong;
  if (!estimate.touching) ++row.lost;
}

/// The exact depths of every so many ticks of a path.
struct ExactDepths {
  std::size_t every = 1;
  std::map<std::size_t, runner::evidence::ReferenceDepth> depths;

  ExactDepths(const stimuli::ConvexMesh& mesh, const Path& path) {
    const std::size_t size = mesh.facets().size() + mesh.edges().size();
    every = std::max<std::size_t>(1, kTicks * size / kCheckedVisits);
    for (std::size_t i = kWarm; i < path.size(); i += every)
      depths.emplace(i, runner::evidence::reference_depth(mesh, path[i]));
  }
};

Row run(const runner::evidence::MethodDefinition& kind, const stimuli::ConvexMesh& mesh,
        const Path& path, const ExactDepths& exact, bool segment, double seconds) {
  const double ns = runner::evidence::nanoseconds_per_count();
  const auto most = static_cast<std::uint64_t>(seconds * 1e9 / ns);
  const std::unique_ptr<runner::evidence::ContactMethod> method = kind.make(mesh, segment);
  Row row;
  row.method = kind.name;
  std::vector<std::uint64_t> counts;
  counts.reserve(kTicks);
  std::vector<runner::evidence::ContactEstimate> estimates;
  estimates.reserve(kTicks);
  std::uint64_t spent = 0;
  // A method with history must come in from outside; the others may begin anywhere.
  for (std::size_t i = kind.has_history ? 0 : kWarm - 1; i < path.size() && spent < most; ++i) {
    const std::uint64_t start = runner::evidence::begin_count();
    const runner::evidence::ContactEstimate estimate = method->tick(path[i]);
    const std::uint64_t count = runner::evidence::end_count() - start;
    if (i < kWarm) continue;
    spent += count;
    counts.push_back(count);
    estimates.push_back(estimate);
    row.touching += estimate.touching ? 1 : 0;
  }
  row.ticks = counts.size();
  row.median_ns = quantile(counts, 0.5) * ns;
  row.p99_ns = quantile(counts, 0.99) * ns;
  row.worst_ns = quantile(counts, 1) * ns;
  for (const auto& [i, depth] : exact.depths) {
    if (i - kWarm >= estimates.size()) break;
    check(mesh, path[i], depth, estimates[i - kWarm], kind.keeps_side, row);
  }
  return row;
}

/// The shipped renderer, the simplest exact one, and each library found.
std::vector<runner::evidence::MethodDefinition> compared() {
  std::vector<runner::evidence::MethodDefinition> kinds;
  for (runner::evidence::MethodDefinition& kind : runner::evidence::contact_methods()) {
    if (!kind.name.starts_with("walk") && kind.name != "scan") kinds.push_back(std::move(kind));
  }
  return kinds;
}

std::string share(std::size_t part, std::size_t whole) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g %%",
                whole > 0 ? 100.0 * static_cast<double>(part) / static_cast<double>(whole) : 0);
  return text;
}

void print(const std::vector<Row>& rows) {
  const Row& ours = rows.front();
  for (const Row& r : rows) {
    std::printf("%9zu  %-12s%7zu%6.0f %%%10.3f%10.3f%10.1f%9.1fx%8.1fx%9s%9s%9s%10.1e\n",
                r.triangles, r.method.c_str(), r.ticks,
                100.0 * static_cast<double>(r.touching) / static_cast<double>(r.ticks),
                r.median_ns / 1e3, r.p99_ns / 1e3, r.worst_ns / 1e3, r.median_ns / ours.median_ns,
                r.p99_ns / ours.p99_ns, share(r.wrong, r.checked).c_str(),
                share(r.lost, r.checked).c_str(), share(r.other_side, r.checked).c_str(),
                r.worst_error);
  }
  std::fflush(stdout);
}

void compare(bool segment, double seconds) {
  std::printf("\n%s, us a tick\n%9s  %-12s%7s%8s%10s%10s%10s%10s%9s%9s%9s%9s%10s\n",
              segment ? "Segment of 0.12 m" : "Point", "triangles", "method", "ticks", "touch",
              "median", "p99", "worst", "/ours", "p99", "wrong", "lost", "2nd way", "error, m");
  std::map<std::string, std::array<double, 2>> growth;  // median at 1,280 and 327,680
  for (const int level : {0, 3, 5, 7}) {
    const auto mesh =
        std::make_shared<const stimuli::ConvexMesh>(stimuli::icosphere(kRadius, level));
    const Path path = hand_over(mesh, segment);
    const ExactDepths exact(*mesh, path);
    std::vector<Row> rows;
    for (const runner::evidence::MethodDefinition& kind : compared()) {
      rows.push_back(run(kind, *mesh, path, exact, segment, seconds));
      rows.back().triangles = std::size_t{20} << (2 * level);
      if (level == 3) growth[kind.name][0] = rows.back().median_ns;
      if (level == 7) growth[kind.name][1] = rows.back().median_ns;
    }
    print(rows);
  }
  std::printf("\nGrowth of the median from 1,280 to 327,680 triangles:");
  for (const auto& [name, medians] : growth)
    std::printf("  %s %.2fx", name.c_str(), medians[1] / medians[0]);
  std::printf("\n");
}

int main_with(int argc, char** argv) {
  double seconds = 5;
  if (argc > 2 ||
      (argc == 2 &&
       (std::from_chars(argv[1], argv[1] + std::strlen(argv[1]), seconds).ec != std::errc{} ||
        !(seconds > 0)))) {
    std::fprintf(stderr, "usage: peers_bench [SECONDS a row]\n");
    return 2;
  }
  std::printf(
      "Icospheres of 30 mm radius, a hand at 0.1 m/s, 1 to 2 mm deep for 70 %% of the time, the "
      "same "
      "path for all.\nMethods:\n");
  for (const runner::evidence::MethodDefinition& kind : compared())
    std::printf("  %-12s %s\n", kind.name.c_str(), kind.description.c_str());
  std::printf(
      "wrong: depth off by more than 1e-6 of the size from the exact one (every facet looked at), "
      "lost contacts and refusals among them;\nlost: of these, a contact that was not reported; "
      "2nd "
      "side: a local minimum of the depth that is not the least, on the side of entry.\n");
  for (const bool segment : {true, false}) compare(segment, seconds);
  return 0;
}

}  // namespace
}  // namespace palpate::bench

int main(int argc, char** argv) {
  try {
    return palpate::bench::main_with(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "peers_bench: %s\n", error.what());
    return 1;
  }
}
