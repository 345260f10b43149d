#include "runner/evidence/verification/union_search.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <numbers>
#include <sstream>
#include <utility>
#include <vector>

#include "runner/evidence/verification/tick_audit.h"
#include "stimuli/convex_mesh.h"

namespace palpate::runner::evidence {
namespace {

constexpr double kStylus = 0.12;                       // m, of a stylus that carries a tool
constexpr double kSpring = 800;                        // N/m
constexpr double kInside = 1e-12, kMinimal = 1e-9;     // sizes
constexpr double kTouchingSizes = 1e-11;               // sizes
constexpr double kPlane = 2 * std::numbers::pi / 180;  // rad
const double kSinBlend = std::sin(kPlane / 2);         // of equation (2)
constexpr double kTurned = 1e-9;                       // rad; less is rounding
constexpr std::uint32_t kCounted =
    rendering::render_fault::kContactCapped | rendering::render_fault::kReleased;

/// The axes of a tool from its stylus and +x.
Mat3 axes_of(const rendering::LineProbe& stylus, const Vec3& side) {
  const Vec3 z = glm::normalize(stylus.tail - stylus.tip);
  const Vec3 x = glm::normalize(side - glm::dot(side, z) * z);
  return {x, glm::cross(z, x), z};
}

double angle_between(const Vec3& a, const Vec3& b) {
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

double distance_to_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 ab = b - a;
  const double t = std::clamp(glm::dot(p - a, ab) / glm::dot(ab, ab), 0.0, 1.0);
  return glm::length(p - a - t * ab);
}

/// Whether all numbers of a rendering are finite.
/// The scene of a walk: one object of this stiffness, N/m.
rendering::Scene union_scene(const UnionWalk& walk, double stiffness) {
  std::vector<rendering::SceneObject> objects;
  for (const OraclePart& part : walk.parts) {
    rendering::SceneObject object;
    object.mesh = part.mesh;
    object.pose = part.pose;
    object.material.stiffness = stiffness;
    objects.push_back(std::move(object));
  }
  rendering::Tool tool;
  if (!is_plain(walk.tool)) {
    for (const OracleSegment& segment : walk.tool) {
      tool.segments.push_back({segment.from, segment.to});
    }
  }
  return rendering::Scene(std::move(objects), true, std::move(tool));
}

/// The stylus of a walk at a pose; `state` gets the tool's +x as measured.
rendering::LineProbe union_probe(const UnionWalk& walk, const OraclePose& pose,
                                 rendering::RenderState& state) {
  state.measured_side = pose.axes[0];
  if (is_plain(walk.tool)) return {pose.place(walk.tool[0].from), pose.place(walk.tool[0].to)};
  return {pose.tip, pose.place(Vec3(0, 0, kStylus))};
}

/// One walk in progress.
class UnionWalker {
 public:
  UnionWalker(const rendering::Renderer& renderer, UnionWalk drawn, std::uint64_t seed,
              std::uint64_t walk)
      : renderer_(renderer),
        walk_(std::move(drawn)),
        oracle_(walk_.parts, walk_.tool),
        scene_(union_scene(walk_, kSpring)),
        state_(scene_.initial_state()) {
    counts_.walks = 1;
    fault_.seed = seed;
    fault_.walk = walk;
  }

  UnionCounts run() {
    ideal_ = walk_.path[0];
    for (const OraclePose& pose : walk_.path) {
      fault_.tick = counts_.ticks++;
      if (!tick(pose)) break;
    }
    return std::move(counts_);
  }

