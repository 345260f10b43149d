#pragma once
// Contact of a tool with a radius and a soft body, at the servo's rate: the body's place and
// compliance between two of its steps. World frame, SI units. Nothing here throws or allocates,
// except construction of the memory.
//
// The ideal tool is the virtual one, moved (not turned) by a spring of the contact stiffness. Every
// edge of the surface near a segment of the tool, and every triangle near an end of the tool, must
// stay outside the tool's radius: gap_i = g_i + sum of W_ij F_j >= 0, F_i >= 0, gap_i F_i = 0. W is
// the body's compliance at those places within a step (Saupin, Duriez & Cotin 2008, "Contact model
// for haptic medical simulations") with the spring in series, so the number of places changes no
// stiffness. Solved by projected Gauss-Seidel.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <span>
#include <vector>

#include "rendering/bodies/soft/soft_body.h"
#include "rendering/tool.h"
#include "stimuli/vec.h"

namespace palpate::rendering {

// Nearest points of segments and triangles. Pure; m.

struct Segment {
  Vec3 from, along;  ///< to its other end; zero: a point
};

struct NearestOnSegments {
  double own = 0, other = 0;  ///< 0 to 1, on each
};

/// Where two segments are nearest to each other; for parallel ones, the middle of their common
/// length. Ericson 2005, "Real-time collision detection", 5.1.9.
inline NearestOnSegments nearest_on_segments(const Segment& own, const Segment& other) {
  const Vec3 r = own.from - other.from;
  const double a = glm::dot(own.along, own.along), e = glm::dot(other.along, other.along);
  const double f = glm::dot(other.along, r);
  const auto part = [](double x) { return std::clamp(x, 0.0, 1.0); };
  if (!(a > 0)) return {0, e > 0 ? part(f / e) : 0};
  const double c = glm::dot(own.along, r);
  if (!(e > 0)) return {part(-c / a), 0};
  const double b = glm::dot(own.along, other.along), det = a * e - b * b;
  double s = 0;
  if (det > 1e-12 * a * e) {
    s = part((b * f - c * e) / det);
  } else {
    const double first = -c / a, last = (b - c) / a;  // the other's ends on this one
    const double low = part(std::min(first, last)), high = part(std::max(first, last));
    s = 0.5 * (low + high);
  }
  double t = (b * s + f) / e;
  if (t < 0) {
    t = 0;
    s = part(-c / a);
  } else if (t > 1) {
    t = 1;
    s = part((b - c) / a);
  }
  return {s, t};
}

/// Weights of the corners for the foot of p's perpendicular; false: the foot is outside the
/// triangle.
inline bool foot_in_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c,
                             std::array<double, 3>& weights) {
  const Vec3 u = b - a, v = c - a, w = p - a, n = glm::cross(u, v);
  const double nn = glm::dot(n, n);
  if (!(nn > 0)) return false;
  const double beta = glm::dot(glm::cross(w, v), n) / nn;
  const double gamma = glm::dot(glm::cross(u, w), n) / nn;
  weights = {1 - beta - gamma, beta, gamma};
  return weights[0] > 0 && beta > 0 && gamma > 0;
}

/// Whether the segment crosses the triangle; touching counts.
inline bool crosses(const Segment& s, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 n = glm::cross(b - a, c - a);
  const double before = glm::dot(s.from - a, n), after = before + glm::dot(s.along, n);
  if ((before > 0) == (after > 0)) return false;
  const Vec3 at = s.from + before / (before - after) * s.along;
  std::array<double, 3> weights{};
  return foot_in_triangle(at, a, b, c, weights);
}

