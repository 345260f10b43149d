#pragma once
// Depth below the surface of a layer. One frame, m.

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <optional>

#include "stimuli/layers/solid_depth.h"

namespace palpate::stimuli {

/// The layer is where a function is positive that grows by at most 1 m a metre.
class LayerField {
 public:
  /// \param within  ends the layer; null: nothing but the solid does
  /// \param beyond  m; so far beyond the border of `within`
  LayerField(const SolidDepth& solid, double depth, const SolidDepth* within, double beyond)
      : solid_(solid), depth_(depth), within_(within), beyond_(beyond) {}

  struct Sample {
    Vec3 place;
    double height = 0;          ///< m, below the surface of the layer; negative above it
    Vec3 inwards;               ///< unit, the way in which it grows
    Vec3 solid_inwards;         ///< unit, the way in which depth in the solid grows
    double solid = 0, own = 0;  ///< m, depth in the solid and in `within`, as it stands
  };
  Sample at(const Vec3& place, const Sample* near = nullptr) const {
    Sample out{place, 0, {}, {}, 0, 0};
    const auto known = [&](double depth) { return SolidDepth::Known{near->place, depth}; };
    const auto depth_in = [&](const SolidDepth& solid, double of_near) {
      if (near == nullptr) return solid.at(place);
      const SolidDepth::Known from = known(of_near);
      return solid.at(place, &from);
    };
    const SolidDepth::Depth whole = depth_in(solid_, near == nullptr ? 0 : near->solid);
    out.solid = whole.depth;
    out.height = whole.depth - depth_;
    out.inwards = out.solid_inwards = whole.inwards;
    if (within_ == nullptr) return out;
    const SolidDepth::Depth own = depth_in(*within_, near == nullptr ? 0 : near->own);
    out.own = own.depth;
    if (own.depth + beyond_ >= out.height) return out;
    out.height = own.depth + beyond_;
    out.inwards = own.inwards;
    return out;
  }

  /// Whether the surface of the layer in the ball is certainly one plane, or not there.
  bool is_plane(const Sample& centre, double radius) const {
    if (within_ == nullptr) return solid_.plane_in(centre.place, radius);
    const double lead = centre.own + beyond_ - (centre.solid - depth_);
    if (lead > 2 * radius) return solid_.plane_in(centre.place, radius);
    return lead < -2 * radius && within_->plane_in(centre.place, radius);
  }

  /// m; the surface of the layer may pass through a cube whose corners it does not separate, but
  /// not deeper than this, below or above the surface. \param width  m, of the cube
  double hidden(const Sample& centre, const std::array<Vec3, 8>& corners, double width) const {
    const double radius = 0.5 * std::sqrt(3.0) * width;
    const double plain = radius - std::abs(centre.height);  // for any function that grows so slowly
    if (centre.height <= 0) {
      // No point is deeper than it is far from a point of the solid's surface.
      const Vec3 nearest = centre.place - centre.solid * centre.solid_inwards;
      double farthest = 0;
      for (const Vec3& corner : corners)
        farthest = std::max(farthest, glm::distance(corner, nearest));
      return std::min(plain, farthest - depth_);
    }
    // The solid above the layer is a union of balls of radius `depth`: one without a corner goes
    // through a face of the cube as far as its cap.
    if (within_ != nullptr && centre.own + beyond_ < radius) return plain;
    const double half2 = 0.5 * width * width;
    return half2 < depth_ * depth_ ? std::min(plain, depth_ - std::sqrt(depth_ * depth_ - half2))
                                   : plain;
  }

  double slack() const {
    return within_ == nullptr ? solid_.slack() : std::max(solid_.slack(), within_->slack());
  }

 private:
  const SolidDepth& solid_;
  double depth_;
  const SolidDepth* within_;
  double beyond_;  // m
};

}  // namespace palpate::stimuli
