#include "runner/evidence/verification/surface_reference.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <numbers>
#include <tuple>
#include <utility>

#include "runner/evidence/verification/nearest_point.h"

namespace palpate::runner::evidence {
namespace {

// m, longest step of the search, for objects from 50 mm on; smaller ones get shorter steps.
constexpr double kStep = 1e-5, kStepOfSize = 2e-4;
constexpr double kSkin = 1e-9;                 // of the size
constexpr double kRounding = 1e-10;            // of the size; below the skin
constexpr int kMostParts = 4000;               // of a tick: 40 mm in a tick
constexpr int kMostSteps = 20000;              // of a search
constexpr double kPlane = 0.0348994967025010;  // sin of 2 degrees

Vec3 mixed(const Vec3& a, const Vec3& b, double share) { return a + share * (b - a); }

/// m, from a point to a segment.
double distance_to(const Vec3& p, const Vec3& from, const Vec3& to) {
  const Vec3 d = to - from;
  const double length2 = glm::dot(d, d);
  const double share = length2 > 0 ? std::clamp(glm::dot(p - from, d) / length2, 0.0, 1.0) : 0.0;
  return glm::distance(p, from + share * d);
}

/// Most that an end moved, m.
double motion_of(const Vec3& tip, std::span<const ReferenceSegment> rods, const Vec3& other_tip,
                 std::span<const ReferenceSegment> other) {
  double most = 0;
  for (std::size_t i = 0; i < rods.size(); ++i) {
    most = std::max({most, glm::distance(tip + rods[i].from, other_tip + other[i].from),
                     glm::distance(tip + rods[i].to, other_tip + other[i].to)});
  }
  return most;
}

}  // namespace

SurfaceReference::SurfaceReference(std::span<const ReferenceTriangle> triangles)
    : low_(HUGE_VAL), high_(-HUGE_VAL) {
  for (const ReferenceTriangle& t : triangles) {
    Face face;
    face.corners = t.corners;
    face.stiffness = t.stiffness;
    const auto& [a, b, c] = face.corners;
    face.normal = glm::normalize(glm::cross(b - a, c - a));
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 side = face.corners[(k + 1) % 3] - face.corners[k];
      face.inward[k] = glm::normalize(glm::cross(face.normal, side));
      face.convex[k] = true;
      low_ = glm::min(low_, face.corners[k]);
      high_ = glm::max(high_, face.corners[k]);
    }
    face.centre = (a + b + c) / 3.0;
    for (const Vec3& v : face.corners)
      face.radius = std::max(face.radius, glm::distance(face.centre, v));
    faces_.push_back(face);
  }
  size_ = glm::distance(low_, high_);
  step_ = std::min(kStep, kStepOfSize * size_);
  band_ = 2 * step_;
  skin_ = kSkin * size_;
  find_ridges(triangles);
}

void SurfaceReference::find_ridges(std::span<const ReferenceTriangle> triangles) {
  // Corners at one place of one shell are one.
  std::map<std::tuple<int, double, double, double>, std::uint32_t> numbers;
  const auto number = [&](int shell, const Vec3& v) {
    return numbers.try_emplace({shell, v.x, v.y, v.z}, static_cast<std::uint32_t>(numbers.size()))
        .first->second;
  };
  using Side = std::pair<std::uint32_t, std::size_t>;  // face, side
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<Side>> sides;
  std::vector<std::array<std::uint32_t, 3>> corners;
  for (std::uint32_t f = 0; f < faces_.size(); ++f) {
    std::array<std::uint32_t, 3> own{};
    for (std::size_t k = 0; k < 3; ++k) own[k] = number(triangles[f].shell, faces_[f].corners[k]);
    for (std::size_t k = 0; k < 3; ++k) sides[{own[k], own[(k + 1) % 3]}].push_back({f, k});
    corners.push_back(own);
  }
  std::vector<bool> only_convex(numbers.size(), true);
  struct Found {
    std::uint32_t from, to, left, right;
    std::size_t side;
  };
  std::vector<Found> found;
  for (const auto& [ends, there] : sides) {
    const auto back = sides.find({ends.second, ends.first});
    if (back == sides.end()) continue;
    for (const auto& [f, k] : there) {
      for (const auto& [g, j] : back->second) {
        Face& face = faces_[f];
        const Vec3 far = faces_[g].corners[(j + 2) % 3];
        const double height = glm::dot(face.normal, far - face.corners[k]);
        if (height > -kRounding * size_) face.convex[k] = false;
        if (height > kRounding * size_) {
          only_convex[ends.first] = only_convex[ends.second] = false;
        } else if (height < -kRounding * size_ && f < g) {
          found.push_back({ends.first, ends.second, f, g, k});
        }
      }
    }
  }
  for (const Found& one : found) {
    Ridge ridge;
    const Face& left = faces_[one.left];
    ridge.from = left.corners[one.side];
    ridge.to = left.corners[(one.side + 1) % 3];
    ridge.left = left.normal;
    ridge.right = faces_[one.right].normal;
    ridge.ends[0] = only_convex[one.from];
    ridge.ends[1] = only_convex[one.to];
    ridge.centre = 0.5 * (ridge.from + ridge.to);
    ridge.radius = 0.5 * glm::distance(ridge.from, ridge.to);
    ridge.stiffness = left.stiffness;
    ridges_.push_back(ridge);
  }
}

