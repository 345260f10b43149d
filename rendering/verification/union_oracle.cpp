#include "rendering/verification/union_oracle.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <utility>
#include <vector>

#include "rendering/verification/nearest_point.h"

namespace palpate::rendering {

// Steepest descent of a point towards another one outside convex sums, each given by all of its
// planes.

/// Fraction of the touching distance by which a goal may lie below a plane.
inline constexpr double kRoundingOfTouching = 1e-2;

/// The next goal of the tip.
struct Choice {
  std::vector<const OracleSum*> touched;
  std::vector<HalfSpace> planes;  ///< one facet of each touched sum
  NearestPoint goal;              ///< above the planes
  bool on_one_facet_each = true;  ///< no sum is touched on an edge
};

/// Steepest descent of the distance from the virtual tip. Near the tip, the free space is the
/// union, over all choices of one touched facet of every touched sum, of the space above those
/// facets. The steepest choice is the one whose nearest point is closest to the virtual tip.
class Descent {
 public:
  /// \param touching  m; sums no further away are touched
  Descent(const std::vector<OracleSum>& sums, const Vec3& virtual_tip, double touching)
      : sums_(sums), virtual_tip_(virtual_tip), touching_(touching) {}

  /// The tip's goal if the touched facets were infinite and nothing else were in the way.
  /// \return false if rounding leaves no such point
  bool goal(const Vec3& tip, Choice& best);

  /// m, the residual of the way from the virtual tip after non-negative multiples of the normals of
  /// touched facets, each at most `most_multiple` times as long as the way.
  double unbalanced(const Vec3& tip, double most_multiple) const;

  /// The share of the straight way to the goal that lies outside all sums, 0 to 1. The facets of
  /// the choice bound the touched sums.
  double free_way(const Vec3& tip, const Vec3& goal) const;

 private:
  struct Touched {
    const OracleSum* sum;
    std::vector<std::size_t> facets;
  };

  void choose(std::size_t next, std::vector<HalfSpace>& planes, Choice& best);
  double slides_off(const OracleSum& sum, const Vec3& tip, const Vec3& goal) const;

  const std::vector<OracleSum>& sums_;
  Vec3 virtual_tip_;
  double touching_;
  std::vector<Touched> touched_;
  double best_distance_ = 0;
  bool in_crack_ = false;
};

namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();

// Sine of half the opening of the narrowest groove that can hold a tool.
constexpr double kNarrowest = 1e-5;

/// The facets of the sum that the tip touches; empty if it touches none.
std::vector<std::size_t> touched_facets(const OracleSum& sum, const Vec3& tip, double touching) {
  const double height = sum.height(tip);
  std::vector<std::size_t> facets;
  if (height > touching) return facets;
  for (std::size_t i = 0; i < sum.planes.size(); ++i) {
    if (sum.planes[i].height(tip) >= std::min(height, -touching)) facets.push_back(i);
  }
  return facets;
}

/// Whether the choice leaves free space. Between two abutting parts, the plane of their common face
/// is above a facet of both, but a crack without room is not free space.
bool leaves_room(const std::vector<HalfSpace>& planes) {
  std::vector<HalfSpace> raised;  // the cone of directions, out of each plane by 1
  raised.reserve(planes.size());
  for (const HalfSpace& plane : planes) raised.push_back({plane.normal, 1});
  const auto out = nearest_point(Vec3(0), raised, 1e-6);
  return out && glm::length(out->point) < 1 / kNarrowest;
}

/// Fraction of the way at which it enters a sum from outside; 1 if it does not.
double entry(const OracleSum& sum, const Vec3& tip, const Vec3& goal) {
  double enters = 0, leaves = kUnbounded;
  for (const OraclePlane& plane : sum.planes) {
    const double before = plane.height(tip), after = plane.height(goal);
    if (before > 0 && after >= before) return 1;
    if (before > 0) {
      enters = std::max(enters, before / (before - after));
    } else if (after > before) {
      leaves = std::min(leaves, before / (before - after));
    }
  }
  return enters < leaves ? std::min(enters, 1.0) : 1.0;
}

}  // namespace