 private:
  /// \return false if the walk cannot continue
  bool tick(const OraclePose& pose) {
    const rendering::LineProbe probe = union_probe(walk_, pose, state_);
    const rendering::Rendering r = renderer_.tick(scene_, state_, probe, 1e-3);
    if (wrong(!all_finite(r), counts_.not_finite, "not finite", 0)) return false;
    const OraclePose last = ideal_;
    ideal_ = {r.ideal.tip, is_plain(walk_.tool) ? axes_of(r.ideal, side_of(r.ideal, pose))
                                                : axes_of(r.ideal, r.ideal_side)};
    wrong((r.faults & ~kCounted) != 0, counts_.faulted, "fault bits", r.faults);
    const bool capped = (r.faults & rendering::render_fault::kContactCapped) != 0;
    const bool released = (r.faults & rendering::render_fault::kReleased) != 0;
    counts_.capped += capped;
    counts_.released += released;
    if (released) return true;  // not an ideal tool until it has left
    const bool held = r.contacts > 0;
    const bool lagged = glm::length(ideal_.axes[2] - pose.axes[2]) > kTurned ||
                        glm::length(ideal_.axes[0] - pose.axes[0]) > kTurned;
    counts_.in_contact += held;
    counts_.several += r.contacts > 1;
    counts_.lagged += held && lagged;
    const double size = oracle_.size();
    const OracleAudit audit = oracle_.audit(ideal_, pose.tip, kTouchingSizes * size);
    counts_.worst_penetration = std::max(counts_.worst_penetration, audit.penetration / size);
    wrong(audit.penetration > kInside * size, counts_.inside, "inside by", audit.penetration);
    const bool lowest = capped || check_minimal(audit, pose);
    check_force(r, pose);
    if (held && !capped && !lagged && lowest) compare(r, last, pose);
    return true;
  }

  /// \return whether it is at a local minimum
  bool check_minimal(const OracleAudit& audit, const OraclePose& pose) {
    const double size = oracle_.size();
    const bool balanced = audit.unbalanced <= kMinimal * size;
    const bool lowest = audit.descent <= kMinimal * size;
    if (lowest) counts_.worst_descent = std::max(counts_.worst_descent, audit.descent / size);
    counts_.on_edge += balanced && !lowest;
    const bool in_gap =
        !balanced &&
        oracle_.held_in_gap(ideal_, pose.tip, 2 * scene_.groups().front().skin, kMinimal * size);
    counts_.in_gap += in_gap;
    wrong(!balanced && !in_gap, counts_.not_minimal, "unbalanced, by", audit.unbalanced);
    return balanced && lowest;
  }

  /// The plain stylus has no roll: any +x near that of the pose.
  static Vec3 side_of(const rendering::LineProbe& ideal, const OraclePose& pose) {
    const Vec3 z = glm::normalize(ideal.tail - ideal.tip);
    return std::abs(glm::dot(z, pose.axes[0])) < 0.9 ? pose.axes[0] : pose.axes[1];
  }

  void check_force(const rendering::Rendering& r, const OraclePose& pose) {
    const Vec3 displacement = r.contacts > 0 ? ideal_.tip - pose.tip : Vec3(0);
    const double force = kSpring * glm::length(displacement);
    const double rounding = 1e-9 * force + 1e-12 * kSpring * oracle_.size();
    const double error = std::max(glm::length(r.force - kSpring * displacement),
                                  glm::length(r.device1 + r.device2 - r.force));
    wrong(error > rounding, counts_.wrong_force, "force wrong by", error);
    if (r.contacts == 0) return;
    const auto segment =
        static_cast<std::size_t>(is_plain(walk_.tool) ? 0 : std::max(r.segment, 0));
    const Vec3 from = ideal_.place(walk_.tool[segment].from);
    const Vec3 to = ideal_.place(walk_.tool[segment].to);
    const double aside = distance_to_segment(r.deepest.point, from, to);
    const UnionOracle place(walk_.parts, {{Vec3(0), Vec3(0)}});
    const double above = -place.depth({r.deepest.point, Mat3(1)});
    // Equation (2) does not give a single place, but its point is over a face that the segment lies
    // along.
    const double most_above = r.deepest.type == rendering::ContactType::segment_face
                                  ? kSinBlend * glm::length(to - from)
                                  : 0;
    const double off = std::max({aside, above - most_above, -above});
    const double rounded = 1e-9 * (oracle_.size() + oracle_.reach());
    wrong(off > rounded, counts_.off_place, "contact off its place by", off);
  }

