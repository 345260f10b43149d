#include "rendering/bodies/rigid_motion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <numbers>
#include <stdexcept>

#include "rendering/surface_search.h"
#include "stimuli/convex_mesh.h"

namespace palpate::rendering {
namespace {

using Polygon = std::vector<Vec3>;

struct CutPlane {
  Vec3 normal;  ///< unit, out of the part
  double offset = 0;
};

/// A part in the frame of the object.
struct PlacedPart {
  std::vector<CutPlane> planes;
  std::vector<Polygon> facets;  ///< as planes
  Vec3 centre;
  double tolerance = 0;  ///< m
};

PlacedPart placed_part(const PlacedMesh& placed) {
  PlacedPart part;
  const stimuli::ConvexMesh& mesh = *placed.mesh;
  for (std::uint32_t f = 0; f < mesh.facets().size(); ++f) {
    const stimuli::Facet& facet = mesh.facets()[f];
    Polygon& polygon = part.facets.emplace_back();
    for (std::uint32_t k = 0; k < facet.side_count; ++k) {
      const stimuli::Edge& edge = mesh.edges()[mesh.sides()[facet.first_side + k].edge];
      polygon.push_back(placed.pose.orientation * (edge.left == f ? edge.from : edge.to) +
                        placed.pose.position);
    }
    const Vec3 normal = placed.pose.orientation * facet.normal;
    part.planes.push_back({normal, facet.offset + glm::dot(normal, placed.pose.position)});
  }
  part.centre = placed.pose.orientation * mesh.centre() + placed.pose.position;
  part.tolerance = 1e-10 * mesh.size();
  return part;
}

/// Enlarges a part about its centre by a share of its size.
void grow(PlacedPart& part, double share) {
  for (CutPlane& plane : part.planes)
    plane.offset += share * (plane.offset - glm::dot(plane.normal, part.centre));
  for (Polygon& facet : part.facets) {
    for (Vec3& corner : facet) corner += share * (corner - part.centre);
  }
}

/// Adds the signed moments of the tetrahedra from the origin to a polygon.
void add_polygon(const Polygon& polygon, VolumeMoments& out) {
  for (std::size_t k = 2; k < polygon.size(); ++k) {
    const Vec3 &a = polygon[0], &b = polygon[k - 1], &c = polygon[k];
    const double six_volumes = glm::dot(a, glm::cross(b, c));
    const Vec3 sum = a + b + c;
    out.volume += six_volumes / 6;
    out.first += six_volumes / 24 * sum;
    out.second += six_volumes / 120 *
                  (glm::outerProduct(a, a) + glm::outerProduct(b, b) + glm::outerProduct(c, c) +
                   glm::outerProduct(sum, sum));
  }
}

/// Divides a polygon by a plane.
/// \return the piece outside; `polygon` keeps the rest
Polygon cut_off(Polygon& polygon, const CutPlane& plane) {
  Polygon outside, inside;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vec3 &p = polygon[k], &q = polygon[(k + 1) % polygon.size()];
    const double at_p = glm::dot(plane.normal, p) - plane.offset;
    const double at_q = glm::dot(plane.normal, q) - plane.offset;
    (at_p > 0 ? outside : inside).push_back(p);
    if ((at_p > 0) == (at_q > 0)) continue;
    const Vec3 between = p + at_p / (at_p - at_q) * (q - p);
    outside.push_back(between);
    inside.push_back(between);
  }
  polygon = std::move(inside);
  return outside;
}

/// Adds the pieces of one part's facets that lie outside of all other parts.
class UnionSurface {
 public:
  UnionSurface(const std::vector<PlacedPart>& parts, VolumeMoments& out)
      : parts_(parts), out_(out) {}

  void add_part(std::size_t index) {
    for (std::size_t f = 0; f < parts_[index].facets.size(); ++f)
      add(parts_[index].facets[f], parts_[index].planes[f].normal, index, 0);
  }

  /// Whether the pieces added bound a solid: their areas add up to no vector, and they give the
  /// same volume along each axis, except for a share.
  bool is_closed(double share) const {
    if (!(glm::length(areas_) <= share * area_)) return false;
    const Mat3 error = along_ - out_.volume * Mat3(1);
    double most = 0;
    for (int axis = 0; axis < 3; ++axis) most = std::max(most, glm::length(error[axis]));
    return most <= share * out_.volume;
  }

 private:
  struct Extent {
    double least = HUGE_VAL, most = -HUGE_VAL;
  };

