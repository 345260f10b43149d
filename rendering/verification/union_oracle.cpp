#include "rendering/verification/union_oracle.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <utility>

#include "rendering/verification/nearest_point.h"
#include "rendering/verification/union_descent.h"

namespace palpate::rendering {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// An edge this nearly parallel to the segment spans no facet with it.
constexpr double kParallelSine = 1e-9;

// Fraction of the largest length in play that counts as touching.
constexpr double kTouching = 1e-13;

// Of the thinnest part: the turn is cut into steps in which no point of the tool moves further, and
// pushing the turned tool out may not move it further either, or it could come out elsewhere.
constexpr double kStep = 0.25;
constexpr int kMostSteps = 1000;  // of a turn
constexpr int kHalvings = 8;      // of the step at which the turn gets stuck

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
      for (const Solid::Edge& edge : solid.edges) {  // with the segment, where it is a silhouette
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

/// \return false when it could not be turned the whole way
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
  constexpr double kMostLeverage = 1e9;  // beyond it facets that are parallel are not, by rounding
  const std::vector<OracleSum> all = sums(ideal.axes);
  return Descent(all, virtual_tip, touching).unbalanced(ideal.tip, kMostLeverage) <= least;
}

}  // namespace palpate::rendering
