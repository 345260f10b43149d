// Every ball inside the union lies in a convex set inside the union. So the inset of the union is
// the union of the insets of all such sets, and a few large ones suffice: the parts, each grown
// through its faces on other parts, and near concave edges the sets behind planes through the edge.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <glm/geometric.hpp>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "data/base/random.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/inset.h"
#include "stimuli/parts/convex_sets.h"
#include "stimuli/polygon_soup.h"

namespace palpate::stimuli {
namespace {

constexpr double kAbuts = 1e-6;                 // of the size; nearer parts touch
constexpr double kTurn = std::numbers::pi / 8;  // rad, between planes through a concave edge
constexpr double kUnderEdge = 1.07;             // of the depth: planes at kTurn do better
constexpr int kPlaces = 5, kDirections = 200;   // along an edge; about a point
constexpr int kSamples = 4000;

/// Where two faces of different parts meet at more than 180 degrees of the solid.
struct Notch {
  Vec3 from, to;       // m
  Vec3 first, second;  // unit, outward normals
};

class UnionInset {
 public:
  UnionInset(const std::vector<MeshPointer>& parts, double depth)
      : parts_(parts), depth_(depth), growth_(parts, kAbuts), tolerance_(growth_.tolerance()) {
    const double turn = std::numbers::pi * (3 - std::sqrt(5.0));  // a spiral over the sphere
    for (int i = 0; i < kDirections; ++i) {
      const double z = 1 - (2 * i + 1.0) / kDirections, r = std::sqrt(1 - z * z);
      directions_.emplace_back(r * std::cos(turn * i), r * std::sin(turn * i), z);
    }
  }

  double largest_ball() const {
    double radius = 0;
    for (const MeshPointer& part : parts_)
      radius = std::max(
          radius, largest_inscribed_ball(*growth_.grown(whole(part), parts_, {}).mesh).radius);
    return radius;
  }

  std::vector<MeshPointer> made() {
    for (const MeshPointer& part : parts_) {
      const ConvexSet set = growth_.grown(whole(part), parts_, {});
      add(set);
      if (set.mesh != part) beyond_.push_back(set.mesh);
    }
    beyond_.insert(beyond_.end(), parts_.begin(), parts_.end());
    find_notches();
    std::vector<Vec3> missing = missing_points();
    while (!missing.empty()) {
      if (!add_around(missing.back())) refuse(missing.back());
      std::erase_if(missing, [&](const Vec3& p) { return covered(p); });
    }
    return out_;
  }

 private:
  bool in_union(const Vec3& p) const {
    return std::any_of(parts_.begin(), parts_.end(), [&](const MeshPointer& part) {
      return height_over(*part, p) <= tolerance_;
    });
  }
  bool covered(const Vec3& p) const {
    return std::any_of(out_.begin(), out_.end(), [&](const MeshPointer& mesh) {
      return height_over(*mesh, p) <= tolerance_;
    });
  }
  /// Whether a ball about the point is inside of the union, slits between parts included.
  bool deep(const Vec3& p, double radius) const {
    for (const MeshPointer& part : parts_) {  // the nearest face decides most
      const Facet& nearest = *std::max_element(
          part->facets().begin(), part->facets().end(), [&](const Facet& a, const Facet& b) {
            return glm::dot(a.normal, p) - a.offset < glm::dot(b.normal, p) - b.offset;
          });
      const double height = glm::dot(nearest.normal, p) - nearest.offset;
      if (height <= -radius) return true;
      if (height <= 0 && !reaches(p, radius * nearest.normal)) return false;
    }
    return in_union(p) && std::all_of(directions_.begin(), directions_.end(),
                                      [&](const Vec3& to) { return reaches(p, radius * to); });
  }
  /// Whether the straight way is inside of the union.
  bool reaches(const Vec3& from, const Vec3& way) const {
    double done = 0;
    for (bool further = true; done < 1 && further;) {
      further = false;
      for (const MeshPointer& part : parts_) {
        const double end = way_inside(*part, from, way, done);
        further |= end > done;
        done = std::max(done, end);
      }
    }
    return done >= 1;
  }
  /// Fraction of the path at which it leaves the part; 0 if the path is outside the part at the
  /// fraction `at`.
  double way_inside(const ConvexMesh& part, const Vec3& from, const Vec3& way, double at) const {
    double low = 0, high = 1;
    for (const Facet& facet : part.facets()) {
      const double rate = glm::dot(facet.normal, way);
      const double room = facet.offset + tolerance_ - glm::dot(facet.normal, from);
      if (room < 0 && rate >= 0) return 0;
      if (rate > 0) high = std::min(high, room / rate);
      if (rate < 0) low = std::max(low, room / rate);
    }
    return low <= at ? high : 0;
  }