  static Extent extent_of(const Polygon& polygon, const CutPlane& plane) {
    Extent extent;
    for (const Vec3& p : polygon) {
      const double at = glm::dot(plane.normal, p) - plane.offset;
      extent.least = std::min(extent.least, at);
      extent.most = std::max(extent.most, at);
    }
    return extent;
  }

  /// \param of  the part that the polygon belongs to
  /// \param from  the first part that it is compared with
  void add(Polygon polygon, const Vec3& normal, std::size_t of, std::size_t from) {
    while (from < parts_.size() && (from == of || is_beyond(polygon, normal, of, from))) ++from;
    if (from == parts_.size()) {
      add_polygon(polygon, out_);
      check(polygon);
      return;
    }
    const PlacedPart& part = parts_[from];
    for (const CutPlane& plane : part.planes) {
      if (extent_of(polygon, plane).most <= part.tolerance) continue;
      const Polygon outside = cut_off(polygon, plane);
      if (outside.size() > 2) add(outside, normal, of, from + 1);
      if (polygon.size() < 3) return;
    }
  }

  void check(const Polygon& polygon) {
    for (std::size_t k = 2; k < polygon.size(); ++k) {
      const Vec3 &a = polygon[0], &b = polygon[k - 1], &c = polygon[k];
      const Vec3 area = 0.5 * glm::cross(b - a, c - a);
      areas_ += area;
      area_ += glm::length(area);
      along_ += glm::outerProduct((a + b + c) / 3.0, area);
    }
  }

  /// Whether one plane has the whole polygon on its outer side. Of two coinciding facets, the first
  /// part's counts; of two abutting ones, neither.
  bool is_beyond(const Polygon& polygon, const Vec3& normal, std::size_t of,
                 std::size_t other) const {
    const PlacedPart& part = parts_[other];
    return std::any_of(part.planes.begin(), part.planes.end(), [&](const CutPlane& plane) {
      const Extent extent = extent_of(polygon, plane);
      if (extent.least < -part.tolerance) return false;
      if (extent.most > part.tolerance) return true;
      return glm::dot(normal, plane.normal) > 0 && of < other;
    });
  }

  const std::vector<PlacedPart>& parts_;
  VolumeMoments& out_;
  Vec3 areas_{0};    // m^2
  double area_ = 0;  // m^2
  Mat3 along_{0};    // m^3; sum of places times areas
};

MassProperties scaled(const VolumeMoments& moments, double density) {
  MassProperties out;
  out.mass = density * moments.volume;
  const Vec3 centre = moments.first / moments.volume;
  out.centre = moments.about + centre;
  const Mat3 second = moments.second - moments.volume * glm::outerProduct(centre, centre);
  const double trace = second[0][0] + second[1][1] + second[2][2];
  out.inertia = density * (trace * Mat3(1) - second);
  return out;
}

constexpr double kClosed = 1e-6;  // share of area and volume

/// Adds up the outer surface of the parts. \return whether it bounds a solid, except for a share
bool add_union(const std::vector<PlacedPart>& parts, double share, VolumeMoments& out) {
  out = {};
  UnionSurface surface(parts, out);
  for (std::size_t i = 0; i < parts.size(); ++i) surface.add_part(i);
  return surface.is_closed(share);
}

/// Parts of a file with rounded coordinates abut with steps: then some faces between them may count
/// although those of the other part do not. Enlarged unequally, they overlap. The moments of two
/// sizes are extrapolated to the parts' own; if no two bound a solid, the last are taken.
void add_grown_union(const std::vector<PlacedPart>& parts, VolumeMoments& out) {
  constexpr double kLeast = 1e-9, kMost = 1e-2;  // of their size
  bool was_closed = false;
  for (double share = kLeast; share < kMost; share *= 2) {
    std::vector<PlacedPart> grown = parts;
    for (std::size_t i = 0; i < grown.size(); ++i) {
      const double turns = (std::numbers::phi - 1) * (static_cast<double>(i) + 0.5);
      grow(grown[i], share * (1 + turns - std::floor(turns)));
    }
    const VolumeMoments smaller = out;
    const bool is_closed = add_union(grown, std::max(kClosed, share), out);
    if (was_closed && is_closed) {
      out.volume = 2 * smaller.volume - out.volume;
      out.first = 2.0 * smaller.first - out.first;
      out.second = 2.0 * smaller.second - out.second;
      return;
    }
    was_closed = is_closed;
  }
}

/// Whether some region just below one of up to 4,096 triangles is covered twice.
bool covers_twice(const Surface& surface) {
  constexpr std::size_t kAsked = 4096;
  constexpr double kBelow = 1e-7;  // of the size
  const std::vector<std::uint32_t>& triangles = surface.file_order();
  const std::size_t stride = 1 + triangles.size() / kAsked;
  for (std::size_t i = 0; i < triangles.size(); i += stride) {
    const SurfaceTriangle& t = surface.triangles()[triangles[i]];
    const Vec3 middle = (surface.vertices()[t.corners[0]] + surface.vertices()[t.corners[1]] +
                         surface.vertices()[t.corners[2]]) /
                        3.0;
    if (surface.winding(middle - kBelow * surface.size() * t.normal) > 1) return true;
  }
  return false;
}

/// Adds the inside portions of a line along z that represents an area around it.
class LineMoments {
 public:
  LineMoments(const Surface& surface, VolumeMoments& out) : surface_(surface), out_(out) {}

