#include "runner/evidence/scenes/meshes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <memory>
#include <numbers>
#include <queue>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "data/base/random.h"
#include "stimuli/grid_hull.h"
#include "stimuli/primitives.h"

namespace palpate::runner::evidence {
namespace {

/// Squared distance from some planes: p A p + 2 b p + c.
struct Quadric {
  Mat3 a{0};
  Vec3 b{0};
  double c = 0;

  void add_plane(const Vec3& normal, double offset, double weight) {
    a += weight * glm::outerProduct(normal, normal);
    b -= weight * offset * normal;
    c += weight * offset * offset;
  }
  void add(const Quadric& other) {
    a += other.a;
    b += other.b;
    c += other.c;
  }
  double at(const Vec3& p) const { return glm::dot(p, a * p) + 2 * glm::dot(b, p) + c; }
};

class Simplifier {
 public:
  explicit Simplifier(const stimuli::ClosedSurface& surface)
      : vertices_(surface.vertices), faces_(surface.triangles) {
    of_vertex_.resize(vertices_.size());
    quadrics_.resize(vertices_.size());
    stamps_.resize(vertices_.size());
    alive_.assign(faces_.size(), true);
    for (std::uint32_t f = 0; f < faces_.size(); ++f) {
      const Vec3 across = across_of(f);
      const double area = glm::length(across);
      for (const std::uint32_t v : faces_[f]) {
        of_vertex_[v].insert(f);
        if (area > 0) {
          const Vec3 normal = across / area;
          quadrics_[v].add_plane(normal, glm::dot(normal, vertices_[faces_[f][0]]), area);
        }
      }
    }
    for (const auto& face : faces_) {
      for (std::size_t k = 0; k < 3; ++k) {
        if (face[k] < face[(k + 1) % 3]) offer(face[k], face[(k + 1) % 3]);
      }
    }
  }

  stimuli::PolygonSoup down_to(std::size_t triangles) {
    std::size_t left = faces_.size();
    while (left > triangles && !queue_.empty()) {
      const Collapse next = queue_.top();
      queue_.pop();
      if (next.stamp != stamps_[next.keep] + stamps_[next.drop]) continue;
      if (of_vertex_[next.keep].empty() || of_vertex_[next.drop].empty()) continue;
      left -= collapse(next);
    }
    return result();
  }

 private:
  struct Collapse {
    double cost = 0;
    std::uint32_t keep = 0, drop = 0;
    std::uint64_t stamp = 0;
    Vec3 to{0};
    bool operator<(const Collapse& other) const {
      return std::tie(cost, keep, drop) > std::tie(other.cost, other.keep, other.drop);
    }
  };

  Vec3 across_of(std::uint32_t f) const {
    const auto& [a, b, c] = faces_[f];
    return glm::cross(vertices_[b] - vertices_[a], vertices_[c] - vertices_[a]);
  }

  void offer(std::uint32_t keep, std::uint32_t drop) {
    Quadric sum = quadrics_[keep];
    sum.add(quadrics_[drop]);
    Collapse one{0, keep, drop, stamps_[keep] + stamps_[drop],
                 0.5 * (vertices_[keep] + vertices_[drop])};
    const double trace = sum.a[0][0] + sum.a[1][1] + sum.a[2][2];
    if (std::abs(glm::determinant(sum.a)) > 1e-6 * trace * trace * trace) {
      const Vec3 best = glm::inverse(sum.a) * -sum.b;
      const double length = glm::distance(vertices_[keep], vertices_[drop]);
      if (glm::distance(best, one.to) < length) one.to = best;
    }
    one.cost = std::max(0.0, sum.at(one.to));
    queue_.push(one);
  }

  std::set<std::uint32_t> neighbours(std::uint32_t v) const {
    std::set<std::uint32_t> all;
    for (const std::uint32_t f : of_vertex_[v]) all.insert(faces_[f].begin(), faces_[f].end());
    all.erase(v);
    return all;
  }