  void add(const ConvexSet& set) {
    MeshPointer mesh = inset(*set.mesh, depth_);
    if (!mesh) return;
    const auto within = [&](const ConvexMesh& small, const ConvexMesh& large) {
      return std::all_of(small.vertices().begin(), small.vertices().end(),
                         [&](const Vec3& v) { return height_over(large, v) <= 1e-3 * tolerance_; });
    };
    for (const MeshPointer& known : out_)
      if (within(*mesh, *known)) return;
    std::erase_if(out_, [&](const MeshPointer& known) { return within(*known, *mesh); });
    out_.push_back(std::move(mesh));
  }

  void find_notches() {
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      for (std::size_t k = i + 1; k < parts_.size(); ++k) {
        const ConvexMesh &a = *parts_[i], &b = *parts_[k];
        if (glm::distance(a.centre(), b.centre()) > a.radius() + b.radius() + tolerance_) continue;
        const std::vector<std::uint32_t> of_b = facets_near(b, a);
        for (const std::uint32_t f : facets_near(a, b))
          for (const std::uint32_t g : of_b) find_notch(a, f, b, g);
      }
    }
  }

  /// The facets that are not beyond a plane of the other part.
  std::vector<std::uint32_t> facets_near(const ConvexMesh& mesh, const ConvexMesh& other) const {
    std::vector<std::uint32_t> out;
    for (std::uint32_t f = 0; f < mesh.facets().size(); ++f) {
      const std::vector<Vec3> corners = corners_of(mesh, f);
      const bool beyond =
          std::any_of(other.facets().begin(), other.facets().end(), [&](const Facet& facet) {
            return std::all_of(corners.begin(), corners.end(), [&](const Vec3& corner) {
              return glm::dot(facet.normal, corner) - facet.offset > tolerance_;
            });
          });
      if (!beyond && !std::all_of(corners.begin(), corners.end(), [&](const Vec3& corner) {
            return height_over(other, corner) < -tolerance_;
          }))
        out.push_back(f);
    }
    return out;
  }

  void find_notch(const ConvexMesh& a, std::uint32_t f, const ConvexMesh& b, std::uint32_t g) {
    const Facet &left = a.facets()[f], &right = b.facets()[g];
    const Vec3 across = glm::cross(left.normal, right.normal);
    const double sine = glm::length(across), cosine = glm::dot(left.normal, right.normal);
    if (std::atan2(sine, cosine) < kTurn) return;  // a mitre is deep enough there
    if (sine < 1e-6) return;
    const Vec3 along = across / sine;
    const Vec3 at = (left.offset * glm::cross(right.normal, across) +
                     right.offset * glm::cross(across, left.normal)) /
                    (sine * sine);
    double low = -HUGE_VAL, high = HUGE_VAL;
    for (const ConvexMesh* mesh : {&a, &b}) {
      for (const Facet& facet : mesh->facets()) {
        const double rate = glm::dot(facet.normal, along);
        const double room = facet.offset + tolerance_ - glm::dot(facet.normal, at);
        if (std::abs(rate) < 1e-9) {
          if (room < 0) return;
        } else {
          (rate > 0 ? high : low) =
              rate > 0 ? std::min(high, room / rate) : std::max(low, room / rate);
        }
      }
    }
    if (!(high - low > 10 * tolerance_)) return;
    const Notch notch{at + low * along, at + high * along, left.normal, right.normal};
    // Outside is in front of both faces; inside is behind either of them.
    const Vec3 out = glm::normalize(left.normal + right.normal);
    const Vec3 on_left = glm::normalize(right.normal - cosine * left.normal) - 0.3 * left.normal;
    const Vec3 on_right = glm::normalize(left.normal - cosine * right.normal) - 0.3 * right.normal;
    for (int place = 0; place < kPlaces; ++place) {
      const auto is_inside = [&](const Vec3& way) {
        return in_union(on(notch, place) + 20 * tolerance_ * way);
      };
      if (is_inside(out) || !is_inside(on_left) || !is_inside(on_right)) continue;
      notches_.push_back(notch);
      return;
    }
  }

  static Vec3 on(const Notch& notch, int place) {
    return notch.from + (place + 0.5) / kPlaces * (notch.to - notch.from);
  }

  /// Unit normals from one face's to the other's, both included.
  static std::vector<Vec3> normals_of(const Notch& notch, double apart) {
    const double turn = std::atan2(glm::length(glm::cross(notch.first, notch.second)),
                                   glm::dot(notch.first, notch.second));
    const int steps = static_cast<int>(std::ceil(turn / apart));
    std::vector<Vec3> out;
    for (int i = 0; i <= steps; ++i) {
      const double part = turn * i / steps;
      out.push_back((std::sin(turn - part) * notch.first + std::sin(part) * notch.second) /
                    std::sin(turn));
    }
    return out;
  }

