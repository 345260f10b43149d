#include "rendering/verification/union_descent.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

namespace palpate::rendering {
namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();

// Sine of half the opening of the narrowest groove that a tool can be in.
constexpr double kNarrowest = 1e-5;

/// The facets of the sum that the tip touches; empty where it does not touch the sum.
std::vector<std::size_t> touched_facets(const OracleSum& sum, const Vec3& tip, double touching) {
  const double height = sum.height(tip);
  std::vector<std::size_t> facets;
  if (height > touching) return facets;
  for (std::size_t i = 0; i < sum.planes.size(); ++i) {
    if (sum.planes[i].height(tip) >= std::min(height, -touching)) facets.push_back(i);
  }
  return facets;
}

/// Between two parts that abut, the plane of their common face is above a facet of both: a crack
/// without room is not free space.
bool leaves_room(const std::vector<HalfSpace>& planes) {
  std::vector<HalfSpace> raised;  // the cone of directions, out of each plane by 1
  raised.reserve(planes.size());
  for (const HalfSpace& plane : planes) raised.push_back({plane.normal, 1});
  const auto out = nearest_point(Vec3(0), raised, 1e-6);
  return out && glm::length(out->point) < 1 / kNarrowest;
}

/// Where the way enters a sum from outside; 1 where it does not.
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
  in_crack_ = true;  // a tool that fits exactly into a gap can move in it
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

/// Where the way leaves the touched facets of a sum over a side; 1 where it does not.
double Descent::slides_off(const OracleSum& sum, const Vec3& tip, const Vec3& goal) const {
  double way = 1;
  for (const OraclePlane& plane : sum.planes) {
    const double before = plane.height(tip), after = plane.height(goal);
    if (before >= -touching_) {
      if (after > touching_) return 1;  // it leaves the sum
    } else if (after > 0) {
      way = std::min(way, before / (before - after));
    }
  }
  return way;
}

}  // namespace palpate::rendering
