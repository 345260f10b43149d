#pragma once
// Closed solids that are not convex, built from a definition that gives their volume and the points
// inside.

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include "data/base/random.h"
#include "stimuli/orientation.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"

namespace palpate::stimuli::solids {

struct Solid {
  PolygonSoup soup;
  double volume = 0;                       ///< m^3
  std::function<bool(const Vec3&)> holds;  ///< whether a point is inside; may be empty
};

using Outline = std::vector<std::array<double, 2>>;  // counter-clockwise

inline double area_of(const Outline& outline) {
  double twice = 0;
  for (std::size_t k = 0; k < outline.size(); ++k) {
    const auto& a = outline[k];
    const auto& b = outline[(k + 1) % outline.size()];
    twice += a[0] * b[1] - a[1] * b[0];
  }
  return twice / 2;
}

inline bool in_outline(const Outline& outline, double x, double y) {
  bool in = false;
  for (std::size_t k = 0; k < outline.size(); ++k) {
    const auto& a = outline[k];
    const auto& b = outline[(k + 1) % outline.size()];
    if ((a[1] > y) != (b[1] > y) && x < a[0] + (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1])) in = !in;
  }
  return in;
}

/// How the ends of a disk are cut into triangles: in a fan from its notch, from its middle, or in a
/// zigzag from side to side.
enum class Cut { from_notch, from_middle, zigzag };

/// A disk of 30 mm with a notch, from z = 0 to 5 mm, of n corners.
inline PolygonSoup notched_disk(std::uint32_t n, Cut cut) {
  constexpr double kRadius = 0.03, kThick = 0.005;  // m
  PolygonSoup soup;
  for (const double z : {0.0, kThick}) {
    for (std::uint32_t k = 0; k < n; ++k) {
      const double angle = 2 * std::numbers::pi * k / n, radius = (k == 0 ? 0.9 : 1) * kRadius;
      soup.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
    }
  }
  const auto cut_ends = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    soup.faces.push_back({n + a, n + b, n + c});
    soup.faces.push_back({a, c, b});
  };
  for (std::uint32_t k = 0; k < n; ++k) {
    const std::uint32_t next = (k + 1) % n;
    soup.faces.push_back({k, next, n + next});
    soup.faces.push_back({k, n + next, n + k});
    if (cut == Cut::from_notch && k > 0 && next > 0) cut_ends(0, k, next);
    if (cut != Cut::from_middle) continue;
    soup.faces.push_back({2 * n, next, k});
    soup.faces.push_back({2 * n + 1, n + k, n + next});
  }
  if (cut == Cut::from_middle) {
    soup.vertices.emplace_back(0, 0, 0);
    soup.vertices.emplace_back(0, 0, kThick);
  }
  if (cut != Cut::zigzag) return soup;
  // From the notch to an eighth of the way round on both sides, then across.
  std::uint32_t left = n / 8, right = n - left;
  for (std::uint32_t k = 1; k < left; ++k) {
    cut_ends(0, k, k + 1);
    cut_ends(0, n - k - 1, n - k);
  }
  cut_ends(0, left, right);
  for (bool on_left = true; left + 1 < right; on_left = !on_left) {
    if (on_left) {
      cut_ends(right, left, left + 1);
      ++left;
    } else {
      cut_ends(right, left, right - 1);
      --right;
    }
  }
  return soup;
}

/// A prism on an outline in the xy plane, from z = 0 up. Its ends are one polygon each.
inline Solid prism(const Outline& outline, double height) {
  Solid solid;
  const auto n = static_cast<std::uint32_t>(outline.size());
  std::vector<std::uint32_t> bottom, top;
  for (std::uint32_t k = 0; k < n; ++k) {
    solid.soup.vertices.emplace_back(outline[k][0], outline[k][1], 0);
    bottom.insert(bottom.begin(), k);
    top.push_back(n + k);
  }
  for (const auto& corner : outline) solid.soup.vertices.emplace_back(corner[0], corner[1], height);
  solid.soup.faces = {bottom, top};
  for (std::uint32_t k = 0; k < n; ++k)
    solid.soup.faces.push_back({k, (k + 1) % n, n + (k + 1) % n, n + k});
  solid.volume = area_of(outline) * height;
  solid.holds = [outline, height](const Vec3& p) {
    return p.z > 0 && p.z < height && in_outline(outline, p.x, p.y);
  };
  return solid;
}

