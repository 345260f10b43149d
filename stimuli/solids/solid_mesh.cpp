#include "stimuli/solids/solid_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <stdexcept>
#include <tuple>

namespace palpate::stimuli {
namespace {

// Of the radius, half of the side of the block in the middle of a disc or ball; its sides bulge by
// kBulge of the way to the circle. Chosen so that no angle of an element is far from 90 degrees.
constexpr double kCore = 0.45, kBulge = 0.35;

/// Joins blocks of hexahedra: nodes at the same place are merged.
class BlockBuilder {
 public:
  explicit BlockBuilder(double grid) : grid_(grid) {}

  /// \param map  from the unit cube, right-handed
  template <class Map>
  void add_block(const std::array<int, 3>& n, const Map& map) {
    const auto node = [&](int i, int j, int k) {
      const auto along = [](int at, int of) { return static_cast<double>(at) / of; };
      return node_at(map(Vec3(along(i, n[0]), along(j, n[1]), along(k, n[2]))));
    };
    for (int k = 0; k < n[2]; ++k) {
      for (int j = 0; j < n[1]; ++j) {
        for (int i = 0; i < n[0]; ++i) {
          mesh_.hexahedra.push_back({node(i, j, k), node(i + 1, j, k), node(i + 1, j + 1, k),
                                     node(i, j + 1, k), node(i, j, k + 1), node(i + 1, j, k + 1),
                                     node(i + 1, j + 1, k + 1), node(i, j + 1, k + 1)});
        }
      }
    }
  }
  SolidMesh take() { return std::move(mesh_); }

 private:
  std::uint32_t node_at(const Vec3& p) {
    const auto cell = [&](double x) { return std::llround(x / grid_); };
    const auto [found, is_new] = known_.try_emplace(std::tuple(cell(p.x), cell(p.y), cell(p.z)),
                                                    static_cast<std::uint32_t>(mesh_.nodes.size()));
    if (is_new) mesh_.nodes.push_back(p);
    return found->second;
  }

  double grid_;
  SolidMesh mesh_;
  std::map<std::tuple<long long, long long, long long>, std::uint32_t> known_;
};

/// A point of the square [-1, 1]^2 (or the cube) in the middle of the unit disc (or ball).
Vec3 in_core(const Vec3& p, int dimensions) {
  double far = 0, length2 = 0;
  for (int i = 0; i < dimensions; ++i) {
    far = std::max(far, std::abs(p[i]));
    length2 += p[i] * p[i];
  }
  Vec3 placed = p;
  for (int i = 0; i < dimensions; ++i) {
    const double round = length2 > 0 ? p[i] * far / std::sqrt(length2) : 0;
    const double straight = p[i];
    placed[i] = kCore * ((1 - kBulge) * straight + kBulge * std::sqrt(1.0 * dimensions) * round);
  }
  return placed;
}

int count_along(double length, double longest, int resolution) {
  return std::max(2, static_cast<int>(std::lround(resolution * length / longest)));
}

SolidMesh mesh_of_cylinder(double radius, double height, int resolution) {
  const double longest = std::max(2 * radius, height);
  const int across = count_along(2 * radius, longest, resolution);
  const int core = std::max(2, static_cast<int>(std::lround(across * 0.5)));
  const int ring = std::max(1, static_cast<int>(std::lround(across * 0.25)));
  const int layers = count_along(height, longest, resolution);
  BlockBuilder blocks(1e-7 * longest);
  const auto place = [&](const Vec3& flat, double z) {
    return Vec3(radius * flat.x, radius * flat.y, height * (z - 0.5));
  };
  blocks.add_block({core, core, layers}, [&](const Vec3& u) {
    return place(in_core({2 * u.x - 1, 2 * u.y - 1, 0}, 2), u.z);
  });
  for (int side = 0; side < 4; ++side) {
    const double c = side == 0 ? 1 : (side == 2 ? -1 : 0), s = side == 1 ? 1 : (side == 3 ? -1 : 0);
    const auto turned = [&](const Vec3& p) {
      return Vec3(c * p.x - s * p.y, s * p.x + c * p.y, 0);
    };
    blocks.add_block({ring, core, layers}, [&](const Vec3& u) {
      const double along = 2 * u.y - 1, angle = along * std::atan(1.0);
      const Vec3 inner = in_core(turned({1, along, 0}), 2);
      const Vec3 outer = turned({std::cos(angle), std::sin(angle), 0});
      return place((1 - u.x) * inner + u.x * outer, u.z);
    });
  }
  return blocks.take();
}

SolidMesh mesh_of_ball(double radius, int resolution) {
  const int core = std::max(2, static_cast<int>(std::lround(resolution * 0.5)));
  const int shell = std::max(1, static_cast<int>(std::lround(resolution * 0.25)));
  BlockBuilder blocks(1e-7 * radius);
  blocks.add_block({core, core, core},
                   [&](const Vec3& u) { return radius * in_core(2.0 * u - Vec3(1), 3); });
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      blocks.add_block({core, core, shell}, [&](const Vec3& u) {
        // Equal angles along the sides of the cube are nearly equal elements on the sphere.
        const double a = (2 * u.x - 1) * sign, b = 2 * u.y - 1;
        Vec3 cube, sphere;
        cube[axis] = sphere[axis] = sign;
        cube[(axis + 1) % 3] = a;
        cube[(axis + 2) % 3] = b;
        sphere[(axis + 1) % 3] = std::tan(a * std::atan(1.0));
        sphere[(axis + 2) % 3] = std::tan(b * std::atan(1.0));
        return radius * ((1 - u.z) * in_core(cube, 3) + u.z * glm::normalize(sphere));
      });
    }
  }
  return blocks.take();
}

