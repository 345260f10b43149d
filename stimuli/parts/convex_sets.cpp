// A set may grow through a face that lies wholly on another convex part: the set and the piece of
// that part behind the set's other planes are convex together.
#include "stimuli/parts/convex_sets.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <optional>
#include <utility>

#include "stimuli/convex_mesh.h"
#include "stimuli/polygon_soup.h"

namespace palpate::stimuli {
namespace {

constexpr int kMostStepsOfSet = 64;  // of one set

/// Null: too thin to matter.
MeshPointer bounded(const std::vector<HalfSpace>& planes, const Vec3& inside, double size) {
  try {
    return body_behind(planes, inside, size);
  } catch (const MeshError&) {
    return nullptr;
  }
}

}  // namespace

double height_over(const ConvexMesh& mesh, const Vec3& p) {
  double most = -HUGE_VAL;
  for (const Facet& facet : mesh.facets())
    most = std::max(most, glm::dot(facet.normal, p) - facet.offset);
  return most;
}

std::vector<Vec3> corners_of(const ConvexMesh& mesh, std::uint32_t f) {
  const Facet& facet = mesh.facets()[f];
  std::vector<Vec3> corners;
  for (std::uint32_t k = 0; k < facet.side_count; ++k) {
    const Edge& edge = mesh.edges()[mesh.sides()[facet.first_side + k].edge];
    corners.push_back(edge.left == f ? edge.from : edge.to);
  }
  return corners;
}

ConvexSet whole(const MeshPointer& part) {
  ConvexSet out{part, {}};
  for (const Facet& facet : part->facets()) out.planes.push_back({facet.normal, facet.offset});
  return out;
}

SetGrowth::SetGrowth(const std::vector<MeshPointer>& parts, double abuts) : abuts_(abuts) {
  double size = 0;
  for (const MeshPointer& part : parts) size = std::max(size, part->size());
  tolerance_ = abuts * size;
}

/// The set grown through a face that lies wholly on another part, as far as that part and the set's
/// other planes go. Where the set touches the face's plane in that face only, both together are
/// convex.
std::optional<ConvexSet> SetGrowth::through(const ConvexSet& set, std::uint32_t f,
                                            const ConvexMesh& beyond) const {
  const Facet& face = set.mesh->facets()[f];
  bool extends = false;
  for (const Vec3& v : beyond.vertices())
    extends |= glm::dot(face.normal, v) - face.offset > 4 * tolerance_;
  if (!extends) return std::nullopt;
  for (const Vec3& corner : corners_of(*set.mesh, f))
    if (height_over(beyond, corner) > tolerance_) return std::nullopt;
  const auto same = [&](const HalfSpace& plane, const Vec3& normal, double offset) {
    const Vec3& at = set.mesh->centre();
    return glm::length(plane.normal - normal) < abuts_ &&
           std::abs(plane.offset - offset + glm::dot(normal - plane.normal, at)) <= 2 * tolerance_;
  };
  ConvexSet larger;
  for (const HalfSpace& plane : set.planes)
    if (!same(plane, face.normal, face.offset)) larger.planes.push_back(plane);
  for (const Facet& facet : beyond.facets()) {
    const auto& v = set.mesh->vertices();
    const bool behind = std::all_of(v.begin(), v.end(), [&](const Vec3& p) {
      return glm::dot(facet.normal, p) - facet.offset <= tolerance_;
    });
    const bool known = std::any_of(
        larger.planes.begin(), larger.planes.end(),
        [&](const HalfSpace& plane) { return same(plane, facet.normal, facet.offset); });
    if (behind && !known) larger.planes.push_back({facet.normal, facet.offset});
  }
  larger.mesh = bounded(larger.planes, largest_inscribed_ball(*set.mesh).centre,
                        set.mesh->size() + beyond.size());
  if (!larger.mesh) return std::nullopt;
  return larger;
}

/// Gives up the piece of the set beside the other part where the point does not need it.
std::optional<ConvexSet> SetGrowth::narrowed_through(const ConvexSet& set, std::uint32_t f,
                                                     const ConvexMesh& beyond,
                                                     const Kept& kept) const {
  const Facet& face = set.mesh->facets()[f];
  const double height = glm::dot(face.normal, *kept.point) - face.offset;
  if (height < -kept.depth) return std::nullopt;  // it needs nothing from beyond
  ConvexSet narrow = set;
  for (const Facet& facet : beyond.facets()) {
    bool crosses = false;
    for (const Vec3& corner : corners_of(*set.mesh, f))
      crosses |= glm::dot(facet.normal, corner) - facet.offset > tolerance_;
    if (!crosses) continue;
    if (glm::dot(facet.normal, *kept.point) - facet.offset > -kept.depth) return std::nullopt;
    const std::optional<ConvexSet> cut = behind(narrow, {facet.normal, facet.offset});
    if (!cut) return std::nullopt;
    narrow = *cut;
  }
  for (std::uint32_t g = 0; g < narrow.mesh->facets().size(); ++g) {
    const Facet& same = narrow.mesh->facets()[g];
    if (glm::length(same.normal - face.normal) < abuts_) return through(narrow, g, beyond);
  }
  return std::nullopt;
}

std::optional<ConvexSet> SetGrowth::step(const ConvexSet& set,
                                         const std::vector<MeshPointer>& others, const Kept& kept,
                                         bool narrower) const {
  std::vector<const ConvexMesh*> near;
  for (const MeshPointer& other : others) {
    if (glm::distance(other->centre(), set.mesh->centre()) <=
        other->radius() + set.mesh->radius() + tolerance_)
      near.push_back(other.get());
  }
  for (std::uint32_t f = 0; f < set.mesh->facets().size(); ++f) {
    const Vec3& normal = set.mesh->facets()[f].normal;
    if (kept.plane && glm::length(kept.plane->normal - normal) < abuts_) continue;
    for (const ConvexMesh* const other : near) {
      std::optional<ConvexSet> larger =
          narrower ? narrowed_through(set, f, *other, kept) : through(set, f, *other);
      if (larger) return larger;
    }
  }
  return std::nullopt;
}

ConvexSet SetGrowth::grown(ConvexSet set, const std::vector<MeshPointer>& others,
                           const Kept& kept) const {
  for (int i = 0; i < kMostStepsOfSet; ++i) {
    std::optional<ConvexSet> larger = step(set, others, kept, false);
    if (!larger && kept.point) larger = step(set, others, kept, true);
    if (!larger) break;
    set = std::move(*larger);
  }
  return set;
}

std::optional<ConvexSet> SetGrowth::behind(const ConvexSet& set, const HalfSpace& plane) const {
  const auto height = [&](const Vec3& p) { return glm::dot(plane.normal, p) - plane.offset; };
  std::vector<Vec3> left;
  double lowest = 0, highest = 0;
  for (const Vec3& v : set.mesh->vertices()) {
    lowest = std::min(lowest, height(v));
    highest = std::max(highest, height(v));
    if (height(v) <= 0) left.push_back(v);
  }
  if (highest <= 4 * tolerance_) return set;
  if (lowest >= -100 * tolerance_) return std::nullopt;  // nothing but rounding
  for (const Edge& edge : set.mesh->edges()) {
    const double a = height(edge.from), b = height(edge.to);
    if ((a < 0) != (b < 0)) left.push_back(edge.from + a / (a - b) * (edge.to - edge.from));
  }
  Vec3 middle(0);
  for (const Vec3& p : left) middle += p / static_cast<double>(left.size());
  ConvexSet out = set;
  out.planes.push_back(plane);
  out.mesh = bounded(out.planes, middle, set.mesh->size());
  if (!out.mesh) return std::nullopt;
  return out;
}

}  // namespace palpate::stimuli
