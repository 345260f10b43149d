#include "rendering/bodies/surface_gap.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <span>
#include <tuple>
#include <utility>

#include "stimuli/nearest_on_triangle.h"

namespace palpate::rendering {
namespace {

constexpr double kShallow = 2e-5;   // m; deeper overlaps count only if no face lies between
constexpr double kBorder = 1e-9;    // m; a point this far beyond a face's border is still over it
constexpr double kCorner = 1e-11;   // m; a point this near to a corner is at the corner
constexpr double kExtreme = 1e-7;   // rad
constexpr double kParallel = 1e-6;  // rad

/// The search through a pair of trees. All in the frame of b.
class GapSearch {
 public:
  GapSearch(const SurfacePlace& a, const SurfacePlace& b, const GapLimits& limits, double turn,
            NearPlaces* out)
      : a_(*a.surface),
        b_(*b.surface),
        axes_(glm::transpose(b.axes) * a.axes),
        back_(glm::transpose(axes_)),
        position_(glm::transpose(b.axes) * (a.position - b.position)),
        reach_(limits.reach),
        depth_(limits.depth),
        least_(std::max(limits.reach, limits.depth)),
        turn_(std::max(turn, kExtreme)),
        out_(out) {
    for (glm::length_t i = 0; i < 3; ++i) sizes_[i] = glm::abs(axes_[i]);
  }

  double search() {
    walk(a_.corner_tree(), b_.face_tree(), [this](std::uint32_t v, std::uint32_t f) {
      corner_to_face(a_, v, b_, f, into_b(a_.vertices()[v]), true);
    });
    walk(a_.face_tree(), b_.corner_tree(), [this](std::uint32_t f, std::uint32_t v) {
      corner_to_face(b_, v, a_, f, into_a(b_.vertices()[v]), false);
    });
    walk(a_.edge_tree(), b_.edge_tree(),
         [this](std::uint32_t e, std::uint32_t f) { edge_to_edge(a_.edges()[e], b_.edges()[f]); });
    return least_;
  }

 private:
  Vec3 into_b(const Vec3& p) const { return axes_ * p + position_; }
  Vec3 into_a(const Vec3& p) const { return back_ * (p - position_); }

  /// m; features farther apart than this are skipped.
  double bound() const { return std::max(out_ != nullptr ? reach_ : least_, depth_); }

  template <class Visit>
  void walk(const stimuli::FeatureTree& of_a, const stimuli::FeatureTree& of_b,
            const Visit& visit) {
    if (of_a.empty() || of_b.empty()) return;
    std::array<std::pair<std::uint32_t, std::uint32_t>, 128> stack;
    std::size_t depth = 0;
    stack[depth++] = {0, 0};
    while (depth > 0) {
      const auto [i, k] = stack[--depth];
      const stimuli::FeatureTree::Node &a = of_a.node(i), &b = of_b.node(k);
      const Vec3 size = sizes_ * a.half;
      const Vec3 apart = glm::max(glm::abs(into_b(a.middle) - b.middle) - size - b.half, Vec3(0));
      const double limit = bound();
      if (glm::dot(apart, apart) > limit * limit) continue;
      if (!b.cone.may_oppose(a.cone, axes_ * a.cone.axis, turn_)) continue;
      if (a.count > 0 && b.count > 0) {
        for (std::uint32_t m = a.first; m < a.first + a.count; ++m) {
          for (std::uint32_t n = b.first; n < b.first + b.count; ++n)
            visit(of_a.feature(m), of_b.feature(n));
        }
        continue;
      }
      const bool split_a =
          b.count > 0 || (a.count == 0 && glm::dot(a.half, a.half) >= glm::dot(b.half, b.half));
      if (split_a) {
        stack[depth++] = {a.first, k};
        stack[depth++] = {i + 1, k};
      } else {
        stack[depth++] = {i, b.first};
        stack[depth++] = {i, k + 1};
      }
    }
  }