/// The boxes of a prism whose outline has sides along x and y only: disjoint, abutting.
inline std::vector<PolygonSoup> slabs(const Outline& outline, double height) {
  std::set<double> ys;
  for (const auto& corner : outline) ys.insert(corner[1]);
  std::vector<PolygonSoup> boxes;
  for (auto low = ys.begin(); std::next(low) != ys.end(); ++low) {
    const double middle = (*low + *std::next(low)) / 2;
    std::set<double> xs;
    for (std::size_t k = 0; k < outline.size(); ++k) {
      const auto &a = outline[k], &b = outline[(k + 1) % outline.size()];
      if ((a[1] > middle) != (b[1] > middle)) xs.insert(a[0]);
    }
    for (auto x = xs.begin(); x != xs.end(); x = std::next(x, 2)) {
      PolygonSoup box = cube(1);
      for (Vec3& v : box.vertices) {
        v = {v.x < 0 ? *x : *std::next(x), v.y < 0 ? *low : *std::next(low), v.z < 0 ? 0 : height};
      }
      boxes.push_back(std::move(box));
    }
  }
  return boxes;
}

inline const Outline kL = {{0, 0}, {0.06, 0}, {0.06, 0.02}, {0.02, 0.02}, {0.02, 0.06}, {0, 0.06}};
inline Solid l_shape() { return prism(kL, 0.03); }
inline const Outline kU = {{0, 0},       {0.06, 0},    {0.06, 0.05}, {0.04, 0.05},
                           {0.04, 0.02}, {0.02, 0.02}, {0.02, 0.05}, {0, 0.05}};
inline Solid u_shape() { return prism(kU, 0.03); }
inline const Outline kPlus = {{-1, -3}, {1, -3}, {1, -1}, {3, -1}, {3, 1},   {1, 1},
                              {1, 3},   {-1, 3}, {-1, 1}, {-3, 1}, {-3, -1}, {-1, -1}};
inline Solid plus_shape() { return prism(kPlus, 2); }
inline Outline stair_outline(int steps) {
  Outline outline{{0, 0}, {0.1, 0}};
  for (int k = 0; k < steps; ++k) {
    outline.push_back({0.1 - 0.1 * k / steps, 0.08 * (k + 1) / steps});
    outline.push_back({0.1 - 0.1 * (k + 1) / steps, 0.08 * (k + 1) / steps});
  }
  return outline;
}
inline Solid stair(int steps) { return prism(stair_outline(steps), 0.05); }

/// An outline that is a star seen from the origin: no side crosses another.
inline Outline random_outline(Random& random, int corners) {
  Outline outline;
  for (int k = 0; k < corners; ++k) {
    const double angle = 2 * std::numbers::pi * (k + 0.8 * random.unit()) / corners;
    const double radius = 0.01 + 0.05 * random.unit();
    outline.push_back({radius * std::cos(angle), radius * std::sin(angle)});
  }
  return outline;
}

/// A polygonal torus about z: `around` sections of `corners` corners each.
inline Solid torus(double ring, double tube, int around, int corners) {
  Solid solid;
  for (int i = 0; i < around; ++i) {
    const double u = 2 * std::numbers::pi * i / around;
    for (int j = 0; j < corners; ++j) {
      const double v = 2 * std::numbers::pi * j / corners;
      const double r = ring + tube * std::cos(v);
      solid.soup.vertices.emplace_back(r * std::cos(u), r * std::sin(u), tube * std::sin(v));
    }
  }
  const auto at = [&](int i, int j) {
    return static_cast<std::uint32_t>((i % around) * corners + j % corners);
  };
  for (int i = 0; i < around; ++i) {
    for (int j = 0; j < corners; ++j)
      solid.soup.faces.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
  }
  // Between half planes at an angle through the axis, cut off by the chord: Pappus.
  const double section = corners / 2.0 * tube * tube * std::sin(2 * std::numbers::pi / corners);
  solid.volume = around * section * ring * std::sin(2 * std::numbers::pi / around);
  return solid;
}

