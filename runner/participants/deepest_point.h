#pragma once
// The deepest point of the perceived tip or stylus in each hypothesis of a block.

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include "runner/participants/lane_math.h"
#include "runner/participants/shape_hypotheses.h"
#include "runner/participants/shape_lines.h"
#include "runner/participants/solid_lines.h"
#include "stimuli/shapes.h"

namespace palpate::runner::participants {

// The search along a line ends when the minimum is bracketed within this length. The distance
// itself is within 30 micrometres: it is interpolated from the slopes at both ends.
inline constexpr float kSearchedLength = 0.00012f;  // m
inline constexpr int kMostHalvings = 20;

/// The deepest point of the line, of every hypothesis of a block.
struct Deepest {
  float distance[ShapeHypotheses::kBlock];  // m
  float cosine[ShapeHypotheses::kBlock];    // outward normal . perceived direction
  float along[ShapeHypotheses::kBlock];     // m from the line's start
  float x[ShapeHypotheses::kBlock];         // unit outward normal, in the shape's own frame
  float y[ShapeHypotheses::kBlock];
  float z[ShapeHypotheses::kBlock];
};

/// \param count  as many hypotheses as are needed, if not all; the others may be left out
template <class ShapeLine>
void find_at_tip(const ShapeLine& shape, Deepest& out, int /*count*/ = ShapeHypotheses::kBlock) {
  for (int i = 0; i < ShapeHypotheses::kBlock; ++i) {
    const SurfacePoint p = shape.surface(i, 0.0f);
    out.distance[i] = p.distance;
    out.cosine[i] = shape.cosine(i, p.normal);
    out.along[i] = 0.0f;
    out.x[i] = p.normal.x;
    out.y[i] = p.normal.y;
    out.z[i] = p.normal.z;
  }
}

/// Surface and slope at one point of the line, for every hypothesis of a block.
struct SlopedSurface {
  float distance[ShapeHypotheses::kBlock];  // m
  float slope[ShapeHypotheses::kBlock];     // of the distance along the line
  float x[ShapeHypotheses::kBlock];         // unit outward normal, in the shape's own frame
  float y[ShapeHypotheses::kBlock];
  float z[ShapeHypotheses::kBlock];
};

template <class ShapeLine>
inline void store(const ShapeLine& shape, int i, float s, SlopedSurface& out) {
  const SurfacePoint p = shape.surface(i, s);
  out.distance[i] = p.distance;
  out.slope[i] = dot(p.normal, shape.along(i));
  out.x[i] = p.normal.x;
  out.y[i] = p.normal.y;
  out.z[i] = p.normal.z;
}

/// Bisection: the distance to a convex shape is convex along a line, so the sign of its slope tells
/// on which side the minimum lies.
template <class ShapeLine>
void find_along_line(const ShapeLine& shape, float length, Deepest& out,
                     int /*count*/ = ShapeHypotheses::kBlock) {
  // Half length and middle of the bracket.
  float reach = 0.5f * length;
  float middle[ShapeHypotheses::kBlock];
  for (float& m : middle) m = reach;
  for (int step = 0; step < kMostHalvings && 2.0f * reach > kSearchedLength; ++step) {
    reach *= 0.5f;
    for (int i = 0; i < ShapeHypotheses::kBlock; ++i) {
      middle[i] -= std::copysign(reach, shape.slope(i, middle[i]));
    }
  }
  // Separate loops: in a single one g++ 12 turns the selections into branches and does not
  // vectorise.
  SlopedSurface a;
  SlopedSurface b;
  for (int i = 0; i < ShapeHypotheses::kBlock; ++i) store(shape, i, middle[i] - reach, a);
  for (int i = 0; i < ShapeHypotheses::kBlock; ++i) store(shape, i, middle[i] + reach, b);
  const float width = 2.0f * reach;
  for (int i = 0; i < ShapeHypotheses::kBlock; ++i) {
    // The tangents at a and b intersect at the minimum if it is a kink, and just below a smooth
    // minimum. The combination of the two normals with slope zero is perpendicular to the line. If
    // both slopes have the same sign, the other is set to zero and an end of the line is the
    // minimum.
    const float falling = lane::min(a.slope[i], 0.0f);
    const float rising = lane::max(b.slope[i], 0.0f);
    const float bend = lane::max(rising - falling, 1e-6f);
    const float meet =
        lane::clamp((a.distance[i] - b.distance[i] + rising * width) / bend, 0.0f, width);
    const float weight_b = -falling / bend;
    const float weight_a = 1.0f - weight_b;
    const FloatVec n{weight_a * a.x[i] + weight_b * b.x[i], weight_a * a.y[i] + weight_b * b.y[i],
                     weight_a * a.z[i] + weight_b * b.z[i]};
    const float size = std::sqrt(lane::max(dot(n, n), 1e-12f));
    out.distance[i] = a.distance[i] + falling * meet;
    out.cosine[i] = shape.cosine(i, n) / size;
    out.along[i] = middle[i] - reach + meet;
    out.x[i] = n.x / size;
    out.y[i] = n.y / size;
    out.z[i] = n.z / size;
  }
}

/// At the place along[i] of the first `count` lines.
inline void find_surface(const SolidLine& shape, float length, Deepest& out, int count) {
  for (int i = 0; i < count; i += lane::kWidth) {
    const LanesOfSurface there =
        surface_at(LanesOfLines(shape.field(), shape.rows(), i), lane::load(out.along + i), length);
    const auto& [x, y, z] = shape.rows().direction;
    const LanesOfVectors direction{lane::load(x + i), lane::load(y + i), lane::load(z + i)};
    lane::store(there.distance, out.distance + i);
    lane::store(dot(there.normal, direction), out.cosine + i);
    lane::store(there.normal.x, out.x + i);
    lane::store(there.normal.y, out.y + i);
    lane::store(there.normal.z, out.z + i);
  }
}

inline void find_along_line(const SolidLine& shape, float length, Deepest& out,
                            int count = ShapeHypotheses::kBlock) {
  float least[ShapeHypotheses::kBlock];
  search_lines(shape.field(), shape.rows(), count, length, out.along, least);
  find_surface(shape, length, out, count);
}

inline void find_at_tip(const SolidLine& shape, Deepest& out, int count = ShapeHypotheses::kBlock) {
  std::fill_n(out.along, ShapeHypotheses::kBlock, 0.0F);
  find_surface(shape, 0, out, count);
}

/// Calls visit(std::type_identity<ShapeLine>()) with the class of the stimulus.
template <class Visit>
void visit_line_class(const ShapeHypotheses::Shape& shape, Visit&& visit) {
  if (shape.field) {
    std::forward<Visit>(visit)(std::type_identity<SolidLine>());
    return;
  }
  switch (shape.kind) {
    case stimuli::ShapeKind::cone:
      std::forward<Visit>(visit)(std::type_identity<AxialLine<ConeProfile>>());
      break;
    case stimuli::ShapeKind::cylinder:
      std::forward<Visit>(visit)(std::type_identity<AxialLine<CylinderProfile>>());
      break;
    case stimuli::ShapeKind::cube:
      std::forward<Visit>(visit)(std::type_identity<CubeLine>());
      break;
    case stimuli::ShapeKind::sphere:
      std::forward<Visit>(visit)(std::type_identity<SphereLine>());
      break;
    case stimuli::ShapeKind::box:
    case stimuli::ShapeKind::mesh:
    case stimuli::ShapeKind::none:
    case stimuli::ShapeKind::compound:
      break;  // these have a field
  }
}

}  // namespace palpate::runner::participants