  /// \param p  the corner in the frame of the face
  /// \param corner_is_a  whether the corner is of surface a
  void corner_to_face(const stimuli::CollisionSurface& of, std::uint32_t corner,
                      const stimuli::CollisionSurface& other, std::uint32_t index, const Vec3& p,
                      bool corner_is_a) {
    const stimuli::CollisionSurface::Face& face = other.faces()[index];
    const double height = glm::dot(face.normal, p) - face.offset, limit = bound();
    if (height > limit) return;
    bool over = true;
    for (std::size_t k = 0; k < 3; ++k)
      over &= glm::dot(face.inward[k], p) >= face.side[k] - kBorder;
    const Mat3& to_corner = corner_is_a ? back_ : axes_;
    if (over) {
      if (height < -depth_) return;
      if (!of.is_extreme(corner, to_corner * -face.normal, turn_)) return;
      if (height < -kShallow && hidden(other, p, -height * face.normal)) return;
      return add(p - 0.5 * height * face.normal, face.normal, height, corner_is_a);
    }
    const auto& corners = face.corners;
    const stimuli::CornerTriangle triangle{
        other.vertices()[corners[0]], other.vertices()[corners[1]], other.vertices()[corners[2]]};
    const Vec3 nearest = stimuli::nearest_on_triangle(triangle, p);
    const Vec3 way = p - nearest;
    const double distance = glm::length(way);
    if (!(distance > kBorder && distance <= limit)) return;
    const Vec3 normal = way / distance;
    for (std::size_t k = 0; k < 3; ++k) {
      if (glm::distance(nearest, triangle[k]) > kCorner) continue;
      // Report a pair of corners once: in one of the two searches, for one face.
      if (!corner_is_a && other.is_corner(corners[k])) return;
      if (other.face_of(corners[k]) != index) return;
      if (!other.is_extreme(corners[k], normal, kExtreme)) return;
      if (!of.is_extreme(corner, to_corner * -normal, kExtreme)) return;
      return add(0.5 * (p + nearest), normal, distance, corner_is_a);
    }
    std::size_t side = 0;
    for (std::size_t k = 1; k < 3; ++k) {
      if (std::abs(glm::dot(face.inward[k], nearest) - face.side[k]) <
          std::abs(glm::dot(face.inward[side], nearest) - face.side[side]))
        side = k;
    }
    const std::uint32_t across = face.across[side];
    if (across == stimuli::CollisionSurface::kNone || across < index) return;
    for (const std::uint32_t f : {index, across}) {
      for (const std::uint32_t v : other.faces()[f].corners) {
        const Vec3 beside = other.vertices()[v] - nearest;
        if (glm::dot(beside, normal) > kExtreme * glm::length(beside)) return;
      }
    }
    if (!of.is_extreme(corner, to_corner * -normal, kExtreme)) return;
    add(0.5 * (p + nearest), normal, distance, corner_is_a);
  }

  void edge_to_edge(const stimuli::CollisionSurface::Edge& a,
                    const stimuli::CollisionSurface::Edge& b) {
    const Vec3 p = into_b(a_.vertices()[a.ends[0]]),
               u = axes_ * (a_.vertices()[a.ends[1]] - a_.vertices()[a.ends[0]]);
    const Vec3 &q = b_.vertices()[b.ends[0]], v = b_.vertices()[b.ends[1]] - q;
    const Vec3 cross = glm::cross(u, v);
    const double area2 = glm::dot(cross, cross), u2 = glm::dot(u, u), v2 = glm::dot(v, v);
    if (!(area2 > kParallel * kParallel * u2 * v2)) return;
    const double area = std::sqrt(area2);
    Vec3 normal = cross / area;
    double gap = glm::dot(normal, q - p);
    const double limit = bound();
    if (std::abs(gap) > limit) return;
    const double s = glm::dot(glm::cross(q - p, v), cross) / area2,
                 t = glm::dot(glm::cross(q - p, u), cross) / area2;
    const double room_a = kBorder / std::sqrt(u2), room_b = kBorder / std::sqrt(v2);
    if (s < -room_a || s > 1 + room_a || t < -room_b || t > 1 + room_b) return;
    if (!a_.is_extreme(a, back_ * normal, kExtreme)) {
      normal = -normal;
      gap = -gap;
      if (!a_.is_extreme(a, back_ * normal, kExtreme)) return;
    }
    if (!b_.is_extreme(b, -normal, kExtreme)) return;
    if (gap < -kShallow) {
      // They overlap only if nothing lies between the two edges.
      const Vec3 on_b = q + t * v;
      if (gap < -depth_ || hidden(b_, p + s * u, on_b - p - s * u)) return;
    }
    add_along(0.5 * (p + s * u + q + t * v), normal, gap);
  }