bool Descent::goal(const Vec3& tip, Choice& best) {
  touched_.clear();
  for (const OracleSum& sum : sums_) {
    std::vector<std::size_t> facets = touched_facets(sum, tip, touching_);
    if (!facets.empty()) touched_.push_back({&sum, std::move(facets)});
  }
  best_distance_ = kUnbounded;
  std::vector<HalfSpace> planes;
  in_crack_ = false;
  choose(0, planes, best);
  if (best_distance_ < kUnbounded) return true;
  in_crack_ = true;  // a tool that fits a gap exactly can move in it
  choose(0, planes, best);
  return best_distance_ < kUnbounded;
}

/// Tries every choice of one facet of each touched sum from `next` on.
void Descent::choose(std::size_t next, std::vector<HalfSpace>& planes, Choice& best) {
  const auto nearest = nearest_point(virtual_tip_, planes, kRoundingOfTouching * touching_);
  if (!nearest) return;
  const double distance = glm::length(nearest->point - virtual_tip_);
  if (distance >= best_distance_) return;
  if (next == touched_.size()) {
    best_distance_ = distance;
    best = {{}, planes, *nearest};
    for (const Touched& touched : touched_) {
      best.touched.push_back(touched.sum);
      best.on_one_facet_each &= touched.facets.size() == 1;
    }
    return;
  }
  const Touched& touched = touched_[next];
  for (const std::size_t facet : touched.facets) {
    planes.push_back({touched.sum->planes[facet].normal, touched.sum->planes[facet].offset});
    if (in_crack_ || leaves_room(planes)) choose(next + 1, planes, best);
    planes.pop_back();
  }
}

double Descent::unbalanced(const Vec3& tip, double most_multiple) const {
  std::vector<Vec3> normals;
  for (const OracleSum& sum : sums_) {
    for (const std::size_t facet : touched_facets(sum, tip, touching_)) {
      const Vec3& normal = sum.planes[facet].normal;
      const bool known = std::any_of(normals.begin(), normals.end(), [&](const Vec3& other) {
        return glm::length(other - normal) < 1e-15;
      });
      if (!known) normals.push_back(normal);
    }
  }
  return distance_to_cone(tip - virtual_tip_, normals, most_multiple);
}

double Descent::free_way(const Vec3& tip, const Vec3& goal) const {
  double way = 1;
  for (const OracleSum& sum : sums_) {
    if (sum.height(tip) > touching_) {
      way = std::min(way, entry(sum, tip, goal));
    } else {
      way = std::min(way, slides_off(sum, tip, goal));
    }
  }
  return way;
}

/// Fraction of the way at which it leaves the touched facets of a sum over a side; 1 if it does
/// not.
double Descent::slides_off(const OracleSum& sum, const Vec3& tip, const Vec3& goal) const {
  double way = 1;
  for (const OraclePlane& plane : sum.planes) {
    const double before = plane.height(tip), after = plane.height(goal);
    if (before >= -touching_) {
      if (after > touching_) return 1;  // it moves off the sum
    } else if (after > 0) {
      way = std::min(way, before / (before - after));
    }
  }
  return way;
}

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// An edge this nearly parallel to the segment spans no facet with it.
constexpr double kParallelSine = 1e-9;

// Touching distance, as a fraction of the largest length involved.
constexpr double kTouching = 1e-13;

// Of the thinnest part. The turn is cut into steps in which no point of the tool moves farther than
// this. Pushing the turned tool out may not move it farther either, or it could come out elsewhere.
constexpr double kStep = 0.25;
constexpr int kMostSteps = 1000;  // of a turn
constexpr int kHalvings = 8;      // of the step in which the turn gets stuck

constexpr int kMostRounds = 5000;  // of a descent

/// Pushes the tip out of the sums, each time along the nearest facet of the deepest one, to the
/// nearest point above all facets met so far. \return false when it stays inside
bool push_out(const std::vector<OracleSum>& sums, Vec3& tip, double touching) {
  constexpr std::size_t kMostFacets = 24;
  std::vector<HalfSpace> met;
  Vec3 at = tip;
  while (true) {
    const OraclePlane* nearest = nullptr;
    double deepest = -touching;
    for (const OracleSum& sum : sums) {
      if (sum.height(at) >= deepest) continue;
      deepest = sum.height(at);
      nearest = &*std::max_element(
          sum.planes.begin(), sum.planes.end(),
          [&](const OraclePlane& a, const OraclePlane& b) { return a.height(at) < b.height(at); });
    }
    if (nearest == nullptr) break;
    if (met.size() == kMostFacets) return false;
    met.push_back({nearest->normal, nearest->offset});
    const auto out = nearest_point(tip, met, kRoundingOfTouching * touching);
    if (!out) return false;
    at = out->point;
  }
  tip = at;
  return true;
}

