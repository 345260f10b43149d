#include "runner/evidence/verification/random_solids.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <utility>

#include "runner/evidence/verification/random_draws.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/orientation.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"

namespace palpate::runner::evidence {
namespace {

using Index = std::uint32_t;

struct FacePlane {
  Vec3 normal;
  double offset;
};

/// A convex solid that can be cut. planes[i] is that of soup.faces[i].
struct Block {
  stimuli::PolygonSoup soup;
  std::vector<FacePlane> planes;

  /// Removes what is above the plane. Corners on it count as below, so it must not pass through
  /// one; random planes do not.
  void cut(const FacePlane& plane) {
    const auto height = [&](Index v) {
      return glm::dot(plane.normal, soup.vertices[v]) - plane.offset;
    };
    std::map<std::pair<Index, Index>, Index> crossings;
    const auto crossing = [&](Index a, Index b) {
      const auto [at, is_new] = crossings.try_emplace({std::min(a, b), std::max(a, b)},
                                                      static_cast<Index>(soup.vertices.size()));
      if (is_new) {
        const double fraction = height(a) / (height(a) - height(b));
        soup.vertices.push_back(soup.vertices[a] +
                                fraction * (soup.vertices[b] - soup.vertices[a]));
      }
      return at->second;
    };
    std::map<Index, Index> rim;  // around the cut, clockwise seen from outside
    stimuli::PolygonSoup left;
    std::vector<FacePlane> planes_left;
    for (std::size_t f = 0; f < soup.faces.size(); ++f) {
      std::vector<Index> face;
      Index out = 0, back = 0;
      const auto& corners = soup.faces[f];
      for (std::size_t k = 0; k < corners.size(); ++k) {
        const Index a = corners[k], b = corners[(k + 1) % corners.size()];
        const bool a_stays = height(a) <= 0, b_stays = height(b) <= 0;
        if (a_stays) face.push_back(a);
        if (a_stays != b_stays) {
          face.push_back(crossing(a, b));
          (a_stays ? out : back) = face.back();
        }
      }
      if (face.size() < 3) continue;
      if (out != back) rim[back] = out;
      left.faces.push_back(face);
      planes_left.push_back(planes[f]);
    }
    if (rim.empty()) return;
    std::vector<Index> lid;
    for (Index at = rim.begin()->first; lid.size() < rim.size(); at = rim.at(at)) lid.push_back(at);
    left.faces.push_back(lid);
    planes_left.push_back(plane);
    soup.faces = std::move(left.faces);
    planes = std::move(planes_left);
  }

  /// Drops the corners that no face uses.
  stimuli::PolygonSoup tidy() const {
    stimuli::PolygonSoup out;
    std::map<Index, Index> number;
    for (const auto& face : soup.faces) {
      auto& numbered = out.faces.emplace_back();
      for (const Index v : face) {
        const auto [at, is_new] = number.try_emplace(v, static_cast<Index>(out.vertices.size()));
        if (is_new) out.vertices.push_back(soup.vertices[v]);
        numbered.push_back(at->second);
      }
    }
    return out;
  }
};

Block random_block(Random& random, int cuts) {
  Block block{stimuli::cube(1), {}};
  for (const auto& face : block.soup.faces) {
    Vec3 middle;
    for (const Index v : face) middle += block.soup.vertices[v];
    block.planes.push_back({glm::normalize(middle), 0.5});
  }
  for (int i = 0; i < cuts; ++i) {
    block.cut({random_direction(random), between(random, 0.2, 0.8)});
  }
  return block;
}

/// The polar dual of cut_cube: triangles, corners of any number of facets.
stimuli::PolygonSoup polar_of_cut_cube(Random& random, int cuts) {
  const Block block = random_block(random, cuts);
  stimuli::PolygonSoup polar;
  std::map<Index, std::vector<Index>> faces_at;
  for (Index f = 0; f < block.planes.size(); ++f) {
    polar.vertices.push_back(block.planes[f].normal * (0.25 / block.planes[f].offset));
    for (const Index v : block.soup.faces[f]) faces_at[v].push_back(f);
  }
  for (const auto& [corner, faces] : faces_at) {
    std::vector<Index> triangle = faces;  // three planes meet at every corner
    const Vec3 &a = polar.vertices[triangle[0]], &b = polar.vertices[triangle[1]],
               &c = polar.vertices[triangle[2]];
    if (glm::dot(glm::cross(b - a, c - a), block.soup.vertices[corner]) < 0) {
      std::swap(triangle[1], triangle[2]);
    }
    polar.faces.push_back(std::move(triangle));
  }
  return polar;
}

stimuli::PolygonSoup some_soup(Random& random) {
  const auto count = [&](std::uint64_t low, std::uint64_t high) {
    return static_cast<int>(low + random.below(high - low + 1));
  };
  switch (random.below(8)) {
    case 0:
    case 1:
      return cut_cube(random, count(0, 30));
    case 2:
    case 3:
      return polar_of_cut_cube(random, count(0, 30));
    case 4:
      return stimuli::icosphere(0.5, count(0, 2));
    case 5:
      return stimuli::cone(0.5, between(random, 0.1, 2), count(3, 64));
    case 6:
      return stimuli::cylinder(0.5, between(random, 0.1, 2), count(3, 64));
    default:
      return stimuli::cube(1);
  }
}

}  // namespace

stimuli::PolygonSoup cut_cube(Random& random, int cuts) {
  return random_block(random, cuts).tidy();
}

stimuli::PolygonSoup part_below(const stimuli::PolygonSoup& solid, const Vec3& normal,
                                double offset) {
  Block block{solid, std::vector<FacePlane>(solid.faces.size(), FacePlane{Vec3(0), 0})};
  block.cut({normal, offset});
  return block.tidy();
}

stimuli::PolygonSoup stretched(stimuli::PolygonSoup soup, const Vec3& factors) {
  for (Vec3& v : soup.vertices) v *= factors;
  return soup;
}

stimuli::PolygonSoup turned_and_moved(stimuli::PolygonSoup soup, const Quat& turn, double scale,
                                      const Vec3& to) {
  for (Vec3& v : soup.vertices) v = scale * (turn * v) + to;
  return soup;
}

stimuli::ConvexMesh random_solid(Random& random) {
  for (;;) {
    stimuli::PolygonSoup soup = some_soup(random);
    if (random.below(2) == 0) {
      Vec3 factors(1, 1, 1);
      factors[static_cast<int>(random.below(3))] = std::pow(10, -4 * random.unit());
      factors[static_cast<int>(random.below(3))] = std::pow(10, -4 * random.unit());
      soup = stretched(std::move(soup), factors);
    }
    const double scale = 1e-4 * std::pow(1e6, random.unit());
    const Quat turn = random.below(4) == 0 ? Quat(1, 0, 0, 0) : stimuli::uniform_rotation(random);
    const Vec3 to =
        static_cast<double>(random.below(2)) * scale * random.unit() * random_direction(random);
    try {
      return stimuli::ConvexMesh(turned_and_moved(std::move(soup), turn, scale, to));
    } catch (const stimuli::MeshError&) {
      // Indistinguishable from flat; redraw.
    }
  }
}

}  // namespace palpate::runner::evidence