  /// \param from  below the surface, relative to `about`
  /// \param length  m, to above the surface
  void add(const Vec3& from, double length, double area) {
    crossings_.clear();
    const Vec3 way(0, 0, length);
    const Vec3 start = from + out_.about;
    surface_.near_segment(start, way, [&](std::uint32_t index) {
      const SurfaceTriangle& t = surface_.triangles()[index];
      if (t.normal.z == 0 || t.is_back()) return true;
      bool in = true, out = true;
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 a = surface_.vertices()[t.corners[k]] - start;
        const Vec3 b = surface_.vertices()[t.corners[(k + 1) % 3]] - start;
        const double side = a.x * b.y - a.y * b.x;
        in &= side >= 0;
        out &= side <= 0;
      }
      if (in == out) return true;
      const Vec3 a = surface_.vertices()[t.corners[0]] - start;
      crossings_.push_back({from.z + glm::dot(t.normal, a) / t.normal.z, t.normal.z < 0 ? 1 : -1});
      return true;
    });
    std::sort(crossings_.begin(), crossings_.end(),
              [](const Crossing& a, const Crossing& b) { return a.z < b.z; });
    int inside = 0;
    for (std::size_t i = 0; i + 1 < crossings_.size(); ++i) {
      inside += crossings_[i].enters;
      if (inside > 0) add_piece(from, crossings_[i].z, crossings_[i + 1].z, area);
    }
  }

 private:
  struct Crossing {
    double z;    ///< m
    int enters;  ///< 1, or -1: leaves
  };

  void add_piece(const Vec3& at, double low, double high, double area) {
    const double volume = area * (high - low);
    const Vec3 middle(at.x, at.y, 0.5 * (low + high));
    out_.volume += volume;
    out_.first += volume * middle;
    out_.second += volume * glm::outerProduct(middle, middle);
    out_.second[2][2] += volume * (high - low) * (high - low) / 12;
  }

  const Surface& surface_;
  VolumeMoments& out_;
  std::vector<Crossing> crossings_;
};

/// Moments of the surface in its own frame, about its centre.
VolumeMoments own_moments(const Surface& surface) {
  VolumeMoments moments;
  moments.about = surface.centre();
  if (!covers_twice(surface)) {
    Polygon corners(3);
    for (const std::uint32_t index : surface.file_order()) {
      const SurfaceTriangle& t = surface.triangles()[index];
      for (std::size_t k = 0; k < 3; ++k)
        corners[k] = surface.vertices()[t.corners[k]] - moments.about;
      add_polygon(corners, moments);
    }
    return moments;
  }
  constexpr int kLines = 400;  // along each side
  Vec3 low(HUGE_VAL), high(-HUGE_VAL);
  for (const Vec3& v : surface.vertices()) {
    low = glm::min(low, v - moments.about);
    high = glm::max(high, v - moments.about);
  }
  const double step_x = (high.x - low.x) / kLines, step_y = (high.y - low.y) / kLines;
  std::array<double, kLines> shifts{};
  for (std::size_t i = 0; i < shifts.size(); ++i) {
    const double turns = (std::numbers::phi - 1) * (static_cast<double>(i) + 0.5);
    shifts[i] = turns - std::floor(turns);
  }
  LineMoments lines(surface, moments);
  for (int i = 0; i < kLines; ++i) {
    for (int k = 0; k < kLines; ++k) {
      // Shift rows by the golden ratio, so that lines sample a wall along x or y at all places.
      const Vec3 from(low.x + (i + shifts[static_cast<std::size_t>(k)]) * step_x,
                      low.y + (k + shifts[static_cast<std::size_t>(i)]) * step_y,
                      low.z - surface.radius());
      lines.add(from, high.z - low.z + 2 * surface.radius(), step_x * step_y);
    }
  }
  return moments;
}