  /// Points that are deep enough and in none of the sets: just under concave edges, and anywhere.
  std::vector<Vec3> missing_points() const {
    std::vector<Vec3> points;
    for (const Notch& notch : notches_) {
      for (int place = 0; place < kPlaces; ++place) {
        for (const Vec3& normal : normals_of(notch, kTurn / 4))
          points.push_back(on(notch, place) - kUnderEdge * depth_ * normal);
      }
    }
    std::erase_if(points, [&](const Vec3& p) {
      return covered(p) || !deep(p, (kUnderEdge - 0.02) * depth_);
    });
    Random random(1);
    for (int i = 0; i < kSamples; ++i) {
      const ConvexMesh& part = *parts_[static_cast<std::size_t>(i) % parts_.size()];
      Vec3 p;
      for (int axis = 0; axis < 3; ++axis)
        p[axis] = part.centre()[axis] + part.radius() * (2 * random.unit() - 1);
      if (height_over(part, p) <= 0 && !covered(p) && deep(p, kInsetWithin * depth_))
        points.push_back(p);
    }
    return points;
  }

  /// Adds a set that contains the point: grown from a near part, or from its piece behind a plane
  /// through a near concave edge. \return false: found none
  bool add_around(const Vec3& p) {
    const double near = 2 * depth_;
    for (const MeshPointer& part : parts_) {
      if (height_over(*part, p) > near) continue;
      if (add_grown(whole(part), {std::nullopt, p, depth_})) return true;
      for (const Notch& notch : notches_) {
        const Vec3 along = notch.to - notch.from;
        const double share = glm::dot(p - notch.from, along) / glm::dot(along, along);
        const Vec3 at = notch.from + std::clamp(share, 0.0, 1.0) * along;
        if (glm::distance(at, p) > near || height_over(*part, at) > 4 * tolerance_) continue;
        std::vector<Vec3> normals = normals_of(notch, kTurn);
        normals.push_back(glm::normalize(at - p));  // round a corner of several edges
        for (const Vec3& normal : normals) {
          const HalfSpace plane{normal, glm::dot(normal, at)};
          const std::optional<ConvexSet> seed = growth_.behind(whole(part), plane);
          if (seed && add_grown(*seed, {plane, p, depth_})) return true;
        }
      }
    }
    return false;
  }

  bool add_grown(const ConvexSet& seed, const Kept& kept) {
    const ConvexSet set = growth_.grown(seed, beyond_, kept);
    if (height_over(*set.mesh, *kept.point) > tolerance_ - depth_) return false;
    add(set);
    return covered(*kept.point);
  }

  [[noreturn]] void refuse(const Vec3& p) const {
    char text[240];
    std::snprintf(text, sizeof text,
                  "no layer %.4g m under the surface of these %zu convex parts can be made: "
                  "(%.4g, %.4g, %.4g) m would be missing, which is deeper; expected a solid with "
                  "fewer or shallower notches, or a thinner layer",
                  depth_, parts_.size(), p.x, p.y, p.z);
    throw MeshError({text});
  }

  const std::vector<MeshPointer>& parts_;
  const double depth_;
  const SetGrowth growth_;
  const double tolerance_;  ///< m
  std::vector<Vec3> directions_;
  std::vector<Notch> notches_;
  std::vector<MeshPointer> beyond_;  ///< sets grow into these: parts, and grown parts
  std::vector<MeshPointer> out_;
};

/// The piece of a convex set inside a part; nullptr: nothing.
MeshPointer common(const MeshPointer& mesh, const ConvexMesh& part, const SetGrowth& growth) {
  const auto& vertices = mesh->vertices();
  ConvexSet set = whole(mesh);
  for (const Facet& facet : part.facets()) {
    if (std::all_of(vertices.begin(), vertices.end(), [&](const Vec3& v) {
          return glm::dot(facet.normal, v) - facet.offset <= 1e-3 * growth.tolerance();
        }))
      continue;
    std::optional<ConvexSet> behind = growth.behind(set, {facet.normal, facet.offset});
    if (!behind) return nullptr;
    set = std::move(*behind);
  }
  return set.mesh;
}

}  // namespace

std::vector<MeshPointer> inset_union_within(const std::vector<MeshPointer>& parts, double depth,
                                            const std::vector<MeshPointer>& within) {
  const SetGrowth growth(parts, kAbuts);
  std::vector<MeshPointer> out;
  for (const MeshPointer& mesh : inset_union(parts, depth)) {
    for (const MeshPointer& part : within) {
      if (glm::distance(mesh->centre(), part->centre()) > mesh->radius() + part->radius()) continue;
      if (MeshPointer piece = common(mesh, *part, growth)) out.push_back(std::move(piece));
    }
  }
  return out;
}

std::vector<MeshPointer> inset_union(const std::vector<MeshPointer>& parts, double depth) {
  if (parts.size() > 1) return UnionInset(parts, depth).made();
  std::vector<MeshPointer> one;
  if (MeshPointer mesh = parts.empty() ? nullptr : inset(*parts[0], depth)) one.push_back(mesh);
  return one;
}

double largest_inset(const std::vector<MeshPointer>& parts) {
  return UnionInset(parts, 0).largest_ball();
}

}  // namespace palpate::stimuli