inline double distance_to_triangle(const Segment& s, const Vec3& a, const Vec3& b, const Vec3& c) {
  if (crosses(s, a, b, c)) return 0;
  double least = INFINITY;
  const auto edge = [&](const Vec3& from, const Vec3& to) {
    const NearestOnSegments at = nearest_on_segments(s, {from, to - from});
    least =
        std::min(least, glm::distance(s.from + at.own * s.along, from + at.other * (to - from)));
  };
  edge(a, b);
  edge(b, c);
  edge(c, a);
  for (const double along : {0.0, 1.0}) {
    const Vec3 p = s.from + along * s.along;
    std::array<double, 3> w{};
    if (foot_in_triangle(p, a, b, c, w))
      least = std::min(least, glm::distance(p, w[0] * a + w[1] * b + w[2] * c));
  }
  return least;
}

/// Signed; positive if p sees the triangle from behind (its normal points away). Van Oosterom &
/// Strackee 1983, "The solid angle of a plane triangle".
inline double solid_angle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 u = a - p, v = b - p, w = c - p;
  const double x = glm::length(u), y = glm::length(v), z = glm::length(w);
  return 2 * std::atan2(glm::dot(u, glm::cross(v, w)),
                        x * y * z + glm::dot(u, v) * z + glm::dot(v, w) * x + glm::dot(w, u) * y);
}

/// One contact place of a segment of the tool with the surface.
struct SoftContact {
  std::uint32_t key = 0;  ///< edge, or triangle and segment end; identifies the contact
  int segment = 0;
  std::array<std::uint32_t, 3> nodes{};  ///< surface nodes that bear the force
  std::array<double, 3> weights{};
  std::uint32_t count = 0;  ///< of nodes
  Vec3 normal;              ///< unit, from the surface to the tool's axis
  Vec3 axis_point;          ///< m, on the axis of the virtual segment
  double along = 0;         ///< of the segment: 0 to 1
  double gap = 0;           ///< m, without any force
  double now = 0;           ///< m, the gap with the last forces
  double force = 0;         ///< N
};

struct SoftContactSettings {
  double radius = 0.002;   ///< m, of the tool
  double stiffness = 800;  ///< N/m, of the spring between virtual and ideal tool
  std::size_t most = 64;   ///< contacts at once; of more, the deepest are kept
  int sweeps = 60;         ///< of Gauss-Seidel, at most
};

/// State between ticks.
struct SoftContactMemory {
  SoftContactMemory() = default;
  SoftContactMemory(const SoftBody& body, const SoftContactSettings& settings);

  Vec3 shift{0, 0, 0};                ///< m, from the virtual to the ideal tool
  std::vector<SoftContact> contacts;  ///< of the last tick; some without force
  std::vector<NodeForce> forces;      ///< on the body, of the last tick
  double moved = 0;                   ///< m, motion of the surface by those forces, at most
  bool dropped = false;               ///< there were more contacts than are kept

  // Of the current tick:
  struct Node {
    std::uint32_t node;
    Vec3 base;  ///< m, without any force
    Vec3 now;   ///< m, with the last forces
  };
  std::vector<SoftContact> found;
  std::vector<Node> local;
  std::vector<std::uint32_t> slot;  ///< by surface node; valid if local[slot].node equals it
  std::vector<double> matrix;
};

/// One body's surface at one moment.
struct SoftMoment {
  const SoftBody& body;
  const SoftSurface& surface;
  const SoftView& view;
  double fraction = 0;  ///< of a step since the view
};

/// Moves the ideal tool.
/// \param tip   m, of the virtual tool
/// \param tool  its segments, relative to the tip
/// \param step  m, by which the virtual tool moved since the last call, at most
/// \return the force on the tool, N
Vec3 follow_surface(const SoftMoment& moment, const SoftContactSettings& settings, const Vec3& tip,
                    const PlacedTool& tool, double step, SoftContactMemory& memory) noexcept;

/// Whether the tool's axis is inside the surface, or closer to it than the tool's radius.
bool is_inside(const SoftMoment& moment, double radius, const Vec3& tip,
               const PlacedTool& tool) noexcept;

}  // namespace palpate::rendering