double SurfaceReference::winding(const Vec3& point) const {
  double sum = 0;
  for (const Face& face : faces_) {
    const Vec3 a = face.corners[0] - point, b = face.corners[1] - point,
               c = face.corners[2] - point;
    const double la = glm::length(a), lb = glm::length(b), lc = glm::length(c);
    sum += std::atan2(glm::dot(a, glm::cross(b, c)), la * lb * lc + glm::dot(a, b) * lc +
                                                         glm::dot(b, c) * la + glm::dot(c, a) * lb);
  }
  return sum / (2 * std::numbers::pi);
}

bool SurfaceReference::inside(const ReferenceTool& tool) const {
  constexpr int kPlaces = 33;
  for (const ReferenceSegment& rod : tool.rods) {
    const bool is_point = rod.from == rod.to;
    for (int i = 0; i <= (is_point ? 0 : kPlaces); ++i) {
      const Vec3 place = tool.tip + mixed(rod.from, rod.to, i / static_cast<double>(kPlaces));
      const bool off =
          glm::any(glm::lessThan(place, low_)) || glm::any(glm::greaterThan(place, high_));
      if (!off && winding(place) > 0.5) return true;
    }
  }
  return false;
}

bool SurfaceReference::far_from(const Near& near, std::span<const ReferenceSegment> rods,
                                double reach) const {
  return !near.filled || near.rods.size() != rods.size() ||
         motion_of(tip_, rods, near.tip, near.rods) + reach > near.room;
}

/// Lists what is near the ideal tool, twice: widely from all, closely from that.
void SurfaceReference::list_near(std::span<const ReferenceSegment> rods) {
  const auto fill = [&](Near& near, double room, const Near* from) {
    const auto is_near = [&](const Vec3& centre, double radius) {
      return std::ranges::any_of(rods, [&](const ReferenceSegment& rod) {
        return distance_to(centre, tip_ + rod.from, tip_ + rod.to) <= radius + room;
      });
    };
    const auto choose = [&](const auto& all, const std::vector<std::uint32_t>* of,
                            std::vector<std::uint32_t>& out) {
      out.clear();
      const std::size_t count = of ? of->size() : all.size();
      for (std::size_t i = 0; i < count; ++i) {
        const std::uint32_t index = of ? (*of)[i] : static_cast<std::uint32_t>(i);
        if (is_near(all[index].centre, all[index].radius)) out.push_back(index);
      }
    };
    choose(faces_, from ? &from->faces : nullptr, near.faces);
    choose(ridges_, from ? &from->ridges : nullptr, near.ridges);
    near.rods.assign(rods.begin(), rods.end());
    near.tip = tip_;
    near.room = room;
    near.filled = true;
  };
  const double close = 10 * band_, wide = 100 * band_;
  if (!far_from(close_, rods, band_)) return;
  if (far_from(wide_, rods, close)) {
    fill(wide_, wide, nullptr);
  }
  fill(close_, close, &wide_);
}

