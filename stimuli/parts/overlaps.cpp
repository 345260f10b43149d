#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <glm/geometric.hpp>
#include <utility>

#include "stimuli/convex_mesh.h"
#include "stimuli/parts/convex_parts.h"
#include "stimuli/parts/convex_sets.h"
#include "stimuli/plane_deviation.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"

namespace palpate::stimuli {
namespace {

constexpr double kInOnePlane = 1e-9;  // of the size
constexpr double kNothing = 1e-6;     // of a group's volume
constexpr std::size_t kMostSentences = 3;

/// The piece of a plane polygon behind a plane.
std::vector<Vec3> behind(const std::vector<Vec3>& polygon, const Facet& plane) {
  std::vector<Vec3> kept;
  const auto height = [&](const Vec3& p) { return glm::dot(plane.normal, p) - plane.offset; };
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vec3 &from = polygon[k], &to = polygon[(k + 1) % polygon.size()];
    const double a = height(from), b = height(to);
    if (a <= 0) kept.push_back(from);
    if ((a <= 0) != (b <= 0)) kept.push_back(from + a / (a - b) * (to - from));
  }
  return kept;
}

/// m^3; the cones from `middle` to the pieces of the one's facets inside the other.
/// \param shared  whether facets of both in one plane, facing the same way, count
double cones(const ConvexMesh& one, const ConvexMesh& other, const Vec3& middle, bool shared) {
  const double tolerance = kInOnePlane * std::max(one.size(), other.size());
  double volume = 0;
  for (std::uint32_t f = 0; f < one.facets().size(); ++f) {
    std::vector<Vec3> polygon = corners_of(one, f);
    const Vec3& normal = one.facets()[f].normal;
    for (const Facet& plane : other.facets()) {
      const bool in_plane = std::ranges::all_of(polygon, [&](const Vec3& p) {
        return std::abs(glm::dot(plane.normal, p) - plane.offset) <= tolerance;
      });
      if (in_plane && (shared || glm::dot(normal, plane.normal) < 0)) continue;
      polygon = in_plane ? std::vector<Vec3>() : behind(polygon, plane);
      if (polygon.size() < 3) break;
    }
    for (std::size_t k = 2; k < polygon.size(); ++k)
      volume +=
          glm::dot(polygon[0] - middle, glm::cross(polygon[k - 1] - middle, polygon[k] - middle)) /
          6;
  }
  return volume;
}

struct Group {
  std::string name;
  std::vector<ConvexMesh> parts;
  double volume = 0;  // m^3
};

struct Overlap {
  double share = 0;  // of the smaller group
  std::string sentence;
};

Overlap overlap_of(const Group& a, const Group& b, double common) {
  const Group& less = a.volume <= b.volume ? a : b;
  char text[120];
  std::snprintf(text, sizeof text, " overlap by %.3g m^3, %.3g %% of ", common,
                100 * common / less.volume);
  return {common / less.volume,
          a.name + " and " + b.name + text + less.name + "; they are touched as one object"};
}

/// The largest first; the number of those left out in a last sentence.
std::vector<std::string> largest_of(std::vector<Overlap> overlaps) {
  std::stable_sort(overlaps.begin(), overlaps.end(),
                   [](const Overlap& a, const Overlap& b) { return a.share > b.share; });
  std::vector<std::string> sentences;
  for (const Overlap& overlap : overlaps) {
    if (sentences.size() == kMostSentences && overlaps.size() > kMostSentences + 1) {
      char text[120];
      std::snprintf(text, sizeof text, "%zu more pairs of groups overlap, by at most %.3g %%",
                    overlaps.size() - kMostSentences, 100 * overlap.share);
      sentences.emplace_back(text);
      break;
    }
    sentences.push_back(overlap.sentence);
  }
  return sentences;
}

}  // namespace

double common_volume(const ConvexMesh& a, const ConvexMesh& b) {
  if (glm::distance(a.centre(), b.centre()) >= a.radius() + b.radius()) return 0;
  const Vec3 middle = 0.5 * (a.centre() + b.centre());
  return std::max(0.0, cones(a, b, middle, true) + cones(b, a, middle, false));
}

std::vector<std::string> group_overlaps(const ObjectSpec& spec) {
  if (spec.shape != ShapeKind::mesh) return {};
  const PolygonSoup soup = polygons_of(spec);
  if (soup.group_names.size() < 2) return {};
  std::vector<Group> groups;
  std::vector<std::string> unknown;
  std::vector<Overlap> overlaps;
  for (const SolidGroup& solid : solid_groups(soup)) {
    Group group{solid.name, {}};
    try {
      group.parts = convex_parts(solid.soup);
    } catch (const MeshError&) {
      unknown.push_back(solid.name);
      continue;
    }
    for (const ConvexMesh& part : group.parts) group.volume += volume_of(part);
    groups.push_back(std::move(group));
  }
  for (std::size_t i = 0; i < groups.size(); ++i) {
    for (std::size_t k = i + 1; k < groups.size(); ++k) {
      double common = 0;
      for (const ConvexMesh& a : groups[i].parts)
        for (const ConvexMesh& b : groups[k].parts) common += common_volume(a, b);
      if (common > kNothing * std::min(groups[i].volume, groups[k].volume))
        overlaps.push_back(overlap_of(groups[i], groups[k], common));
    }
  }
  std::vector<std::string> sentences = largest_of(std::move(overlaps));
  if (unknown.size() == 1) {
    sentences.push_back(unknown.front() + " is not convex: where it overlaps others is not known");
  } else if (!unknown.empty()) {
    sentences.push_back(unknown.front() + " and " + std::to_string(unknown.size() - 1) +
                        " more groups are not convex: where they overlap is not known");
  }
  return sentences;
}

}  // namespace palpate::stimuli