  bool keeps_shape(const Collapse& one, const std::set<std::uint32_t>& around_keep,
                   const std::set<std::uint32_t>& around_drop) const {
    std::size_t common = 0, shared = 0;
    for (const std::uint32_t v : around_keep) common += around_drop.count(v);
    for (const std::uint32_t f : of_vertex_[one.keep]) shared += of_vertex_[one.drop].count(f);
    if (common != 2 || shared != 2) return false;
    for (const std::uint32_t v : {one.keep, one.drop}) {
      for (const std::uint32_t f : of_vertex_[v]) {
        if (of_vertex_[one.keep].count(f) + of_vertex_[one.drop].count(f) == 2) continue;
        std::array<Vec3, 3> moved{};
        for (std::size_t k = 0; k < 3; ++k)
          moved[k] = faces_[f][k] == v ? one.to : vertices_[faces_[f][k]];
        const Vec3 before = across_of(f),
                   after = glm::cross(moved[1] - moved[0], moved[2] - moved[0]);
        if (!(glm::dot(before, after) > 0.3 * glm::length(before) * glm::length(after)))
          return false;
      }
    }
    return true;
  }

  std::size_t collapse(const Collapse& one) {
    const auto around_keep = neighbours(one.keep), around_drop = neighbours(one.drop);
    if (!keeps_shape(one, around_keep, around_drop)) return 0;
    std::size_t gone = 0;
    const std::set<std::uint32_t> dropped = of_vertex_[one.drop];
    for (const std::uint32_t f : dropped) {
      if (of_vertex_[one.keep].count(f) > 0) {
        alive_[f] = false;
        for (const std::uint32_t v : faces_[f]) of_vertex_[v].erase(f);
        ++gone;
        continue;
      }
      std::ranges::replace(faces_[f], one.drop, one.keep);
      of_vertex_[one.keep].insert(f);
    }
    of_vertex_[one.drop].clear();
    vertices_[one.keep] = one.to;
    quadrics_[one.keep].add(quadrics_[one.drop]);
    ++stamps_[one.keep];
    for (const std::uint32_t v : neighbours(one.keep)) offer(one.keep, v);
    return gone;
  }

  stimuli::PolygonSoup result() const {
    stimuli::PolygonSoup soup;
    std::vector<std::uint32_t> number(vertices_.size(), ~0U);
    for (std::uint32_t f = 0; f < faces_.size(); ++f) {
      if (!alive_[f]) continue;
      std::vector<std::uint32_t> face;
      for (const std::uint32_t v : faces_[f]) {
        if (number[v] == ~0U) {
          number[v] = static_cast<std::uint32_t>(soup.vertices.size());
          soup.vertices.push_back(vertices_[v]);
        }
        face.push_back(number[v]);
      }
      soup.faces.push_back(std::move(face));
    }
    return soup;
  }

  std::vector<Vec3> vertices_;
  std::vector<std::array<std::uint32_t, 3>> faces_;
  std::vector<std::set<std::uint32_t>> of_vertex_;
  std::vector<Quadric> quadrics_;
  std::vector<std::uint64_t> stamps_;
  std::vector<bool> alive_;
  std::priority_queue<Collapse> queue_;
};

/// Walls of a ring: round outside and inside, and the two faces between, `count` corners each.
stimuli::PolygonSoup ring(int count, double height, const std::function<Vec3(int)>& outer,
                          const std::function<Vec3(int)>& inner) {
  stimuli::PolygonSoup soup;
  for (const double z : {-height / 2, height / 2}) {
    for (const auto& side : {outer, inner}) {
      for (int i = 0; i < count; ++i) {
        const Vec3 at = side(i);
        soup.vertices.emplace_back(at.x, at.y, z);
      }
    }
  }
  const auto n = static_cast<std::uint32_t>(count);
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t j = (i + 1) % n;
    soup.faces.push_back({i, j, 2 * n + j, 2 * n + i});                  // outside
    soup.faces.push_back({n + j, n + i, 3 * n + i, 3 * n + j});          // bore
    soup.faces.push_back({2 * n + i, 2 * n + j, 3 * n + j, 3 * n + i});  // top
    soup.faces.push_back({j, i, n + i, n + j});                          // bottom
  }
  return soup;
}

}  // namespace

stimuli::ObjectSpec mesh_object(const stimuli::PolygonSoup& soup, const std::string& name) {
  std::string text;
  std::array<char, 120> line{};
  for (const Vec3& v : soup.vertices) {
    const int length =
        std::snprintf(line.data(), line.size(), "v %.17g %.17g %.17g\n", v.x, v.y, v.z);
    text.append(line.data(), static_cast<std::size_t>(length));
  }
  for (const auto& face : soup.faces) {
    text += 'f';
    for (const std::uint32_t v : face) text += ' ' + std::to_string(v + 1);
    text += '\n';
  }
  stimuli::ObjectSpec object;
  object.shape = stimuli::ShapeKind::mesh;
  object.file = object.file_name = name;
  object.file_bytes = std::make_shared<const std::string>(std::move(text));
  return object;
}

