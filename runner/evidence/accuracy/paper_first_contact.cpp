#include "runner/evidence/accuracy/paper_first_contact.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <optional>

#include "data/base/random.h"
#include "rendering/first_contact.h"
#include "runner/evidence/verification/random_draws.h"
#include "runner/evidence/verification/reference.h"
#include "stimuli/convex_mesh.h"

namespace palpate::runner::evidence {
namespace {

constexpr double kPaperTick = 1e-3;    // s
constexpr double kPaperStylus = 0.12;  // m
constexpr int kFine = 100;             // brute-force steps a tick
constexpr int kAfterwards = 20;        // ticks in which a missed contact may still be found
constexpr double kDeepest = 1e-9;      // of the size; less is touching

/// Where two segments are nearest, as fractions along them.
struct Nearest {
  double on_edge, on_probe;
  Vec3 apart;  ///< from the edge to the probe
};

/// Appendix 6. A clamped fraction is at an end.
Nearest nearest(const Vec3& c, const Vec3& e, const rendering::LineProbe& probe) {
  const Vec3 d = probe.tail - probe.tip, w = probe.tip - c;
  const double ee = glm::dot(e, e), dd = glm::dot(d, d), ed = glm::dot(e, d);
  const double we = glm::dot(w, e), wd = glm::dot(w, d), across = ee * dd - ed * ed;
  double on_probe = across > 0 ? std::clamp((ed * we - ee * wd) / across, 0.0, 1.0) : 0.0;
  const double on_edge = std::clamp((we + on_probe * ed) / ee, 0.0, 1.0);
  on_probe = std::clamp((on_edge * ed - wd) / dd, 0.0, 1.0);
  return {on_edge, on_probe, w + on_probe * d - on_edge * e};
}

rendering::LineProbe probe_between(const rendering::LineProbe& a, const rendering::LineProbe& b,
                                   double t) {
  return {a.tip + t * (b.tip - a.tip), a.tail + t * (b.tail - a.tail)};
}

/// A stylus in straight motion, turning steadily.
struct Motion {
  Vec3 start, velocity;  ///< of the point at `fraction` of the stylus; m, m/s
  Vec3 direction, axis;  ///< axis at right angles to direction
  double turning = 0, fraction = 0;

