#include "runner/evidence/verification/search.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>
#include <numbers>
#include <sstream>
#include <utility>
#include <vector>

#include "rendering/first_contact.h"
#include "runner/evidence/verification/nearest_point.h"
#include "runner/evidence/verification/random_paths.h"
#include "runner/evidence/verification/random_solids.h"
#include "runner/evidence/verification/reference.h"
#include "runner/evidence/verification/tick_audit.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/orientation.h"

namespace palpate::runner::evidence {
namespace {

constexpr int kFineSteps = 100;       // of a tick, by brute force
constexpr double kFastestTurn = 0.1;  // rad a tick: 100 rad/s, faster than any hand
constexpr double kAtSurface = 1e-6;   // sizes

rendering::LineProbe interpolated(const rendering::LineProbe& a, const rendering::LineProbe& b,
                                  double t) {
  return {a.tip + t * (b.tip - a.tip), a.tail + t * (b.tail - a.tail)};
}

/// One walk in progress.
class Walk {
 public:
  Walk(const rendering::Renderer& renderer, std::uint64_t seed, std::uint64_t walk)
      : renderer_(renderer),
        random_(seed, {walk}),
        mesh_(std::make_shared<const stimuli::ConvexMesh>(random_solid(random_))),
        pose_(random_pose()),
        length_(random_length()),
        kind_(static_cast<PathKind>(random_.below(kPathKinds))),
        scene_({{mesh_, pose_, stimuli::Material{}, 0, nullptr}}, renderer.side_contact()),
        state_(scene_.initial_state()) {
    counts_.walks = 1;
    fault_.seed = seed;
    fault_.walk = walk;
  }

  SearchCounts run() {
    const auto path =
        random_path(random_, kind_, *mesh_, length_, renderer_.side_contact(), kTicksPerWalk);
    for (const rendering::LineProbe& local : path)
      tick({to_world(local.tip), to_world(local.tail)});
    return std::move(counts_);
  }

 private:
  Pose random_pose() {
    if (random_.below(2)) return {};
    const double reach = random_.below(2) ? 1 : 10 * mesh_->size();
    return {reach * (stimuli::uniform_rotation(random_) * Vec3(0, 0, 1)),
            stimuli::uniform_rotation(random_)};
  }

  double random_length() {
    if (random_.below(8) == 0) return 0.12;
    const double shares[] = {0, 1e-6, 0.05, 0.5, 1, 3, 10};
    return shares[random_.below(7)] * (0.7 + 0.6 * random_.unit()) * mesh_->size();
  }

  Vec3 to_world(const Vec3& local) const { return pose_.orientation * local + pose_.position; }

  void tick(const rendering::LineProbe& probe) {
    const bool was_free = has_last_ && !last_held_;
    const rendering::Rendering r = renderer_.tick(scene_, state_, probe, 1e-3);
    const rendering::LineProbe local = felt_probe(scene_, renderer_, probe);
    const TickAudit audit = audit_tick(scene_, renderer_, probe, r);
    fault_.tick = counts_.ticks++;
    depth_ = r.deepest.depth;
    const bool held = audit.finite && r.contacts > 0;
    counts_.in_contact += held;
    counts_.worst_penetration =
        std::max(counts_.worst_penetration, audit.penetrates / mesh_->size());
    const auto wrong = [&](bool is, std::uint64_t& count, const char* what, double value) {
      if (!is) return;
      ++count;
      report(what, value, local);
    };
    wrong(!audit.finite, counts_.not_finite, "not finite", 0);
    wrong(audit.missed > audit.tolerance, counts_.missed, "missed, depth", audit.missed);
    wrong(audit.penetrates > audit.tolerance, counts_.penetrating, "ideal probe inside by",
          audit.penetrates);
    wrong(audit.floats > audit.tolerance + 1e-9 * length_, counts_.floating, "ideal probe off by",
          audit.floats);
    wrong(audit.shallow > audit.tolerance, counts_.shallow, "too shallow by", audit.shallow);
    wrong(audit.force > 1e-9, counts_.wrong_force, "force wrong by", audit.force);
    wrong((r.faults & rendering::render_fault::kWalkCapped) != 0, counts_.endless,
          "walk stopped at its limit of steps", 0);
    wrong((r.faults & ~rendering::render_fault::kWalkCapped) != 0, counts_.faulted, "fault bits",
          r.faults);
    if (was_free && audit.finite) from_free_space(local, r, held, audit.tolerance);
    last_ = local;
    has_last_ = true;
    last_held_ = held;
  }