/// Its sections, each convex.
inline std::vector<PolygonSoup> torus_sections(double ring, double tube, int around, int corners) {
  const PolygonSoup whole = torus(ring, tube, around, corners).soup;
  std::vector<PolygonSoup> sections;
  for (int i = 0; i < around; ++i) {
    PolygonSoup& section = sections.emplace_back();
    std::vector<std::uint32_t> near, far;
    for (int end = 0; end < 2; ++end) {
      for (int j = 0; j < corners; ++j)
        section.vertices.push_back(whole.vertices[static_cast<std::size_t>((i + end) % around) *
                                                      static_cast<std::size_t>(corners) +
                                                  static_cast<std::size_t>(j)]);
    }
    for (int j = 0; j < corners; ++j) {
      const auto a = static_cast<std::uint32_t>(j),
                 b = static_cast<std::uint32_t>((j + 1) % corners),
                 n = static_cast<std::uint32_t>(corners);
      section.faces.push_back({a, n + a, n + b, b});
      near.push_back(a);
      far.insert(far.begin(), n + a);
    }
    section.faces.push_back(near);
    section.faces.push_back(far);
  }
  return sections;
}

/// Boxes of an irregular grid, chosen by `filled`, with faces between filled and empty ones. Only
/// for grids without an edge of four faces or a corner of several rings; see `simple`.
struct Blocks {
  std::array<std::vector<double>, 3> lines;  ///< m
  std::set<std::array<int, 3>> filled;

  bool is_filled(int x, int y, int z) const { return filled.count({x, y, z}) != 0; }

  bool simple() const {
    const int nx = static_cast<int>(lines[0].size()), ny = static_cast<int>(lines[1].size()),
              nz = static_cast<int>(lines[2].size());
    for (int x = 0; x < nx; ++x) {
      for (int y = 0; y < ny; ++y) {
        for (int z = 0; z < nz; ++z) {
          // The eight boxes around a grid corner: filled and empty ones are each connected by
          // faces.
          for (const bool kind : {false, true}) {
            std::vector<std::array<int, 3>> some;
            for (int k = 0; k < 8; ++k) {
              const std::array<int, 3> box{x - (k & 1), y - (k >> 1 & 1), z - (k >> 2 & 1)};
              if ((filled.count(box) != 0) == kind) some.push_back(box);
            }
            if (some.size() < 2) continue;
            std::set<std::array<int, 3>> reached{some[0]};
            for (std::size_t round = 0; round < some.size(); ++round) {
              for (const auto& box : some) {
                for (const auto& from : some) {
                  const int apart = std::abs(box[0] - from[0]) + std::abs(box[1] - from[1]) +
                                    std::abs(box[2] - from[2]);
                  if (apart == 1 && reached.count(from) != 0) reached.insert(box);
                }
              }
            }
            if (reached.size() != some.size()) return false;
          }
        }
      }
    }
    return true;
  }

  Solid solid() const {
    Solid out;
    std::map<std::array<int, 3>, std::uint32_t> number;
    const auto corner = [&](std::array<int, 3> c) {
      const auto [at, is_new] =
          number.try_emplace(c, static_cast<std::uint32_t>(out.soup.vertices.size()));
      if (is_new) {
        Vec3 place;
        for (int axis = 0; axis < 3; ++axis)
          place[axis] = lines[static_cast<std::size_t>(axis)]
                             [static_cast<std::size_t>(c[static_cast<std::size_t>(axis)])];
        out.soup.vertices.push_back(place);
      }
      return at->second;
    };
    for (const auto& box : filled) {
      double volume = 1;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto at = static_cast<std::size_t>(box[axis]);
        volume *= lines[axis][at + 1] - lines[axis][at];
        for (const int side : {0, 1}) {
          std::array<int, 3> beyond = box;
          beyond[axis] += side == 1 ? 1 : -1;
          if (filled.count(beyond) != 0) continue;
          const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
          std::vector<std::uint32_t> face;
          for (const auto& [du, dv] : {std::pair(0, 0), {1, 0}, {1, 1}, {0, 1}}) {
            std::array<int, 3> c = box;
            c[axis] += side;
            c[u] += du;
            c[v] += dv;
            face.push_back(corner(c));
          }
          if (side == 0) face = {face[3], face[2], face[1], face[0]};
          out.soup.faces.push_back(face);
        }
      }
      out.volume += volume;
    }
    out.holds = [blocks = *this](const Vec3& p) {
      std::array<int, 3> box{};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto& l = blocks.lines[axis];
        int k = -1;
        while (k + 1 < static_cast<int>(l.size()) &&
               p[static_cast<int>(axis)] > l[static_cast<std::size_t>(k) + 1])
          ++k;
        box[axis] = k;
      }
      return blocks.filled.count(box) != 0;
    };
    return out;
  }
};