void SurfaceReference::collect_ends(const Face& face, const ReferenceSegment& rod,
                                    std::size_t index, double beyond) {
  const Vec3 d = rod.to - rod.from;
  const bool is_point = d == Vec3(0);
  const double slope = glm::dot(face.normal, d);
  for (int end = 0; end < (is_point ? 1 : 2); ++end) {
    if (!is_point && (end == 0 ? slope < 0 : slope > 0)) continue;  // the other end is lower
    const Vec3 relative = end == 0 ? rod.from : rod.to, place = tip_ + relative;
    const double height = glm::dot(face.normal, place - face.corners[0]);
    if (height < -band_ || height > band_) continue;
    bool over = true;
    for (std::size_t k = 0; k < 3 && over; ++k) {
      const double room = face.convex[k] ? kRounding * size_ : beyond;
      over = glm::dot(face.inward[k], place - face.corners[k]) >= -room;
    }
    if (!over) continue;
    bounds_.push_back({face.normal, glm::dot(face.normal, face.corners[0] - relative) + skin_,
                       face.stiffness, index, static_cast<double>(end),
                       !is_point && std::abs(slope) < kPlane * glm::length(d)});
  }
}

void SurfaceReference::collect_ridge(const Ridge& ridge, const ReferenceSegment& rod,
                                     std::size_t index, double beyond) {
  const Vec3 d = rod.to - rod.from, e = ridge.to - ridge.from;
  const double left = glm::dot(ridge.left, d), right = glm::dot(ridge.right, d);
  if (left * right > 0) return;  // not on the silhouette
  const Vec3 across = glm::cross(e, d);
  const double across2 = glm::dot(across, across), ee = glm::dot(e, e), dd = glm::dot(d, d);
  if (!(across2 > 1e-18 * ee * dd)) return;
  Vec3 normal = across / std::sqrt(across2);
  if (glm::dot(normal, ridge.left + ridge.right) < 0) normal = -normal;
  const Vec3 from = tip_ + rod.from;
  const double height = glm::dot(normal, from - ridge.from);
  if (height < -band_ || height > band_) return;
  const Vec3 w = from - ridge.from;
  const double along = glm::dot(glm::cross(w, e), across) / across2;
  const double on_edge = glm::dot(glm::cross(w, d), across) / across2;
  const double tiny = kRounding * size_;
  if (along * std::sqrt(dd) < -tiny || (along - 1) * std::sqrt(dd) > tiny) return;
  const auto room = [&](bool stops) { return (stops ? tiny : beyond) / std::sqrt(ee); };
  if (on_edge < -room(ridge.ends[0]) || on_edge > 1 + room(ridge.ends[1])) return;
  const double flat = kPlane * std::sqrt(dd);
  bounds_.push_back({normal, glm::dot(normal, ridge.from - rod.from) + skin_, ridge.stiffness,
                     index, std::clamp(along, 0.0, 1.0),
                     std::abs(left) < flat || std::abs(right) < flat});
}

void SurfaceReference::collect(std::span<const ReferenceSegment> rods, double beyond) {
  list_near(rods);
  bounds_.clear();
  for (std::size_t i = 0; i < rods.size(); ++i) {
    for (const std::uint32_t f : close_.faces) collect_ends(faces_[f], rods[i], i, beyond);
    if (rods[i].from == rods[i].to) continue;
    for (const std::uint32_t r : close_.ridges) collect_ridge(ridges_[r], rods[i], i, beyond);
  }
}

/// The place within all bounds that is nearest to the goal: the bound that is violated most joins
/// those that carry, until none is.
bool SurfaceReference::nearest(const Vec3& goal, Vec3& place) {
  held_.clear();
  multipliers_.clear();
  place = goal;
  const double tolerance = 1e-11 * size_;
  for (std::size_t round = 0; round <= 4 * bounds_.size() + 8; ++round) {
    std::size_t worst = bounds_.size();
    double least = -tolerance;
    for (std::size_t i = 0; i < bounds_.size(); ++i) {
      const double over = glm::dot(bounds_[i].normal, place) - bounds_[i].offset;
      if (over < least && std::ranges::find(held_, i) == held_.end()) {
        least = over;
        worst = i;
      }
    }
    if (worst == bounds_.size()) return true;
    held_.push_back(worst);
    std::vector<HalfSpace> planes;
    for (const std::size_t i : held_) planes.push_back({bounds_[i].normal, bounds_[i].offset});
    const auto found = nearest_point(goal, planes, tolerance);
    if (!found) return false;
    place = found->point;
    std::vector<std::size_t> carrying;
    multipliers_.clear();
    for (std::size_t i = 0; i < held_.size(); ++i) {
      if (!(found->multipliers[i] > 0)) continue;
      carrying.push_back(held_[i]);
      multipliers_.push_back(found->multipliers[i]);
    }
    held_ = std::move(carrying);
  }
  return false;
}