  rendering::LineProbe at(int tick) const {
    const double time = tick * kPaperTick, angle = turning * time;
    const Vec3 u = std::cos(angle) * direction + std::sin(angle) * glm::cross(axis, direction);
    const Vec3 at = start + time * velocity;
    return {at - fraction * kPaperStylus * u, at + (1 - fraction) * kPaperStylus * u};
  }
};

bool inside(const stimuli::ConvexMesh& mesh, const rendering::LineProbe& probe) {
  return reference_depth(mesh, probe).depth > kDeepest * mesh.size();
}

bool enters(const stimuli::ConvexMesh& mesh, const rendering::LineProbe& before,
            const rendering::LineProbe& after) {
  for (int i = 1; i <= kFine; ++i) {
    if (inside(mesh, probe_between(before, after, i / static_cast<double>(kFine)))) return true;
  }
  return false;
}

/// The first tick that ends after the probe's entry, for a motion that starts off the object.
std::optional<int> entry_tick(const stimuli::ConvexMesh& mesh, const Motion& motion, int ticks) {
  for (int tick = 1; tick <= ticks; ++tick) {
    const rendering::LineProbe before = motion.at(tick - 1), after = motion.at(tick);
    // Too far apart to touch within the tick: skip the hundred steps.
    const double moved =
        std::max(glm::length(after.tip - before.tip), glm::length(after.tail - before.tail));
    if (reference_gap(mesh, before) > moved) continue;
    if (enters(mesh, before, after)) return tick;
  }
  return std::nullopt;
}

}  // namespace

bool crosses_polygon(const stimuli::ConvexMesh& mesh, std::uint32_t index, const Vec3& before,
                     const Vec3& after) {
  const stimuli::Facet& facet = mesh.facets()[index];
  const double d1 = glm::dot(facet.normal, before) - facet.offset;
  const double d2 = glm::dot(facet.normal, after) - facet.offset;
  if (d1 * d2 > 0 || d1 == d2) return false;
  const Vec3 p = before + d1 / (d1 - d2) * (after - before);
  for (std::uint32_t i = facet.first_side; i < facet.first_side + facet.side_count; ++i) {
    if (glm::dot(mesh.sides()[i].inward, p) < mesh.sides()[i].offset) return false;
  }
  return true;
}

bool crosses_edge(const stimuli::ConvexMesh& mesh, std::uint32_t index,
                  const rendering::LineProbe& before, const rendering::LineProbe& after) {
  const stimuli::Edge& edge = mesh.edges()[index];
  const Vec3& c = edge.from;
  const Vec3 e = edge.to - c;
  const Nearest n0 = nearest(c, e, before), n1 = nearest(c, e, after);
  const auto no_end = [](double fraction) { return fraction > 0 && fraction < 1; };
  return glm::dot(n0.apart, n1.apart) < 0 && no_end(n0.on_edge) && no_end(n1.on_edge) &&
         no_end(n0.on_probe) && no_end(n1.on_probe);
}

bool paper_first_contact(const stimuli::ConvexMesh& mesh, const rendering::LineProbe& before,
                         const rendering::LineProbe& after) {
  for (std::uint32_t i = 0; i < mesh.facets().size(); ++i) {
    if (crosses_polygon(mesh, i, before.tip, after.tip)) return true;
    if (crosses_polygon(mesh, i, before.tail, after.tail)) return true;
  }
  for (std::uint32_t i = 0; i < mesh.edges().size(); ++i) {
    if (crosses_edge(mesh, i, before, after)) return true;
  }
  return false;
}

FirstContactLoss first_contact_loss(const stimuli::ConvexMesh& mesh, double speed, double turning,
                                    int entries, std::uint64_t seed) {
  FirstContactLoss loss;
  loss.speed = speed;
  loss.turning = turning;
  Random random(seed);
  const rendering::ContactTrees trees(mesh, true);
  const double step = speed * kPaperTick, tolerance = 1e-12 * mesh.size();
  constexpr int kBefore = 5;  // ticks in free space, about
  while (loss.entries < entries) {
    Motion motion;
    motion.direction = random_direction(random);
    motion.axis = random_direction(random);
    motion.axis =
        glm::normalize(motion.axis - glm::dot(motion.axis, motion.direction) * motion.direction);
    motion.turning = turning * random.unit();
    motion.fraction = random.unit();
    const Vec3 heading = random_direction(random);
    motion.velocity = speed * heading;
    // Go back along the motion from a point within the object until the probe is off it, then some
    // ticks more, so that every speed has the same number of ticks in free space.
    const Vec3 aim = mesh.centre() + 0.8 * mesh.radius() * random.unit() * random_direction(random);
    motion.start = aim;
    if (!inside(mesh, motion.at(0))) continue;
    double near = 0, far = 2 * mesh.size() + kPaperStylus;
    motion.start = aim - far * heading;
    if (reference_gap(mesh, motion.at(0)) == 0) continue;  // the stylus lies along the motion
    while (far - near > step / 8) {
      const double middle = (near + far) / 2;
      motion.start = aim - middle * heading;
      (inside(mesh, motion.at(0)) ? near : far) = middle;
    }
    motion.start = aim - (far + (kBefore - random.unit()) * step) * heading;
    if (reference_gap(mesh, motion.at(0)) == 0) continue;
    const auto entry = entry_tick(mesh, motion, 4 * kBefore);
    if (!entry) continue;
    ++loss.entries;
    const auto paper = [&](int tick) {
      return paper_first_contact(mesh, motion.at(tick - 1), motion.at(tick));
    };
    for (int tick = 1; tick < *entry; ++tick) {
      if (!paper(tick)) continue;
      ++loss.paper_early;
      break;
    }
    const rendering::LineProbe before = motion.at(*entry - 1), after = motion.at(*entry);
    if (first_contact_segment(mesh, trees, before, after, tolerance).feature.kind ==
        rendering::ContactFeature::Kind::none) {
      ++loss.exact_missed;
    }
    if (paper(*entry)) continue;
    ++loss.paper_missed;
    bool found = false;
    for (int tick = *entry + 1; !found && tick <= *entry + kAfterwards; ++tick) {
      if (reference_gap(mesh, motion.at(tick)) > 0) break;
      found = paper(tick);
    }
    loss.paper_never += found ? 0 : 1;
  }
  return loss;
}

}  // namespace palpate::runner::evidence