// Counter-clockwise from outside.
constexpr int kHexahedronFaces[6][4] = {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4},
                                        {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};
// Three corners, then the middles of the edges from each to the next.
constexpr int kTetrahedronFaces[4][6] = {
    {0, 2, 1, 6, 5, 4}, {0, 1, 3, 4, 8, 7}, {1, 2, 3, 5, 9, 8}, {0, 3, 2, 7, 9, 6}};

/// Faces of a single element, in the order in which they were added.
template <std::size_t kNodes>
class OpenFaces {
 public:
  void add(const std::array<std::uint32_t, kNodes>& face) {
    std::array<std::uint32_t, kNodes> key = face;
    std::sort(key.begin(), key.end());
    const auto [found, is_new] = known_.try_emplace(key, faces_.size());
    if (is_new) {
      faces_.push_back({face, true});
    } else {
      faces_[found->second].open = false;
    }
  }
  template <class Visit>
  void for_each(const Visit& visit) const {
    for (const Face& face : faces_) {
      if (face.open) visit(face.nodes);
    }
  }

 private:
  struct Face {
    std::array<std::uint32_t, kNodes> nodes;
    bool open;
  };
  std::vector<Face> faces_;
  std::map<std::array<std::uint32_t, kNodes>, std::size_t> known_;
};

}  // namespace

SolidMesh mesh_of_box(const Vec3& size, const std::array<int, 3>& counts) {
  BlockBuilder blocks(1e-7 * std::max({size.x, size.y, size.z}));
  blocks.add_block(counts, [&](const Vec3& u) { return (u - Vec3(0.5)) * size; });
  return blocks.take();
}

SolidMesh mesh_of_primitive(const ObjectSpec& spec, int resolution) {
  switch (spec.shape) {
    case ShapeKind::cube:
    case ShapeKind::box: {
      const Vec3 size = spec.shape == ShapeKind::cube ? Vec3(spec.edge) : spec.size;
      const double longest = std::max({size.x, size.y, size.z});
      return mesh_of_box(
          size, {count_along(size.x, longest, resolution), count_along(size.y, longest, resolution),
                 count_along(size.z, longest, resolution)});
    }
    case ShapeKind::cylinder:
      return mesh_of_cylinder(spec.radius, spec.height, resolution);
    case ShapeKind::sphere:
      return mesh_of_ball(spec.radius, resolution);
    case ShapeKind::cone:
    case ShapeKind::mesh:
    case ShapeKind::none:
    case ShapeKind::compound:
      break;
  }
  throw std::invalid_argument("no hexahedra for this shape");
}

std::vector<SolidFace> surface_of(const SolidMesh& mesh) {
  std::vector<SolidFace> surface;
  OpenFaces<4> squares;
  for (const Hexahedron& element : mesh.hexahedra) {
    for (const auto& f : kHexahedronFaces)
      squares.add({element[f[0]], element[f[1]], element[f[2]], element[f[3]]});
  }
  squares.for_each([&](const auto& f) {
    surface.push_back({f[0], f[1], f[2]});
    surface.push_back({f[0], f[2], f[3]});
  });
  OpenFaces<6> triangles;
  for (const QuadraticTetrahedron& element : mesh.tetrahedra) {
    for (const auto& f : kTetrahedronFaces)
      triangles.add({element[f[0]], element[f[1]], element[f[2]], element[f[3]], element[f[4]],
                     element[f[5]]});
  }
  triangles.for_each([&](const auto& f) {
    surface.push_back({f[0], f[3], f[5]});
    surface.push_back({f[3], f[1], f[4]});
    surface.push_back({f[5], f[4], f[2]});
    surface.push_back({f[3], f[4], f[5]});
  });
  return surface;
}

}  // namespace palpate::stimuli