SurfaceReference::Descent SurfaceReference::descend(const Vec3& goal,
                                                    std::span<const ReferenceSegment> rods,
                                                    int most) {
  for (int i = 0; i < most; ++i) {
    // Just after a turn the tool may be in the solid by a step: there a valley's faces count beyond
    // their sides.
    collect(rods, i < 4 ? band_ : 2 * skin_);
    Vec3 place;
    if (!nearest(goal, place)) return Descent::stuck;
    const Vec3 way = place - tip_;
    const double length = glm::length(way);
    if (length > step_) {
      tip_ += step_ / length * way;
    } else {
      tip_ = place;
      if (i >= 4 && length <= 1e-12 * size_) return Descent::ended;
    }
  }
  return Descent::under_way;
}

ReferenceTick SurfaceReference::tick(const ReferenceTool& tool) {
  ReferenceTick out;
  const auto remember = [&] {
    last_tip_ = tool.tip;
    last_rods_.assign(tool.rods.begin(), tool.rods.end());
    started_ = true;
  };
  if (!started_ || !left_) {
    left_ = !inside(tool);
    lost_ = lost_ && !left_;
    out.known = !lost_;
    tip_ = tool.tip;
    remember();
    return out;
  }
  const bool touched = touching_;
  const double motion = motion_of(tool.tip, tool.rods, last_tip_, last_rods_);
  const int parts = std::clamp(static_cast<int>(std::ceil(motion / step_)), 1, kMostParts);
  out.known = motion <= step_ * kMostParts;
  std::vector<ReferenceSegment> rods = last_rods_, next(rods.size());
  for (int part = 1; part <= parts; ++part) {
    const double share = part / static_cast<double>(parts);
    for (std::size_t i = 0; i < rods.size(); ++i) {
      next[i] = {mixed(last_rods_[i].from, tool.rods[i].from, share),
                 mixed(last_rods_[i].to, tool.rods[i].to, share)};
    }
    const Vec3 goal = mixed(last_tip_, tool.tip, share);
    if (touching_) {  // turns about the place that it touches with
      const ReferenceSegment &before = rods[grasp_rod_], &after = next[grasp_rod_];
      tip_ +=
          mixed(before.from, before.to, grasp_along_) - mixed(after.from, after.to, grasp_along_);
    }
    rods = next;
    const Descent descent = descend(goal, rods, part == parts ? kMostSteps : 12);
    lost_ = lost_ || descent == Descent::stuck || (part == parts && descent != Descent::ended);
    touching_ = !held_.empty();
    double most = 0;
    for (std::size_t i = 0; i < held_.size(); ++i) {
      if (multipliers_[i] <= most) continue;
      most = multipliers_[i];
      grasp_rod_ = bounds_[held_[i]].rod;
      grasp_along_ = bounds_[held_[i]].along;
    }
  }
  // A contact may only end outside.
  lost_ = lost_ || !out.known || (touched && !touching_ && inside(tool));
  if (lost_) {
    out.known = left_ = touching_ = false;
    remember();
    return out;
  }
  out.touching = touching_;
  out.shift = tip_ - tool.tip;
  for (std::size_t i = 0; i < held_.size(); ++i) {
    const Bound& bound = bounds_[held_[i]];
    const Vec3 force = bound.stiffness * multipliers_[i] * bound.normal;
    const ReferenceSegment& rod = tool.rods[bound.rod];
    out.force += force;
    out.torque += glm::cross(out.shift + mixed(rod.from, rod.to, bound.along), force);
    out.torque_defined = out.torque_defined && !bound.flat;
  }
  remember();
  return out;
}

}  // namespace palpate::runner::evidence
