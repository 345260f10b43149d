#include "runner/evidence/verification/random_solids.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <numbers>
#include <utility>

#include "runner/evidence/verification/reference.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/orientation.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"

namespace palpate::runner::evidence {
namespace {

/// 10 to a random power.
double magnitude(Random& random, double low_power, double high_power) {
  return std::pow(10, between(random, low_power, high_power));
}

Vec3 unit_or_x(const Vec3& v) {
  const double length = glm::length(v);
  return length > 1e-6 ? v / length : Vec3(1, 0, 0);
}

/// A smooth random function within [-1, 1].
class Wave {
 public:
  explicit Wave(Random& random) {
    for (std::size_t i = 0; i < rates_.size(); ++i) {
      rates_[i] = between(random, 0.3, 1) * static_cast<double>(i + 1);
      phases_[i] = between(random, 0, 2 * std::numbers::pi);
    }
  }
  double operator()(double at) const {
    double sum = 0;
    for (std::size_t i = 0; i < rates_.size(); ++i) sum += std::sin(rates_[i] * at + phases_[i]);
    return sum / 3;
  }

 private:
  std::array<double, 3> rates_{}, phases_{};
};

struct Wave3 {
  explicit Wave3(Random& random) : x(random), y(random), z(random) {}
  Vec3 operator()(double at) const { return {x(at), y(at), z(at)}; }
  Wave x, y, z;
};

/// Builds a path pose by pose.
struct PathBuilder {
  Random& random;
  const stimuli::ConvexMesh& mesh;
  double length;
  bool side;
  std::size_t ticks;
  std::vector<rendering::LineProbe> path;

  bool full() const { return path.size() >= ticks; }

  /// The probe whose point at this fraction from tip to tail is at `at`.
  rendering::LineProbe probe(const Vec3& at, const Vec3& direction, double fraction) const {
    return {at - fraction * length * direction, at + (1 - fraction) * length * direction};
  }

  double some_fraction() { return side ? random.unit() : 0; }

  Vec3 middle() const {
    Vec3 sum;
    for (const Vec3& v : mesh.vertices()) sum += v;
    return sum / static_cast<double>(mesh.vertices().size());
  }

  void smooth() {
    const Wave3 position(random), turn(random);
    const Wave fraction(random);
    const double step = magnitude(random, -4, -1.5);
    const double reach = 1.5 * mesh.radius();
    for (double at = 0; !full(); at += step) {
      path.push_back(probe(mesh.centre() + reach * position(at), unit_or_x(turn(at)),
                           side ? 0.5 + 0.5 * fraction(at) : 0));
    }
  }

  void sliding() {
    const Vec3 inside = middle();
    const double thickness = reference_depth(mesh, {inside, inside}).depth;
    const double press = magnitude(random, -3, 0.5) * thickness;
    const double step = magnitude(random, -4, -1);
    const Wave3 position(random), turn(random);
    const Wave fraction(random), pressing(random);
    for (double at = 0; !full(); at += step) {
      const Vec3 out = unit_or_x(position(at)), direction = unit_or_x(turn(at));
      const double at_fraction = side ? 0.5 + 0.5 * fraction(at) : 0;
      double in = 0, outside = 2 * mesh.size() + length;
      for (int halving = 0; halving < 20; ++halving) {
        const double half = (in + outside) / 2;
        rendering::LineProbe there = probe(inside + half * out, direction, at_fraction);
        if (!side) there.tail = there.tip;
        (reference_depth(mesh, there).depth > 0 ? in : outside) = half;
      }
      const double depth = press * (0.35 + pressing(at));
      path.push_back(probe(inside + (in - depth) * out, direction, at_fraction));
    }
  }

  void fast() {
    constexpr double kFiveMetresASecond = 0.005;  // m a tick
    while (!full()) {
      const double step =
          random.below(2) ? kFiveMetresASecond : mesh.size() * magnitude(random, -2, 0.5);
      const Vec3 aim = mesh.centre() + 0.6 * mesh.size() * random.unit() * random_direction(random);
      const Vec3 motion = random_direction(random), from = random_direction(random);
      const Vec3 axis = random_direction(random);
      const double turn_a_tick = magnitude(random, -4, 0);
      const double fraction = some_fraction();
      const double legs = std::clamp((mesh.size() + length) / step, 2.0, 20.0);
      double gone = -step * (legs + random.unit());
      for (int leg = 0; leg <= 2 * legs && !full(); ++leg, gone += step) {
        const Vec3 direction = glm::angleAxis(turn_a_tick * leg, axis) * from;
        path.push_back(probe(aim + gone * motion, direction, fraction));
      }
    }
  }