stimuli::PolygonSoup coarsened(const stimuli::ClosedSurface& surface, std::size_t triangles) {
  return Simplifier(surface).down_to(triangles);
}

void add_corners(const stimuli::ObjectSpec& object, const Pose& parent, std::vector<Vec3>& out) {
  if (object.shape == stimuli::ShapeKind::compound) {
    for (const stimuli::ObjectSpec& part : object.parts)
      add_corners(part, stimuli::compose(parent, part.pose), out);
    return;
  }
  for (const Vec3& v : stimuli::polygons_of(object).vertices)
    out.push_back(parent.orientation * v + parent.position);
}

stimuli::ObjectSpec hull_of(const stimuli::ObjectSpec& object, int number) {
  if (object.soft || object.body) return object;
  std::vector<Vec3> corners;
  add_corners(object, Pose{}, corners);
  double size = 0;
  for (const Vec3& v : corners) size = std::max(size, glm::distance(v, corners.front()));
  stimuli::ObjectSpec hull = mesh_object(stimuli::grid_hull(corners, 1e-9 * size).soup,
                                         "hull-" + std::to_string(number) + ".obj");
  hull.pose = object.pose;
  hull.material = object.material;
  return hull;
}

stimuli::PolygonSoup gear(int teeth) {
  const int count = 4 * teeth;
  const auto on = [count](double radius, int i) {
    const double angle = 2 * std::numbers::pi * i / count;
    return radius * Vec3(std::cos(angle), std::sin(angle), 0);
  };
  return ring(
      count, 0.012, [&](int i) { return on(i % 4 < 2 ? 0.03 : 0.024, i); },
      [&](int i) { return on(0.008, i); });
}

stimuli::PolygonSoup plate_with_bores(int columns) {
  // Cells side by side; the walls between them, which two cells have, are left out.
  constexpr int kSides = 32;
  constexpr double kHeight = 0.008, kSize = 0.06;
  const double cell = kSize / columns;
  stimuli::PolygonSoup all;
  for (int column = 0; column < columns; ++column) {
    for (int row = 0; row < columns; ++row) {
      // Corners of all cells come from whole numbers, so that they are equal to the bit.
      const auto at = [&](double x, double y) {
        return Vec3((2 * column + 1 + x) * (cell / 2) - kSize / 2,
                    (2 * row + 1 + y) * (cell / 2) - kSize / 2, 0);
      };
      const auto outer = [&](int i) {
        const int side = i / (kSides / 4);
        const double along = -1 + 8.0 * (i % (kSides / 4)) / kSides;
        return side == 0   ? at(1, along)
               : side == 1 ? at(-along, 1)
               : side == 2 ? at(-1, -along)
                           : at(along, -1);
      };
      const auto inner = [&](int i) {
        const double angle = 2 * std::numbers::pi * (i - kSides / 8.0) / kSides;
        return at(0.6 * std::cos(angle), 0.6 * std::sin(angle));
      };
      const stimuli::PolygonSoup one = ring(kSides, kHeight, outer, inner);
      const auto first = static_cast<std::uint32_t>(all.vertices.size());
      all.vertices.insert(all.vertices.end(), one.vertices.begin(), one.vertices.end());
      for (std::size_t f = 0; f < one.faces.size(); ++f) {
        const int side = static_cast<int>(f / 4) / (kSides / 4);
        const bool inside = (side == 0 && column + 1 < columns) ||
                            (side == 1 && row + 1 < columns) || (side == 2 && column > 0) ||
                            (side == 3 && row > 0);
        if (f % 4 == 0 && inside) continue;
        std::vector<std::uint32_t> face = one.faces[f];
        for (std::uint32_t& v : face) v += first;
        all.faces.push_back(std::move(face));
      }
    }
  }
  return all;
}

stimuli::PolygonSoup scan(int subdivisions) {
  constexpr double kRadius = 0.03, kNoise = 2e-5;  // m
  stimuli::PolygonSoup soup = stimuli::icosphere(kRadius, subdivisions);
  Random random(7);
  for (Vec3& v : soup.vertices) {
    const Vec3 out = v / kRadius;
    const double bumps =
        0.05 * (std::sin(7 * out.x + 1) + std::sin(6 * out.y + 2) * std::cos(5 * out.z));
    v = (kRadius * (1 + bumps) + kNoise * random.normal()) * out;
  }
  return soup;
}

}  // namespace palpate::runner::evidence