/// Rate of an orientation for the spin of the momentum, times the quaternion's length: stages of
/// Runge-Kutta do not have unit length.
Quat rate_of_turn(const BodyInertia& inertia, const Vec3& spin_momentum, const Quat& q) {
  const double per_length2 = 1 / glm::dot(q, q);
  const Vec3 v(q.x, q.y, q.z);
  const Vec3 across = glm::cross(spin_momentum, v);  // q* L q / |q|^2, by hand
  const Vec3 local = spin_momentum + 2 * per_length2 * (q.w * across + glm::cross(across, v));
  const Vec3 half = 0.5 * (inertia.per_inertia * local);
  return {-glm::dot(v, half), q.w * half + glm::cross(v, half)};
}

Quat runge_kutta(const BodyInertia& inertia, const Vec3& momentum, const Quat& q, double step) {
  const Quat a = rate_of_turn(inertia, momentum, q);
  const Quat b = rate_of_turn(inertia, momentum, q + 0.5 * step * a);
  const Quat c = rate_of_turn(inertia, momentum, q + 0.5 * step * b);
  const Quat d = rate_of_turn(inertia, momentum, q + step * c);
  return glm::normalize(q + step / 6 * (a + 2.0 * b + 2.0 * c + d));
}

/// Rotation by a rotation vector, rad.
Quat rotation_by(const Vec3& turn) {
  const double half = 0.5 * glm::length(turn);
  const double share = half > 0 ? 0.5 * std::sin(half) / half : 0.5;
  return {std::cos(half), share * turn};
}

/// A symmetric top precesses about its momentum and spins about its axis, both evenly.
Quat turned_symmetric(const BodyInertia& inertia, const Vec3& momentum, const Quat& q,
                      double duration) {
  const Quat precession = rotation_by(duration * inertia.per_across * momentum);
  const double along = glm::dot(q * inertia.axis, momentum);
  const double spin = (inertia.per_along - inertia.per_across) * along;
  return glm::normalize(precession * q * rotation_by(duration * spin * inertia.axis));
}

double largest_of(const Mat3& m) {
  double largest = 0;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) largest = std::max(largest, std::abs(m[i][k]));
  }
  return largest;
}

/// Whether inertia = across + (along - across) u u^T: then its deviator d = b (u u^T - 1/3) has a
/// determinant of 2 b^3 / 27.
void find_symmetry(BodyInertia& out) {
  constexpr double kSymmetric = 1e-10;
  const double mean = (out.inertia[0][0] + out.inertia[1][1] + out.inertia[2][2]) / 3;
  const Mat3 deviator = out.inertia - mean * Mat3(1);
  const double b = std::cbrt(13.5 * glm::determinant(deviator));
  Mat3 square(0);
  if (largest_of(deviator) > kSymmetric * mean) {
    if (!(std::abs(b) > kSymmetric * mean)) return;
    square = deviator / b + Mat3(1.0 / 3);
    if (!(largest_of(square * square - square) * std::abs(b) <= kSymmetric * mean)) return;
    int most = 0;
    for (int i = 1; i < 3; ++i) {
      if (square[i][i] > square[most][most]) most = i;
    }
    out.axis = glm::normalize(square[most]);
    out.per_across = 1 / (mean - b / 3);
    out.per_along = 1 / (mean + 2 * b / 3);
  } else {
    out.per_across = out.per_along = 1 / mean;
  }
  out.symmetric = true;
}

}  // namespace

VolumeMoments moments_of_union(std::span<const PlacedMesh> parts) {
  std::vector<PlacedPart> placed;
  placed.reserve(parts.size());
  Vec3 middle(0);
  for (const PlacedMesh& part : parts)
    middle += (part.pose.orientation * part.mesh->centre() + part.pose.position) /
              static_cast<double>(parts.size());
  for (const PlacedMesh& part : parts) {
    PlacedMesh about = part;
    about.pose.position -= middle;
    placed.push_back(placed_part(about));
  }
  VolumeMoments moments;
  if (!add_union(placed, kClosed, moments)) add_grown_union(placed, moments);
  moments.about = middle;
  return moments;
}