  /// Checks a tick that began in free space in a hundred steps by brute force.
  void from_free_space(const rendering::LineProbe& local, const rendering::Rendering& r, bool held,
                       double tolerance) {
    counts_.entries += held;
    if (held) count_fallback(local);
    if (!held && separated_by_facet_plane(*mesh_, last_, local)) return;
    ++counts_.walked_finely;
    const auto time = reference_first_contact(*mesh_, last_, local, kFineSteps);
    if (!time) {
      if (held) expect_touch(local, tolerance);
      return;
    }
    // A start at the surface is within rounding of any facet there.
    if (reference_gap(*mesh_, last_) < kAtSurface * mesh_->size()) return;
    // The probe entered. If its feature of entry holds it at every step, the contact must be there.
    const auto entry = entry_feature(*mesh_, interpolated(last_, local, *time));
    if (!entry) return;
    ReferenceDepth at_end;
    for (int step = static_cast<int>(std::ceil(*time * kFineSteps)); step <= kFineSteps; ++step) {
      const rendering::LineProbe there = interpolated(last_, local, step / double{kFineSteps});
      const auto on = measure_feature(*mesh_, entry->is_edge, entry->index, there);
      if (!on || on->depth <= (step < kFineSteps ? -tolerance : tolerance)) return;
      const rendering::LineProbe ideal = translated(there, on->depth * on->normal);
      if (reference_depth(*mesh_, ideal).depth > tolerance) return;
      if (step < kFineSteps ? reference_gap(*mesh_, ideal) > tolerance
                            : !firmly_on(ideal, on->normal, tolerance)) {
        return;
      }
      at_end = *on;
    }
    const bool elsewhere = !held || std::abs(r.deepest.depth - at_end.depth) >
                                        kNeighbouringDepths * (mesh_->size() + at_end.depth);
    if (turned(local) > kFastestTurn) {
      counts_.turned_elsewhere += elsewhere;
      return;
    }
    // A step may have passed right through a thin part: then another feature holds the probe.
    if (elsewhere && !is_outside_until(local, *time)) return;
    ++counts_.passages;
    if (elsewhere) {
      ++counts_.passed_through;
      report(held ? "held elsewhere, depth off by" : "passed through, depth",
             held ? r.deepest.depth - at_end.depth : at_end.depth, local);
    }
  }

  /// Whether the probe is outside until its entry at a fraction of the tick. Proves it by
  /// bisection: each interval's middle must be farther away than the probe moves within half the
  /// interval. False also if that takes too many measurements.
  bool is_outside_until(const rendering::LineProbe& local, double entry) const {
    constexpr int kMostLooks = 100'000;
    constexpr double kAtEntry = 1e-6;  // of the tick; not checked so shortly before the entry
    const double motion =
        std::max(glm::length(local.tip - last_.tip), glm::length(local.tail - last_.tail));
    std::vector<std::pair<double, double>> left{{0, entry}};
    for (int look = 0; look < kMostLooks && !left.empty(); ++look) {
      const auto [from, to] = left.back();
      left.pop_back();
      const double middle = 0.5 * (from + to);
      if (from > entry - kAtEntry ||
          reference_gap(*mesh_, interpolated(last_, local, middle)) > 0.5 * (to - from) * motion)
        continue;
      left.emplace_back(from, middle);
      left.emplace_back(middle, to);
    }
    return left.empty();
  }

  /// Whether the ideal probe lies well inside a facet of M: at its rim rounding decides which facet
  /// holds it.
  bool firmly_on(const rendering::LineProbe& ideal, const Vec3& normal, double tolerance) const {
    constexpr int kWays = 8;
    const Vec3 u = glm::normalize(std::abs(normal.x) < 0.5 ? glm::cross(normal, Vec3(1, 0, 0))
                                                           : glm::cross(normal, Vec3(0, 1, 0)));
    const Vec3 v = glm::cross(normal, u);
    for (int i = 0; i < kWays; ++i) {
      const double turn = 2 * std::numbers::pi * i / kWays;
      const Vec3 aside = kAtSurface * mesh_->size() * (std::cos(turn) * u + std::sin(turn) * v);
      if (reference_gap(*mesh_, translated(ideal, aside)) > tolerance) return false;
    }
    return true;
  }