/// The rotation a fraction of the way between two.
Mat3 between(const Mat3& from, const Mat3& to, double fraction) {
  return glm::mat3_cast(glm::slerp(glm::quat_cast(from), glm::quat_cast(to), fraction));
}

double angle_between(const Mat3& a, const Mat3& b) {
  const Quat turn = glm::quat_cast(glm::transpose(a) * b);
  return 2 * std::atan2(glm::length(Vec3(turn.x, turn.y, turn.z)), std::abs(turn.w));
}

}  // namespace

double OraclePlane::height(const Vec3& x) const { return glm::dot(normal, x) - offset; }

double OracleSum::height(const Vec3& tip) const {
  double highest = -kInfinity;
  for (const OraclePlane& plane : planes) highest = std::max(highest, plane.height(tip));
  return highest;
}

UnionOracle::UnionOracle(const std::vector<OraclePart>& parts, std::vector<OracleSegment> tool)
    : tool_(std::move(tool)) {
  thickness_ = kInfinity;
  double furthest = 0;
  for (const OraclePart& part : parts) {
    const auto world = [&](const Vec3& local) {
      return part.pose.orientation * local + part.pose.position;
    };
    Solid& solid = solids_.emplace_back();
    for (const stimuli::Facet& facet : part.mesh->facets()) {
      const Vec3 normal = glm::normalize(part.pose.orientation * facet.normal);
      solid.planes.push_back({normal, facet.offset + glm::dot(normal, part.pose.position)});
      double lowest = kInfinity;
      for (const Vec3& v : part.mesh->vertices()) {
        lowest = std::min(lowest, glm::dot(facet.normal, v));
      }
      thickness_ = std::min(thickness_, facet.offset - lowest);
    }
    for (const stimuli::Edge& edge : part.mesh->edges()) {
      solid.edges.push_back({world(edge.from), world(edge.to), edge.left, edge.right});
    }
    for (const Vec3& v : part.mesh->vertices()) {
      furthest = std::max(furthest, glm::length(world(v)));
    }
    size_ = std::max(size_, part.mesh->size());
  }
  for (const OracleSegment& segment : tool_) {
    reach_ = std::max({reach_, glm::length(segment.from), glm::length(segment.to)});
  }
  touch_ = kTouching * (size_ + reach_ + furthest);
}

std::vector<OracleSum> UnionOracle::sums(const Mat3& axes) const {
  std::vector<OracleSum> all;
  for (std::size_t i = 0; i < solids_.size(); ++i) {
    for (std::size_t j = 0; j < tool_.size(); ++j) {
      const Solid& solid = solids_[i];
      const Vec3 from = axes * tool_[j].from, to = axes * tool_[j].to, along = to - from;
      OracleSum sum{static_cast<int>(i), static_cast<int>(j), {}};
      for (const OraclePlane& facet : solid.planes) {  // with the deeper end
        const double deeper = std::min(glm::dot(facet.normal, from), glm::dot(facet.normal, to));
        sum.planes.push_back({facet.normal, facet.offset - deeper});
      }
      for (const Solid::Edge& edge : solid.edges) {  // with the segment, if it is a silhouette edge
        const Vec3 &left = solid.planes[edge.left].normal, &right = solid.planes[edge.right].normal;
        const double left_rate = glm::dot(left, along), right_rate = glm::dot(right, along);
        if ((left_rate >= 0) == (right_rate >= 0)) continue;
        const Vec3 across = glm::cross(edge.to - edge.from, along);
        const double span = glm::length(across);
        if (span <= kParallelSine * glm::length(edge.to - edge.from) * glm::length(along)) continue;
        const Vec3 out = std::abs(right_rate) * left + std::abs(left_rate) * right;
        const Vec3 normal = (glm::dot(across, out) > 0 ? 1 : -1) / span * across;
        sum.planes.push_back({normal, glm::dot(normal, edge.from) - glm::dot(normal, from)});
      }
      all.push_back(std::move(sum));
    }
  }
  return all;
}

double UnionOracle::depth(const OraclePose& tool) const {
  double deepest = -kInfinity;
  for (const OracleSum& sum : sums(tool.axes)) deepest = std::max(deepest, -sum.height(tool.tip));
  return deepest;
}