VolumeMoments moments_of_surface(const Surface& surface, const Pose& pose) {
  const VolumeMoments own = own_moments(surface);
  const Mat3 turn = glm::mat3_cast(pose.orientation);
  return {turn * own.about + pose.position, own.volume, turn * own.first,
          turn * own.second * glm::transpose(turn)};
}

MassProperties with_density(const VolumeMoments& moments, double density) {
  return scaled(moments, density);
}

MassProperties with_mass(const VolumeMoments& moments, double mass) {
  return scaled(moments, mass / moments.volume);
}

BodyInertia inertia_of(const MassProperties& properties) {
  const double size =
      properties.inertia[0][0] + properties.inertia[1][1] + properties.inertia[2][2];
  const double determinant = glm::determinant(properties.inertia);
  if (!(properties.mass > 0) || !(determinant > 1e-18 * size * size * size) ||
      !std::isfinite(determinant))
    throw std::invalid_argument("a body's mass and moments of inertia must be above 0");
  BodyInertia out;
  out.mass = properties.mass;
  out.per_mass = 1 / properties.mass;
  out.inertia = properties.inertia;
  out.per_inertia = glm::inverse(properties.inertia);
  const Mat3& inverse = out.per_inertia;
  out.most_per_inertia = inverse[0][0] + inverse[1][1] + inverse[2][2];
  find_symmetry(out);
  return out;
}

Vec3 spin_of(const BodyInertia& inertia, const BodyMotion& motion) {
  return motion.orientation *
         (inertia.per_inertia * (glm::conjugate(motion.orientation) * motion.spin_momentum));
}

Vec3 spin_momentum_of(const BodyInertia& inertia, const Quat& orientation, const Vec3& spin) {
  return orientation * (inertia.inertia * (glm::conjugate(orientation) * spin));
}

Mat3 world_per_inertia(const BodyInertia& inertia, const Quat& orientation) {
  const Mat3 axes = glm::mat3_cast(orientation);
  return axes * inertia.per_inertia * glm::transpose(axes);
}

double kinetic_energy(const BodyInertia& inertia, const BodyMotion& motion) {
  return 0.5 * (inertia.mass * glm::dot(motion.velocity, motion.velocity) +
                glm::dot(motion.spin_momentum, spin_of(inertia, motion)));
}

Vec3 velocity_at(const Vec3& spin, const BodyMotion& motion, const Vec3& point) {
  return motion.velocity + glm::cross(spin, point - motion.centre);
}

Quat turned(const Quat& orientation, const Vec3& turn) {
  const double angle = glm::length(turn);
  if (!(angle > 0)) return orientation;
  const Vec3 axis = std::sin(0.5 * angle) / angle * turn;
  return glm::normalize(Quat(std::cos(0.5 * angle), axis.x, axis.y, axis.z) * orientation);
}

Quat turned_freely(const BodyInertia& inertia, const Vec3& spin_momentum, Quat orientation,
                   double duration) {
  constexpr double kLargestStep = 0.02;  // rad
  constexpr double kMostSteps = 64;
  if (glm::dot(spin_momentum, spin_momentum) == 0 || duration == 0) return orientation;
  if (inertia.symmetric) return turned_symmetric(inertia, spin_momentum, orientation, duration);
  const Vec3 spin = inertia.per_inertia * (glm::conjugate(orientation) * spin_momentum);
  const double steps =
      std::clamp(std::ceil(glm::length(spin) * duration / kLargestStep), 1.0, kMostSteps);
  for (int i = 0; i < static_cast<int>(steps); ++i)
    orientation = runge_kutta(inertia, spin_momentum, orientation, duration / steps);
  return orientation;
}

void move_freely(const BodyInertia& inertia, const Vec3& gravity, double damping, double duration,
                 BodyMotion& motion) {
  if (damping > 0) {
    // v' = g - c v
    const double left = std::exp(-damping * duration);
    const Vec3 terminal = gravity / damping;
    const double effective = -std::expm1(-damping * duration) / damping;
    motion.centre += terminal * (duration - effective) + motion.velocity * effective;
    motion.velocity = terminal + left * (motion.velocity - terminal);
    // A momentum that decays turns the body as the initial momentum would in a shorter time.
    motion.orientation =
        turned_freely(inertia, motion.spin_momentum, motion.orientation, effective);
    motion.spin_momentum *= left;
    return;
  }
  motion.centre += duration * motion.velocity + (0.5 * duration * duration) * gravity;
  motion.velocity += duration * gravity;
  motion.orientation = turned_freely(inertia, motion.spin_momentum, motion.orientation, duration);
}

}  // namespace palpate::rendering
