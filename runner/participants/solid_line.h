#pragma once
// Signed distances of one block of hypotheses along one line, for stimuli without a formula. The
// functions are those of shape_lines.h.

#include "runner/participants/deepest_point.h"
#include "runner/participants/distance_field.h"
#include "runner/participants/shape_lines.h"

namespace palpate::runner {

/// Works in the stimulus' frame.
class SolidLine : public RotatedLine {
 public:
  SolidLine(const ShapeHypotheses& hypotheses, const ShapeHypotheses::Shape& shape, int first,
            const Line& line)
      : RotatedLine(hypotheses, first, line), field_(shape.field.get()) {}

  float distance(int i, float s) const {
    const FloatVec p = at(i, s);
    return field_->distance(p.x, p.y, p.z);
  }
  SurfacePoint surface(int i, float s) const {
    const FloatVec p = at(i, s);
    const DistanceField::Value v = field_->value(p.x, p.y, p.z);
    return {v.distance, unit({v.slope_x, v.slope_y, v.slope_z})};
  }

  static FloatVec unit(const FloatVec& v) {
    const float scale = 1.0f / std::sqrt(lane::max(dot(v, v), kTinyLength * kTinyLength));
    return {v.x * scale, v.y * scale, v.z * scale};
  }

 private:
  const DistanceField* field_;
};

/// A solid that is not convex may have several local minima along the line. Steps of at most
/// `kPlaces` to its length, longer where the distance, which changes by a metre a metre at most,
/// leaves nothing to be found; then closer around the least. Within 0.5 mm of the minimum. All
/// hypotheses take a step at a time: one would wait for the grid's memory at each.
inline void find_along_line(const SolidLine& shape, float length, Deepest& out) {
  constexpr int kBlock = ShapeHypotheses::kBlock;
  constexpr int kPlaces = 16;
  constexpr int kHalvings = 5;
  const float step = length / kPlaces;
  const float end = length + 0.5f * step;
  float best[kBlock], least[kBlock], next[kBlock];
  for (int i = 0; i < kBlock; ++i) {
    best[i] = 0;
    next[i] = step;
    least[i] = shape.distance(i, 0);
  }
  for (bool more = true; more;) {
    int going_on = 0;
    for (int i = 0; i < kBlock; ++i) {
      const bool within = next[i] < end;
      const float place = lane::min(next[i], length);
      const float d = shape.distance(i, place);
      const bool closer = within && d < least[i];
      least[i] = closer ? d : least[i];
      best[i] = closer ? place : best[i];
      next[i] += lane::max(step, d - least[i]);
      going_on += next[i] < end ? 1 : 0;
    }
    more = going_on > 0;
  }
  float reach = 0.5f * step;
  for (int k = 0; k < kHalvings; ++k, reach *= 0.5f) {
    for (int i = 0; i < kBlock; ++i) {
      const float before = lane::max(best[i] - reach, 0.0f);
      const float after = lane::min(best[i] + reach, length);
      const float a = shape.distance(i, before), b = shape.distance(i, after);
      const bool back = a < least[i] && a <= b;
      const bool on = !back && b < least[i];
      least[i] = back ? a : on ? b : least[i];
      best[i] = back ? before : on ? after : best[i];
    }
  }
  for (int i = 0; i < kBlock; ++i) {
    const SurfacePoint p = shape.surface(i, best[i]);
    // Between the ends a contact's normal is perpendicular to the line.
    const bool between = best[i] > 0 && best[i] < length;
    const FloatVec u = shape.along(i);
    const float slope = dot(p.normal, u);
    const FloatVec across = SolidLine::unit(
        {p.normal.x - slope * u.x, p.normal.y - slope * u.y, p.normal.z - slope * u.z});
    const FloatVec n{between ? across.x : p.normal.x, between ? across.y : p.normal.y,
                     between ? across.z : p.normal.z};
    out.distance[i] = p.distance;
    out.cosine[i] = shape.cosine(i, n);
    out.along[i] = best[i];
    out.x[i] = n.x;
    out.y[i] = n.y;
    out.z[i] = n.z;
  }
}

}  // namespace palpate::runner