  /// Whether a face lies between a place and its possible entry on the surface.
  static bool hidden(const stimuli::CollisionSurface& surface, const Vec3& from,
                     const Vec3& along) {
    bool hides = false;
    surface.crossings(from, along, [&](double t, std::uint32_t) { hides |= t < 1 - 1e-6; });
    return hides;
  }

  /// \param out  unit, out of the surface of the face, in its frame; `place` in that frame
  void add(const Vec3& place, const Vec3& out, double gap, bool corner_is_a) {
    if (corner_is_a) return add_along(place, -out, gap);
    add_along(into_b(place), axes_ * out, gap);
  }

  void add_along(const Vec3& place, const Vec3& normal, double gap) {
    least_ = std::min(least_, gap);
    if (out_ == nullptr || gap > reach_) return;
    if (out_->all.size() == NearPlaces::kMost)
      out_->dropped = true;
    else
      out_->all.push_back({place, normal, gap});
  }

  const stimuli::CollisionSurface &a_, &b_;
  Mat3 axes_, back_;  ///< from a to b; its inverse
  Vec3 position_;
  Mat3 sizes_;  ///< absolute values of axes_
  double reach_, depth_, least_, turn_;
  NearPlaces* out_;
};

const NearPlace& nearest_of(std::span<const NearPlace> places) {
  return *std::ranges::min_element(places, [](const NearPlace& x, const NearPlace& y) {
    return std::tie(x.gap, x.place.x, x.place.y, x.place.z) <
           std::tie(y.gap, y.place.x, y.place.y, y.place.z);
  });
}

/// Of places with one normal, the nearest, and those that touch first if the surfaces turn against
/// each other, to eight sides, by `turn` (rad) or a quarter of it.
void choose_of(std::span<const NearPlace> places, double turn, std::vector<NearPlace>& chosen) {
  const std::size_t first = chosen.size();
  const auto add = [&](const NearPlace& place) {
    const auto same = [&](const NearPlace& known) { return known.place == place.place; };
    if (chosen.size() < NearPlaces::kMostChosen &&
        std::none_of(chosen.begin() + static_cast<std::ptrdiff_t>(first), chosen.end(), same))
      chosen.push_back(place);
  };
  if (places.size() <= 4) {
    std::ranges::for_each(places, add);
    return;
  }
  const NearPlace& nearest = nearest_of(places);
  add(nearest);
  const Vec3& normal = nearest.normal;
  const Vec3 least = std::abs(normal.x) < 0.6 ? Vec3(1, 0, 0) : Vec3(0, 1, 0);
  const Vec3 u = glm::normalize(glm::cross(normal, least)), v = glm::cross(normal, u);
  // Rotated by an angle that is no symmetry of a regular polygon.
  const Vec3 ahead = 0.9 * u + 0.4359 * v, across = glm::cross(normal, ahead);
  constexpr double kHalf = 0.70710678118654752;
  const Vec3 one = kHalf * (ahead + across), other = kHalf * (ahead - across);
  for (const double angle : {turn, 0.25 * turn}) {
    for (const Vec3& side : {ahead, -ahead, across, -across, one, -one, other, -other})
      add(*std::ranges::min_element(places, {}, [&](const NearPlace& place) {
        return place.gap - angle * glm::dot(place.place - nearest.place, side);
      }));
  }
}

/// The middle of the solid under a point of a face, in its own frame.
Vec3 middle_under(const stimuli::CollisionSurface& surface,
                  const stimuli::CollisionSurface::Face& face, const Vec3& point) {
  const Vec3 along = -4 * glm::length(surface.face_tree().node(0).half) * face.normal;
  double first = 1;
  surface.crossings(point, along, [&](double t, std::uint32_t) {
    if (t > 1e-9) first = std::min(first, t);
  });
  return point + 0.5 * first * along;
}

/// The depth of the deepest corner, piece of an edge or middle of a face inside another surface.
/// Surfaces may coincide, so the middles of the solid under faces count as well.
double depth_inside(const SurfacePlace& a, const SurfacePlace& b) {
  const Mat3 back = glm::transpose(b.axes), axes = back * a.axes;
  const Vec3 position = back * (a.position - b.position);
  double deepest = 0;
  const auto look = [&](const Vec3& place) {
    if (b.surface->contains(place)) deepest = std::max(deepest, b.surface->distance(place));
  };
  const auto at = [&](std::uint32_t v) { return axes * a.surface->vertices()[v] + position; };
  for (std::uint32_t v = 0; v < a.surface->vertices().size(); ++v) {
    if (a.surface->face_of(v) != stimuli::CollisionSurface::kNone) look(at(v));
  }
  std::vector<double> crossed;
  for (std::uint32_t f = 0; f < a.surface->faces().size(); ++f) {
    const stimuli::CollisionSurface::Face& face = a.surface->faces()[f];
    for (std::size_t k = 0; k < 3; ++k) {
      if (face.across[k] != stimuli::CollisionSurface::kNone && face.across[k] < f) continue;
      const Vec3 from = at(face.corners[k]), along = at(face.corners[(k + 1) % 3]) - from;
      crossed.assign({0, 1});
      b.surface->crossings(from, along, [&](double t, std::uint32_t) { crossed.push_back(t); });
      std::ranges::sort(crossed);
      for (std::size_t i = 0; i + 1 < crossed.size(); ++i)
        look(from + 0.5 * (crossed[i] + crossed[i + 1]) * along);
    }
    const auto& v = a.surface->vertices();
    const Vec3 middle = (v[face.corners[0]] + v[face.corners[1]] + v[face.corners[2]]) / 3.0;
    look(axes * middle + position);
    const Vec3 under = middle_under(*a.surface, face, middle), in_b = axes * under + position;
    if (b.surface->contains(in_b) && a.surface->contains(under))
      deepest = std::max(deepest, std::min(a.surface->distance(under), b.surface->distance(in_b)));
  }
  return deepest;
}

}  // namespace

void NearPlaces::make_room() {
  all.reserve(kMost);
  chosen.reserve(kMostChosen);
}

double gap_between(const SurfacePlace& a, const SurfacePlace& b, const GapLimits& limits) {
  return GapSearch(a, b, limits, 0, nullptr).search();
}

double find_places(const SurfacePlace& a, const SurfacePlace& b, const GapLimits& limits,
                   double turn, NearPlaces& out) {
  constexpr double kOneNormal = 1 - 1e-7;  // cosine; 4.5e-4 rad
  out.all.clear();
  out.chosen.clear();
  out.dropped = false;
  const double least = GapSearch(a, b, limits, turn, &out).search();
  for (std::span<NearPlace> left(out.all);
       !left.empty() && out.chosen.size() < NearPlaces::kMostChosen;) {
    const Vec3 normal = nearest_of(left).normal;
    const auto others = std::partition(left.begin(), left.end(), [&](const NearPlace& place) {
      return glm::dot(place.normal, normal) >= kOneNormal;
    });
    const auto count = static_cast<std::size_t>(others - left.begin());
    choose_of(left.first(count), std::max(turn, kExtreme), out.chosen);
    left = left.subspan(count);
  }
  for (NearPlace& place : out.chosen) {
    place.place = b.axes * place.place + b.position;
    place.normal = b.axes * place.normal;
  }
  return least;
}

double overlap_of(const SurfacePlace& a, const SurfacePlace& b) {
  return std::max(depth_inside(a, b), depth_inside(b, a));
}

}  // namespace palpate::rendering