/// \return false if the whole turn was not possible
bool UnionOracle::turn(OraclePose& ideal, const Mat3& to) const {
  const double angle = angle_between(ideal.axes, to);
  const double steps =
      std::clamp(std::ceil(angle * reach_ / (kStep * thickness_)), 1.0, double{kMostSteps});
  const Mat3 start = ideal.axes;
  const auto try_to = [&](double fraction) {
    OraclePose turned{ideal.tip, fraction < 1 ? between(start, to, fraction) : to};
    if (!push_out(sums(turned.axes), turned.tip, touch_) ||
        glm::length(turned.tip - ideal.tip) > kStep * thickness_) {
      return false;
    }
    ideal = turned;
    return true;
  };
  for (double step = 1; step <= steps; ++step) {
    if (try_to(step / steps)) continue;
    for (int halving = 1; halving <= kHalvings; ++halving) {
      if (try_to((step - 1 + std::ldexp(1, -halving)) / steps)) break;
    }
    return false;
  }
  return true;
}

OracleTick UnionOracle::tick(const OraclePose& last_ideal, const OraclePose& virtual_tool) const {
  OracleTick result;
  result.ideal = last_ideal;
  result.lagged = !turn(result.ideal, virtual_tool.axes);
  const std::vector<OracleSum> all = sums(result.ideal.axes);
  Descent descent(all, virtual_tool.tip, touch_);
  Vec3& tip = result.ideal.tip;
  for (;; ++result.rounds) {
    Choice choice;
    if (result.rounds == kMostRounds || !descent.goal(tip, choice)) {
      result.failed = true;
      break;
    }
    const Vec3& goal = choice.goal.point;
    const bool there = glm::length(goal - tip) <= touch_;
    const double way = there ? 1 : descent.free_way(tip, goal);
    tip = way < 1 ? tip + way * (goal - tip) : goal;
    if (!there) continue;
    for (std::size_t i = 0; i < choice.planes.size(); ++i) {
      if (choice.goal.multipliers[i] <= 0) continue;
      OracleContact contact{choice.touched[i]->part, choice.touched[i]->segment,
                            choice.planes[i].normal, choice.goal.multipliers[i]};
      touching_portion(result.ideal, contact);
      result.contacts.push_back(contact);
    }
    result.unique_shares =
        result.contacts.size() == choice.touched.size() && choice.on_one_facet_each;
    break;
  }
  return result;
}

void UnionOracle::touching_portion(const OraclePose& ideal, OracleContact& contact) const {
  const OracleSegment& segment = tool_[static_cast<std::size_t>(contact.segment)];
  const Vec3 from = ideal.place(segment.from), to = ideal.place(segment.to);
  double first = 0, last = 1;
  for (const OraclePlane& plane : solids_[static_cast<std::size_t>(contact.part)].planes) {
    const double a = plane.height(from) - 2 * touch_, b = plane.height(to) - 2 * touch_;
    if (a > 0 && b < a) first = std::max(first, a / (a - b));
    if (b > 0 && a < b) last = std::min(last, a / (a - b));
  }
  contact.first = first * glm::length(to - from);
  contact.last = std::max(first, last) * glm::length(to - from);
}

OracleAudit UnionOracle::audit(const OraclePose& ideal, const Vec3& virtual_tip,
                               double touching) const {
  OracleAudit audit;
  const std::vector<OracleSum> all = sums(ideal.axes);
  for (const OracleSum& sum : all) {
    audit.penetration = std::max(audit.penetration, -sum.height(ideal.tip));
  }
  Choice choice;
  Descent descent(all, virtual_tip, touching);
  audit.unbalanced = descent.unbalanced(ideal.tip, 1e5);
  audit.descent = descent.goal(ideal.tip, choice) ? glm::length(choice.goal.point - ideal.tip)
                                                  : std::numeric_limits<double>::quiet_NaN();
  return audit;
}

bool UnionOracle::held_in_gap(const OraclePose& ideal, const Vec3& virtual_tip, double touching,
                              double least) const {
  constexpr double kMostLeverage = 1e9;  // more: rounding tilts parallel facets
  const std::vector<OracleSum> all = sums(ideal.axes);
  return Descent(all, virtual_tip, touching).unbalanced(ideal.tip, kMostLeverage) <= least;
}

}  // namespace palpate::rendering