/// A random simple cluster of boxes.
inline Solid random_blocks(Random& random, int cells) {
  while (true) {
    Blocks blocks;
    for (auto& lines : blocks.lines) {
      lines.push_back(0);
      for (int k = 0; k < 4; ++k) lines.push_back(lines.back() + 0.004 + 0.03 * random.unit());
    }
    std::array<int, 3> at{1, 1, 1};
    for (int k = 0; k < cells; ++k) {
      blocks.filled.insert(at);
      const std::size_t axis = random.below(3);
      at[axis] = std::min(3, std::max(0, at[axis] + (random.below(2) == 0 ? -1 : 1)));
    }
    if (blocks.simple()) return blocks.solid();
  }
}

/// A row of square blocks with a bore through each along z: a prism with `sides` (a multiple of 8)
/// sides. The faces with bores are strips of quadrilaterals.
inline Solid bored_block(int bores, int sides, double radius, double half, double height) {
  Solid solid;
  const auto vertex = [&](double x, double y, double z) {
    solid.soup.vertices.emplace_back(x, y, z);
    return static_cast<std::uint32_t>(solid.soup.vertices.size() - 1);
  };
  for (int b = 0; b < bores; ++b) {
    std::vector<std::array<std::uint32_t, 4>> rim;  // inner bottom, inner top, outer bottom, top
    const double cx = 2 * half * b;
    for (int k = 0; k < sides; ++k) {
      const double angle = 2 * std::numbers::pi * k / sides;
      const double c = std::cos(angle), s = std::sin(angle);
      const double out = half / std::max(std::abs(c), std::abs(s));
      const auto snap = [&](double value) {
        return std::abs(std::abs(value) - half) < 1e-12 ? std::copysign(half, value) : value;
      };
      const double x = cx + snap(out * c), y = snap(out * s);
      rim.push_back({vertex(cx + radius * c, radius * s, 0),
                     vertex(cx + radius * c, radius * s, height), vertex(x, y, 0),
                     vertex(x, y, height)});
    }
    for (int k = 0; k < sides; ++k) {
      const auto& a = rim[static_cast<std::size_t>(k)];
      const auto& n = rim[static_cast<std::size_t>((k + 1) % sides)];
      solid.soup.faces.push_back({a[1], a[3], n[3], n[1]});  // top
      solid.soup.faces.push_back({a[0], n[0], n[2], a[2]});  // bottom
      solid.soup.faces.push_back({a[0], a[1], n[1], n[0]});  // bore
      const double middle = 2 * std::numbers::pi * (k + 0.5) / sides;
      const bool right = std::cos(middle) > std::abs(std::sin(middle));
      const bool left = -std::cos(middle) > std::abs(std::sin(middle));
      if ((right && b + 1 < bores) || (left && b > 0)) continue;
      solid.soup.faces.push_back({a[2], n[2], n[3], a[3]});
    }
  }
  const double hole = sides / 2.0 * radius * radius * std::sin(2 * std::numbers::pi / sides);
  solid.volume = bores * (4 * half * half - hole) * height;
  solid.holds = [=](const Vec3& p) {
    if (p.z < 0 || p.z > height || std::abs(p.y) > half || p.x < -half ||
        p.x > (2 * bores - 1) * half)
      return false;
    const double x = p.x - 2 * half * std::round(p.x / (2 * half));
    for (int k = 0; k < sides; ++k) {
      const double middle = 2 * std::numbers::pi * (k + 0.5) / sides;
      if (x * std::cos(middle) + p.y * std::sin(middle) >
          radius * std::cos(std::numbers::pi / sides))
        return true;
    }
    return false;
  };
  return solid;
}

inline Solid moved(Solid solid, const Quat& turn, double scale, const Vec3& by) {
  for (Vec3& vertex : solid.soup.vertices) vertex = scale * (turn * vertex) + by;
  solid.volume *= scale * scale * scale;
  if (solid.holds) {
    solid.holds = [holds = solid.holds, turn, scale, by](const Vec3& p) {
      return holds(glm::conjugate(turn) * ((p - by) / scale));
    };
  }
  return solid;
}

/// Polygons as triangle fans from the first corner; convex ones only.
inline void split_polygons(PolygonSoup& soup) {
  std::vector<std::vector<std::uint32_t>> triangles;
  for (const auto& face : soup.faces) {
    for (std::size_t k = 2; k < face.size(); ++k)
      triangles.push_back({face[0], face[k - 1], face[k]});
  }
  soup.faces = triangles;
}

}  // namespace palpate::stimuli::solids