  /// A contact that began although no step shows the probe inside: the probe must come at least as
  /// near as it moves in one step.
  void expect_touch(const rendering::LineProbe& local, double tolerance) {
    const double step =
        std::max(glm::length(local.tip - last_.tip), glm::length(local.tail - last_.tail)) /
        kFineSteps;
    double gap = std::numeric_limits<double>::infinity();
    for (int i = 0; i <= kFineSteps && gap > step; ++i) {
      gap =
          std::min(gap, reference_gap(*mesh_, interpolated(last_, local, i / double{kFineSteps})));
    }
    if (gap <= step + tolerance) return;
    ++counts_.phantom;
    report("phantom contact, gap", gap, local);
  }

  void count_fallback(const rendering::LineProbe& local) {
    const rendering::ScenePart& part = scene_.parts()[0];
    const rendering::FirstContact first =
        renderer_.side_contact()
            ? first_contact_segment(*mesh_, *part.trees, last_, local, part.tolerance)
            : first_contact_point(*mesh_, *part.trees, last_.tip, local.tip, part.tolerance);
    counts_.fallbacks += first.feature.kind == rendering::ContactFeature::Kind::none;
  }

  /// rad, by which the probe turned in the tick.
  double turned(const rendering::LineProbe& local) const {
    const Vec3 a = last_.tail - last_.tip, b = local.tail - local.tip;
    return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
  }

  void report(const char* what, double value, const rendering::LineProbe& local) {
    if (counts_.faults.size() >= SearchCounts::kFaultsKept) return;
    std::ostringstream out;
    out.precision(17);
    out << renderer_.name() << ", " << to_string(kind_) << " path, " << mesh_->facets().size()
        << " facets, size " << mesh_->size() << " m, probe " << length_ << " m: " << what << " "
        << value << " (" << value / mesh_->size() << " sizes), contact depth " << depth_
        << " m, at (" << local.tip.x << " " << local.tip.y << " " << local.tip.z << ") ("
        << local.tail.x << " " << local.tail.y << " " << local.tail.z << "), from (" << last_.tip.x
        << " " << last_.tip.y << " " << last_.tip.z << ") (" << last_.tail.x << " " << last_.tail.y
        << " " << last_.tail.z << "), turned by " << turned(local) << " rad";
    fault_.what = out.str();
    counts_.faults.push_back(fault_);
  }

  const rendering::Renderer& renderer_;
  Random random_;
  std::shared_ptr<const stimuli::ConvexMesh> mesh_;
  Pose pose_;
  double length_;
  PathKind kind_;
  rendering::Scene scene_;
  rendering::RenderState state_;
  rendering::LineProbe last_;  // the part that can touch, at the last tick; mesh frame
  bool has_last_ = false, last_held_ = false;
  double depth_ = 0;  // m, of the contact under audit
  SearchFault fault_;
  SearchCounts counts_;
};

}  // namespace

// One walk of the search: its ticks, and the errors in them.

SearchCounts search_walk(const rendering::Renderer& renderer, std::uint64_t seed,
                         std::uint64_t walk) {
  return Walk(renderer, seed, walk).run();
}

SearchCounts& SearchCounts::operator+=(const SearchCounts& other) {
  walks += other.walks;
  ticks += other.ticks;
  in_contact += other.in_contact;
  entries += other.entries;
  walked_finely += other.walked_finely;
  passages += other.passages;
  missed += other.missed;
  passed_through += other.passed_through;
  phantom += other.phantom;
  penetrating += other.penetrating;
  floating += other.floating;
  shallow += other.shallow;
  wrong_force += other.wrong_force;
  not_finite += other.not_finite;
  endless += other.endless;
  faulted += other.faulted;
  fallbacks += other.fallbacks;
  turned_elsewhere += other.turned_elsewhere;
  worst_penetration = std::max(worst_penetration, other.worst_penetration);
  for (const SearchFault& fault : other.faults) {
    if (faults.size() < kFaultsKept) faults.push_back(fault);
  }
  return *this;
}

SearchCounts search_walks(std::uint64_t seed, std::uint64_t first_walk, std::uint64_t walks) {
  SearchCounts counts;
  for (std::uint64_t walk = first_walk; walk < first_walk + walks; ++walk) {
    counts += search_walk(walk % 4 == 0 ? rendering::point_renderer() : rendering::ray_renderer(),
                          seed, walk);
  }
  return counts;
}

}  // namespace palpate::runner::evidence
