#include "stimuli/signed_distance.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <stdexcept>

#include "stimuli/convex_mesh.h"

namespace palpate::stimuli {
namespace {

double sign_of(double value) { return value < 0 ? -1 : 1; }

SurfaceDistance to_sphere(double radius, const Vec3& point) {
  const double from_centre = glm::length(point);
  return {from_centre - radius, from_centre > 0 ? point / from_centre : Vec3(0, 0, 1)};
}

SurfaceDistance to_box(const Vec3& size, const Vec3& point) {
  const Vec3 sign(sign_of(point.x), sign_of(point.y), sign_of(point.z));
  const Vec3 beyond = glm::abs(point) - 0.5 * size;
  const Vec3 outside = glm::max(beyond, Vec3(0));
  const double distance = glm::length(outside);
  if (distance > 0) return {distance, sign * (outside / distance)};
  int nearest = 0;
  for (int axis = 1; axis < 3; ++axis) {
    if (beyond[axis] > beyond[nearest]) nearest = axis;
  }
  Vec3 normal;
  normal[nearest] = sign[nearest];
  return {beyond[nearest], normal};
}

// A vector in the half plane of a solid of revolution: away from the axis, and along it.
struct Profile {
  double distance, out, up;
};

SurfaceDistance revolved(const Profile& profile, const Vec3& point, double from_axis) {
  const double x = from_axis > 0 ? point.x / from_axis : 1;
  const double y = from_axis > 0 ? point.y / from_axis : 0;
  return {profile.distance, Vec3(profile.out * x, profile.out * y, profile.up)};
}

Profile to_corner(double out, double up) {
  const double distance = std::hypot(out, up);
  return {distance, out / distance, up / distance};
}

Profile to_cylinder(double radius, double height, double from_axis, double z) {
  const double side = from_axis - radius, end = std::abs(z) - height / 2;
  if (side > 0 && end > 0) return to_corner(side, end * sign_of(z));
  if (side >= end) return {side, 1, 0};
  return {end, 0, sign_of(z)};
}

Profile to_cone(double radius, double height, double from_axis, double z) {
  const double slant = std::hypot(radius, height);
  const double below_apex = height / 2 - z;
  const double side = (height * from_axis - radius * below_apex) / slant;
  const double down_the_side = (radius * from_axis + height * below_apex) / slant;
  const double base = -height / 2 - z;
  const Profile to_side{side, height / slant, radius / slant}, to_base{base, 0, -1};
  if (side <= 0 && base <= 0) return side >= base ? to_side : to_base;
  if (down_the_side <= 0) return to_corner(from_axis, -below_apex);
  if (down_the_side < slant && side > 0) return to_side;
  if (from_axis <= radius) return to_base;
  return to_corner(from_axis - radius, -base);
}

bool above_polygon(const ConvexMesh& mesh, const Facet& facet, const Vec3& point) {
  for (std::uint32_t s = facet.first_side; s < facet.first_side + facet.side_count; ++s) {
    const Side& side = mesh.sides()[s];
    if (glm::dot(side.inward, point) < side.offset) return false;
  }
  return true;
}

Vec3 nearest_on(const Edge& edge, const Vec3& point) {
  const Vec3& from = edge.from;
  const Vec3 along = edge.to - from;
  const double fraction = glm::dot(point - from, along) / glm::dot(along, along);
  return from + std::clamp(fraction, 0.0, 1.0) * along;
}

}  // namespace

SurfaceDistance signed_distance(const ObjectSpec& primitive, const Vec3& point) {
  const double from_axis = std::hypot(point.x, point.y);
  switch (primitive.shape) {
    case ShapeKind::sphere:
      return to_sphere(primitive.radius, point);
    case ShapeKind::cube:
      return to_box(Vec3(primitive.edge), point);
    case ShapeKind::box:
      return to_box(primitive.size, point);
    case ShapeKind::cylinder:
      return revolved(to_cylinder(primitive.radius, primitive.height, from_axis, point.z), point,
                      from_axis);
    case ShapeKind::cone:
      return revolved(to_cone(primitive.radius, primitive.height, from_axis, point.z), point,
                      from_axis);
    case ShapeKind::mesh:
    case ShapeKind::none:
    case ShapeKind::compound:
      break;
  }
  throw std::invalid_argument("signed_distance: a mesh or compound is no analytic primitive");
}

SurfaceDistance signed_distance(const ConvexMesh& mesh, const Vec3& point) {
  const Facet* front = &mesh.facets()[0];
  double most = glm::dot(front->normal, point) - front->offset;
  for (const Facet& facet : mesh.facets()) {
    const double height = glm::dot(facet.normal, point) - facet.offset;
    if (height <= most) continue;
    front = &facet;
    most = height;
  }
  if (most <= 0) return {most, front->normal};
  SurfaceDistance nearest{std::numeric_limits<double>::infinity(), front->normal};
  for (const Edge& edge : mesh.edges()) {
    const Vec3 apart = point - nearest_on(edge, point);
    const double distance = glm::length(apart);
    if (distance >= nearest.distance) continue;
    nearest = {distance, distance > 1e-12 * mesh.size() ? apart / distance : front->normal};
  }
  for (const Facet& facet : mesh.facets()) {
    const double height = glm::dot(facet.normal, point) - facet.offset;
    if (height <= 0 || height > nearest.distance) continue;
    if (above_polygon(mesh, facet, point)) nearest = {height, facet.normal};
  }
  return nearest;
}

}  // namespace palpate::stimuli