  /// The oracle from the same last pose.
  void compare(const rendering::Rendering& r, const OraclePose& last, const OraclePose& pose) {
    const OracleTick tick = oracle_.tick(last, pose);
    if (tick.failed || tick.lagged) return;
    ++counts_.compared;
    if (glm::length(tick.ideal.tip - ideal_.tip) > kMinimal * oracle_.size()) {
      ++counts_.elsewhere;
      return;
    }
    if (!tick.unique_shares) return;
    Vec3 torque;
    for (const OracleContact& contact : tick.contacts) {
      const OracleSegment& segment = walk_.tool[static_cast<std::size_t>(contact.segment)];
      const Vec3 along = glm::normalize(pose.axes * (segment.to - segment.from));
      if (near_flat(contact.part, along)) return;
      const Vec3 place = ideal_.place(segment.from) + 0.5 * (contact.first + contact.last) * along;
      torque += glm::cross(place - pose.tip, kSpring * contact.share * contact.normal);
    }
    ++counts_.torques;
    const double error = glm::length(torque - r.torque);
    wrong(error > 1e-6 * (1e-3 * kSpring * oracle_.size() + glm::length(r.force)) * oracle_.size(),
          counts_.wrong_torque, "torque wrong by", error);
  }

  bool near_flat(int part, const Vec3& along) const {
    const OraclePart& solid = walk_.parts[static_cast<std::size_t>(part)];
    return std::any_of(
        solid.mesh->facets().begin(), solid.mesh->facets().end(), [&](const stimuli::Facet& facet) {
          const Vec3 normal = solid.pose.orientation * facet.normal;
          return std::abs(std::numbers::pi / 2 - angle_between(normal, along)) < kPlane;
        });
  }

  bool wrong(bool is, std::uint64_t& count, const char* what, double value) {
    if (!is) return false;
    ++count;
    if (counts_.faults.size() >= SearchCounts::kFaultsKept) return true;
    std::ostringstream out;
    out.precision(17);
    out << walk_.parts.size() << " parts, " << walk_.tool.size() << " segments: " << what << " "
        << value << " (" << value / oracle_.size() << " sizes)";
    fault_.what = out.str();
    counts_.faults.push_back(fault_);
    return true;
  }

  const rendering::Renderer& renderer_;
  UnionWalk walk_;
  UnionOracle oracle_;
  rendering::Scene scene_;
  rendering::RenderState state_;
  OraclePose ideal_;
  SearchFault fault_;
  UnionCounts counts_;
};

}  // namespace

UnionCounts& UnionCounts::operator+=(const UnionCounts& other) {
  walks += other.walks;
  ticks += other.ticks;
  in_contact += other.in_contact;
  several += other.several;
  inside += other.inside;
  not_minimal += other.not_minimal;
  wrong_force += other.wrong_force;
  wrong_torque += other.wrong_torque;
  off_place += other.off_place;
  not_finite += other.not_finite;
  faulted += other.faulted;
  lagged += other.lagged;
  capped += other.capped;
  released += other.released;
  on_edge += other.on_edge;
  in_gap += other.in_gap;
  torques += other.torques;
  compared += other.compared;
  elsewhere += other.elsewhere;
  worst_penetration = std::max(worst_penetration, other.worst_penetration);
  worst_descent = std::max(worst_descent, other.worst_descent);
  for (const SearchFault& fault : other.faults) {
    if (faults.size() < SearchCounts::kFaultsKept) faults.push_back(fault);
  }
  return *this;
}

UnionCounts search_union(const rendering::Renderer& renderer, UnionWalk drawn, std::uint64_t seed,
                         std::uint64_t walk) {
  return UnionWalker(renderer, std::move(drawn), seed, walk).run();
}

UnionCounts search_union(const rendering::Renderer& renderer, std::uint64_t seed,
                         std::uint64_t walk) {
  return search_union(renderer, random_union_walk(seed, walk, kTicksPerWalk), seed, walk);
}

UnionCounts search_unions(std::uint64_t seed, std::uint64_t first_walk, std::uint64_t walks) {
  UnionCounts counts;
  for (std::uint64_t walk = first_walk; walk < first_walk + walks; ++walk) {
    counts += search_union(rendering::ray_renderer(), seed, walk);
  }
  return counts;
}

}  // namespace palpate::runner::evidence
