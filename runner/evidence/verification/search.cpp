#include "runner/evidence/verification/search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <iterator>
#include <limits>
#include <memory>
#include <numbers>
#include <sstream>
#include <utility>
#include <vector>

#include "rendering/first_contact.h"
#include "runner/evidence/verification/nearest_point.h"
#include "runner/evidence/verification/random_solids.h"
#include "runner/evidence/verification/reference.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/orientation.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"

namespace palpate::runner::evidence {
namespace {

/// Relative to the contact's force; levers relative to the lengths from which they were computed.
double force_error(const rendering::Renderer& renderer, const rendering::LineProbe& probe,
                   const rendering::Rendering& r, double stiffness, double size) {
  const double full = stiffness * r.deepest.depth;
  if (full == 0) return glm::length(r.force) + glm::length(r.torque);
  const double lever = size + glm::length(probe.tip) + glm::length(probe.tail);
  const Vec3 moment =
      renderer.side_contact() ? glm::cross(r.deepest.point - probe.tip, r.force) : Vec3(0);
  const Vec3 by_devices = glm::cross(probe.tail - probe.tip, r.device2);
  return std::max({glm::length(r.force - full * r.deepest.normal) / full,
                   std::abs(glm::length(r.deepest.normal) - 1),
                   glm::length(r.device1 + r.device2 - r.force) / full,
                   glm::length(r.torque - moment) / (full * lever),
                   glm::length(r.torque - by_devices) / (full * lever)});
}

constexpr int kFineSteps = 100;       // of a tick, by brute force
constexpr double kFastestTurn = 0.1;  // rad a tick: 100 rad/s, faster than any hand
constexpr double kAtSurface = 1e-6;   // sizes

rendering::LineProbe interpolated(const rendering::LineProbe& a, const rendering::LineProbe& b,
                                  double t) {
  return {a.tip + t * (b.tip - a.tip), a.tail + t * (b.tail - a.tail)};
}

/// The part of the probe that can touch, in the frame of the part's mesh: for the point renderer
/// the tip alone.
rendering::LineProbe felt_probe(const rendering::Scene& scene, const rendering::Renderer& renderer,
                                const rendering::LineProbe& probe) {
  const rendering::ScenePart& part = scene.parts()[0];
  const Vec3 tip = part.local_point(probe.tip);
  return {tip, renderer.side_contact() ? part.local_point(probe.tail) : tip};
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

constexpr double kStylus = 0.12;  // m, of a stylus that carries a tool
constexpr double kGrid = 0.01;    // m

/// Along the axes, exactly in the planes of boxes: no turning.
std::vector<OraclePose> aligned_path(Random& random, const OracleParts& parts, std::size_t ticks) {
  const Mat3 turns[] = {Mat3(1), Mat3(Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(1, 0, 0)),
                        Mat3(Vec3(0, 0, -1), Vec3(0, 1, 0), Vec3(1, 0, 0)),
                        Mat3(Vec3(1, 0, 0), Vec3(0, -1, 0), Vec3(0, 0, -1))};
  OraclePose at{Vec3(-0.5), turns[random.below(std::size(turns))]};
  std::vector<OraclePose> path{at};
  while (path.size() < ticks) {
    const auto& vertices = parts[random.below(parts.size())].mesh->vertices();
    const Vec3 corner = vertices[random.below(vertices.size())];
    for (int k = 0; k < 3; ++k) {
      const auto axis = static_cast<int>(random.below(3));
      const double to = corner[axis] + (random.below(2) == 0 ? 0 : 0.02 * (random.unit() - 0.5));
      const double from = at.tip[axis];
      const int steps = path.size() == 1 ? 1 : static_cast<int>(1 + random.below(60));
      for (int step = 1; step <= steps && path.size() < ticks; ++step) {
        at.tip[axis] = step == steps ? to : from + step * (to - from) / steps;
        path.push_back(at);
      }
    }
  }
  return path;
}

/// Takes numbers from bytes; 0 once all are used.
class Bytes {
 public:
  explicit Bytes(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  bool any() const { return at_ < bytes_.size(); }
  int below(int bound) { return any() ? bytes_[at_++] % bound : 0; }
  Vec3 grid_point(int reach) {
    const int x = below(2 * reach + 1), y = below(2 * reach + 1), z = below(2 * reach + 1);
    return kGrid * Vec3(x - reach, y - reach, z - reach);
  }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

OraclePart grid_part(Bytes& bytes) {
  stimuli::PolygonSoup soup = stimuli::cube(1);
  const Vec3 low = bytes.grid_point(3);
  Vec3 size;
  for (int k = 2; k >= 0; --k) size[k] = kGrid * (1 + bytes.below(4));
  for (Vec3& v : soup.vertices) v = low + (v + Vec3(0.5)) * size;
  if (bytes.below(3) == 0) {  // shift its upper side along x: slopes
    for (Vec3& v : soup.vertices) {
      if (v.z > low.z + 0.5 * size.z) v.x += kGrid;
    }
  }
  return part_of(soup);
}

constexpr double kSpring = 800;                       // N/m
constexpr double kInside = 1e-12, kMinimal = 1e-9;    // sizes
constexpr double kTouchingSizes = 1e-11;              // sizes
constexpr double kFlat = 2 * std::numbers::pi / 180;  // rad
const double kSinBlend = std::sin(kFlat / 2);         // of equation (2)
constexpr double kTurned = 1e-9;                      // rad; less is rounding
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
bool all_finite(const rendering::Rendering& r) {
  return finite(r.force) && finite(r.torque) && finite(r.device1) && finite(r.device2) &&
         finite(r.deepest.point) && finite(r.deepest.normal) && std::isfinite(r.deepest.depth) &&
         std::isfinite(r.deepest.along) && finite(r.ideal.tip) && finite(r.ideal.tail) &&
         finite(r.ideal_side);
}

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
          return std::abs(std::numbers::pi / 2 - angle_between(normal, along)) < kFlat;
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

TickAudit audit_tick(const rendering::Scene& scene, const rendering::Renderer& renderer,
                     const rendering::LineProbe& probe, const rendering::Rendering& r,
                     double rounding) {
  const rendering::ScenePart& part = scene.parts()[0];
  const stimuli::ConvexMesh& mesh = *part.mesh;
  TickAudit audit;
  audit.tolerance =
      rounding * mesh.size() + 1e-15 * (mesh.size() + glm::length(part.position) +
                                        glm::length(probe.tip) + glm::length(probe.tail));
  audit.finite = all_finite(r);
  if (!audit.finite) return audit;
  audit.depth = reference_depth(mesh, felt_probe(scene, renderer, probe)).depth;
  if (r.contacts == 0) {
    audit.missed = std::max(0.0, audit.depth);
    audit.force = glm::length(r.force) + glm::length(r.torque) + glm::length(r.device1) +
                  glm::length(r.device2);
    return audit;
  }
  const rendering::LineProbe ideal = felt_probe(scene, renderer, r.ideal);
  audit.penetrates = std::max(0.0, reference_depth(mesh, ideal).depth);
  audit.floats = reference_gap(mesh, ideal);
  audit.shallow = std::max(0.0, audit.depth - r.deepest.depth);
  audit.force = force_error(renderer, probe, r, part.material.stiffness, mesh.size());
  return audit;
}

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

UnionWalk random_union_walk(std::uint64_t seed, std::uint64_t walk, std::size_t ticks) {
  Random random(seed, {walk, 0x756e});
  const auto kind = random.below(8);
  if (kind == 0) {
    std::vector<std::uint8_t> bytes(400);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random.below(256));
    return grid_walk(bytes, ticks);
  }
  UnionWalk drawn;
  drawn.parts = random_cluster(random, 3 + static_cast<int>(random.below(6)));
  drawn.tool = random_tool(random, 1 + static_cast<int>(walk % 3));
  const double speeds[] = {1e-4, 3e-4, 1e-3, 5e-3};  // m a tick: 0.1 to 5 m/s at 1 kHz
  const double speed = speeds[random.below(std::size(speeds))];
  drawn.coincident = kind == 1;
  drawn.path = kind == 1 ? aligned_path(random, drawn.parts, ticks)
                         : random_tool_path(random, drawn.parts, drawn.tool, speed, ticks);
  return drawn;
}

UnionWalk grid_walk(std::span<const std::uint8_t> data, std::size_t most_ticks) {
  Bytes bytes(data);
  UnionWalk walk;
  walk.coincident = true;
  const int parts = 2 + bytes.below(6), segments = 1 + bytes.below(3);
  for (int i = 0; i < parts; ++i) walk.parts.push_back(grid_part(bytes));
  walk.tool.push_back({Vec3(0), Vec3(0, 0, kGrid * (2 + bytes.below(8)))});
  while (static_cast<int>(walk.tool.size()) < segments) {
    const Vec3 from = bytes.grid_point(2), to = bytes.grid_point(2);
    walk.tool.push_back({from, from == to ? from + Vec3(kGrid, 0, 0) : to});
  }
  // Starts far above; the tip moves along the axes from one multiple of 5 mm to another, in steps
  // of whole millimetres.
  std::array<int, 3> place{0, 0, 300};  // mm
  Quat turned(1, 0, 0, 0);
  const auto add = [&] {
    if (walk.path.size() >= most_ticks) return;
    walk.path.push_back({1e-3 * Vec3(place[0], place[1], place[2]), glm::mat3_cast(turned)});
  };
  add();
  place[2] = 60;
  while (bytes.any() && walk.path.size() < most_ticks) {
    const auto axis = static_cast<std::size_t>(bytes.below(3));
    if (bytes.below(4) == 0) {
      const int steps = 1 + bytes.below(30);
      const double angle = std::numbers::pi / 4 * (bytes.below(5) - 2) / steps;
      Vec3 about(0);
      about[static_cast<int>(axis)] = 1;
      for (int i = 0; i < steps; ++i) {
        turned = glm::normalize(glm::angleAxis(angle, about) * turned);
        add();
      }
    } else {
      const int to = 5 * (bytes.below(15) - 7), step = 1 + bytes.below(4);
      while (place[axis] != to) {
        place[axis] += std::clamp(to - place[axis], -step, step);
        add();
      }
    }
  }
  return walk;
}

bool is_plain(const OracleTool& tool) { return tool.size() == 1; }

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
