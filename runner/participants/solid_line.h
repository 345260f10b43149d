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
/// leaves nothing to be found; then closer around the least. Within 0.5 mm of the minimum.
inline void find_along_line(const SolidLine& shape, float length, Deepest& out) {
  constexpr int kPlaces = 16;
  constexpr int kHalvings = 5;
  const float step = length / kPlaces;
  for (int i = 0; i < ShapeHypotheses::kBlock; ++i) {
    float best = 0, least = shape.distance(i, 0);
    for (float s = step; s < length + 0.5f * step;) {
      const float place = lane::min(s, length);
      const float d = shape.distance(i, place);
      if (d < least) {
        least = d;
        best = place;
      }
      s += lane::max(step, d - least);
    }
    float reach = 0.5f * step;
    for (int k = 0; k < kHalvings; ++k, reach *= 0.5f) {
      const float before = lane::max(best - reach, 0.0f);
      const float after = lane::min(best + reach, length);
      const float a = shape.distance(i, before), b = shape.distance(i, after);
      if (a < least && a <= b) {
        least = a;
        best = before;
      } else if (b < least) {
        least = b;
        best = after;
      }
    }
    SurfacePoint p = shape.surface(i, best);
    // Between the ends a contact's normal is perpendicular to the line.
    if (best > 0 && best < length) {
      const FloatVec u = shape.along(i);
      const float slope = dot(p.normal, u);
      p.normal = SolidLine::unit(
          {p.normal.x - slope * u.x, p.normal.y - slope * u.y, p.normal.z - slope * u.z});
    }
    out.distance[i] = p.distance;
    out.cosine[i] = shape.cosine(i, p.normal);
    out.along[i] = best;
    out.x[i] = p.normal.x;
    out.y[i] = p.normal.y;
    out.z[i] = p.normal.z;
  }
}

}  // namespace palpate::runner