  void plunges() {
    while (!full()) {
      // Through a weighted mean of corners, which is inside.
      Vec3 at = mesh.vertices()[0];
      for (int i = 1; i < 5; ++i) {
        at = glm::mix(at, mesh.vertices()[random.below(mesh.vertices().size())], random.unit());
      }
      const rendering::LineProbe inside = probe(at, random_direction(random), some_fraction());
      const rendering::LineProbe touching{inside.tip, side ? inside.tail : inside.tip};
      const ReferenceDepth reference = reference_depth(mesh, touching);
      if (reference.depth <= 0) continue;
      const Vec3 motion = random.below(2) ? reference.normal
                                          : unit_or_x(reference.normal + random_direction(random));
      const double start = reference.depth + mesh.size() * magnitude(random, -16, 0);
      const double deepest = reference.depth * between(random, -2, 1);
      path.push_back(
          {inside.tip + 2 * mesh.size() * motion, inside.tail + 2 * mesh.size() * motion});
      const int steps = 1 + static_cast<int>(random.below(6));
      for (int i = 0; i <= 2 * steps && !full(); ++i) {
        const double out = start + (deepest - start) * (steps - std::abs(i - steps)) / steps;
        path.push_back({inside.tip + out * motion, inside.tail + out * motion});
      }
    }
  }

  void jumps() {
    while (!full()) {
      const double reach = random.below(2) ? mesh.radius() : 2 * mesh.size() + length;
      path.push_back(probe(mesh.centre() + reach * random.unit() * random_direction(random),
                           random_direction(random), some_fraction()));
    }
  }

  /// 0, or of any magnitude from 1e-17 to 1e-2.
  double tiny() {
    const double amount = random.below(3) ? magnitude(random, -17, -2) : 0;
    return random.below(2) ? amount : -amount;
  }

  void aligned() {
    const double size = mesh.size();
    const auto pick = [&](const auto& items) { return items[random.below(items.size())]; };
    while (!full()) {
      const stimuli::Edge edge = pick(mesh.edges());
      const Vec3 &v0 = edge.from, &v1 = edge.to;
      const Vec3 along = glm::normalize(v1 - v0);
      const Vec3 normal = mesh.facets()[edge.left].normal;
      const Vec3 across = glm::cross(normal, along);
      const std::array directions{along, across, normal, unit_or_x(along + across),
                                  unit_or_x(pick(mesh.vertices()) - v0)};
      Vec3 direction = unit_or_x(pick(directions) + tiny() * random_direction(random));
      if (random.below(2)) direction = -direction;
      const Vec3 touch = random.below(2) ? v0 : v0 + random.unit() * (v1 - v0);
      const std::array motions{normal, along, across, direction,
                               unit_or_x(normal + mesh.facets()[edge.right].normal)};
      const Vec3 motion = pick(motions);
      const Vec3 second = pick(motions);
      const double fraction = side && random.below(2)
                                  ? random.unit()
                                  : (side ? static_cast<double>(random.below(2)) : 0);
      const double reach = size * magnitude(random, -6, 0), beside = size * tiny();
      const double turning = random.below(2) ? tiny() : 0;
      const Vec3 axis = random_direction(random);
      const int legs = 4 + static_cast<int>(random.below(20));
      path.push_back(
          probe(touch + 2 * size * unit_or_x(normal + 0.1 * across), direction, fraction));
      for (int leg = 0; leg <= legs && !full(); ++leg) {
        const double turn = 2 * std::numbers::pi * leg / legs;
        const Vec3 at = touch + (reach * std::cos(turn) + beside) * motion +
                        (random.below(4) ? 0 : reach * std::sin(turn)) * second;
        path.push_back(probe(at, glm::angleAxis(turning * leg, axis) * direction, fraction));
      }
    }
  }
};

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

const char* to_string(PathKind kind) {
  constexpr const char* kNames[] = {"smooth", "sliding", "fast", "plunges", "jumps", "aligned"};
  return kNames[static_cast<int>(kind)];
}

std::vector<rendering::LineProbe> random_path(Random& random, PathKind kind,
                                              const stimuli::ConvexMesh& mesh, double length,
                                              bool side, std::size_t ticks) {
  PathBuilder builder{random, mesh, length, side, ticks, {}};
  builder.path.reserve(ticks + 1);
  const double far = 3 * mesh.size() + length;
  builder.path.push_back(builder.probe(mesh.centre() + far * Vec3(0, 0, 1), Vec3(0, 0, 1), 0));
  switch (kind) {
    case PathKind::smooth:
      builder.smooth();
      break;
    case PathKind::sliding:
      builder.sliding();
      break;
    case PathKind::fast:
      builder.fast();
      break;
    case PathKind::plunges:
      builder.plunges();
      break;
    case PathKind::jumps:
      builder.jumps();
      break;
    case PathKind::aligned:
      builder.aligned();
      break;
  }
  builder.path.resize(ticks);
  return std::move(builder.path);
}

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
