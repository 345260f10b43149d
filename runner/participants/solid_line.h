#pragma once
// Signed distances of one block of hypotheses along one line, for stimuli without a formula. The
// functions are those of shape_lines.h.

#include "runner/participants/deepest_point.h"
#include "runner/participants/distance_field.h"
#include "runner/participants/shape_lines.h"

namespace palpate::runner {

/// Works in the stimulus' frame.
class SolidLine {
 public:
  SolidLine(const ShapeHypotheses& hypotheses, const ShapeHypotheses::Shape& shape, int first,
            const Line& line)
      : hypotheses_(&hypotheses), first_(first), field_(shape.field.get()) {
    for (int a = 0; a < 3; ++a) {
      const float* x = hypotheses.axis_component(a, 0) + first;
      const float* y = hypotheses.axis_component(a, 1) + first;
      const float* z = hypotheses.axis_component(a, 2) + first;
      for (int i = 0; i < ShapeHypotheses::kBlock; ++i) {
        const FloatVec axis{x[i], y[i], z[i]};
        start_[a][i] = dot(axis, line.start);
        along_[a][i] = dot(axis, line.along);
        direction_[a][i] = dot(axis, line.direction);
      }
    }
  }

  float distance(int i, float s) const {
    return field_->distance(start_[0][i] + s * along_[0][i], start_[1][i] + s * along_[1][i],
                            start_[2][i] + s * along_[2][i]);
  }
  SurfacePoint surface(int i, float s) const {
    const DistanceField::Value v =
        field_->value(start_[0][i] + s * along_[0][i], start_[1][i] + s * along_[1][i],
                      start_[2][i] + s * along_[2][i]);
    return {v.distance, unit({v.slope_x, v.slope_y, v.slope_z})};
  }
  FloatVec along(int i) const { return {along_[0][i], along_[1][i], along_[2][i]}; }
  float cosine(int i, const FloatVec& v) const {
    return v.x * direction_[0][i] + v.y * direction_[1][i] + v.z * direction_[2][i];
  }
  FloatVec world(int i, const FloatVec& v) const {
    const auto component = [&](int c) {
      return v.x * hypotheses_->axis_component(0, c)[first_ + i] +
             v.y * hypotheses_->axis_component(1, c)[first_ + i] +
             v.z * hypotheses_->axis_component(2, c)[first_ + i];
    };
    return {component(0), component(1), component(2)};
  }

  static FloatVec unit(const FloatVec& v) {
    const float scale = 1.0f / std::sqrt(lane::max(dot(v, v), kTinyLength * kTinyLength));
    return {v.x * scale, v.y * scale, v.z * scale};
  }

 private:
  const ShapeHypotheses* hypotheses_;
  int first_;
  const DistanceField* field_;
  float start_[3][ShapeHypotheses::kBlock];
  float along_[3][ShapeHypotheses::kBlock];
  float direction_[3][ShapeHypotheses::kBlock];
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
