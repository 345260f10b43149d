#pragma once
// Searches for triangles near a segment in the tree of a closed surface (surface.h). Included only
// by callers, because they are inlined.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>

#include "rendering/surface.h"

#if defined(__AVX__)
#include <immintrin.h>
#endif

namespace palpate::rendering {

/// Tests all boxes of a node at once, in single precision with slack for its rounding: a box that
/// is near is never missed.
class SurfaceQuery {
 public:
  using Lanes = Surface::Lanes;

  /// \param centre, radius  of the surface
  SurfaceQuery(const SegmentMotion& motion, const Vec3& centre, double radius) {
    const Vec3 a = motion.start - centre, b = motion.end - centre;  // at first
    const Vec3 c = a + motion.start_way, d = b + motion.end_way;    // at last
    const Vec3 along = b - a, later = d - c;
    const double length2 = std::max(glm::dot(along, along), glm::dot(later, later));
    length_ = std::sqrt(length2);
    const double size = radius + length_ + std::sqrt(std::max(glm::dot(a, a), glm::dot(c, c)));
    const double slack = kRounding * size;
    const double start_room = motion.start_room + slack, end_room = motion.end_room + slack;
    for (int k = 0; k < 3; ++k) {
      start_.set(k, std::min(a[k], c[k]) - start_room, std::max(a[k], c[k]) + start_room);
      end_.set(k, std::min(b[k], d[k]) - end_room, std::max(b[k], d[k]) + end_room);
      all_.low[k] = std::min(start_.low[k], end_.low[k]);
      all_.high[k] = std::max(start_.high[k], end_.high[k]);
      along_[k] = static_cast<float>(along[k]);
      along_last_[k] = static_cast<float>(later[k]);
    }
    moves_ = motion.start_way != Vec3(0) || motion.end_way != Vec3(0);
    is_point_ = !(length2 > 0);
    if (is_point_) return;
    turn_ = static_cast<float>(motion.turn + kRounding * length_);
    // Separating axes of a box and a segment (Ericson 2005, 5.3.3).
    const Vec3 middle = along + later;
    const auto add = [&](const Vec3& axis) {
      const double axis2 = glm::dot(axis, axis);
      if (!(axis2 > kRounding * kRounding * kRounding * kRounding * length2 * length2)) return;
      const Vec3 unit = axis / std::sqrt(axis2);
      const double from = glm::dot(unit, a), to = glm::dot(unit, c), tail_from = glm::dot(unit, b),
                   tail_to = glm::dot(unit, d);
      Axis& out = axes_[axis_count_++];
      for (int k = 0; k < 3; ++k) out.unit[k] = static_cast<float>(unit[k]);
      out.low = static_cast<float>(
          std::min(std::min(from, to) - start_room, std::min(tail_from, tail_to) - end_room));
      out.high = static_cast<float>(
          std::max(std::max(from, to) + start_room, std::max(tail_from, tail_to) + end_room));
    };
    if (moves_) {
      const bool start_moves =
          glm::dot(motion.start_way, motion.start_way) > glm::dot(motion.end_way, motion.end_way);
      add(glm::cross(middle, start_moves ? motion.start_way : motion.end_way));
    }
    add({0, middle.z, -middle.y});
    add({-middle.z, 0, middle.x});
    add({middle.y, -middle.x, 0});
  }

  /// The children that the moving segment may meet: one bit each.
  unsigned met(const Surface::Node& node) const {
    return bits_of(all_.meets(node) & between_planes(node));
  }

  struct Touched {
    unsigned start = 0, end = 0, side = 0;  ///< one bit for each child
    unsigned any() const { return start | end | side; }
  };
  /// The children that the segment may touch with each end, and on a silhouette edge.
  Touched touched(const Surface::Node& node, const Surface::Normals& normals) const {
    Touched out;
    const Flags met = all_.meets(node);
    if (bits_of(met) == 0) return out;
    if (is_point_) {
      out.start = bits_of(met);
      return out;
    }
    const auto along = [&](const std::array<float, 3>& v) -> Lanes {
      return v[0] * normals.middle[0] + v[1] * normals.middle[1] + v[2] * normals.middle[2];
    };
    const Lanes turned = along(along_), turned_last = moves_ ? along(along_last_) : turned;
    out.start = bits_of(start_.meets(node));
    out.end = bits_of(end_.meets(node));
    // Of a silhouette one normal is to either side of the segment.
    const Lanes flat = static_cast<float>(length_) * normals.radius + turn_;
    const Flags across =
        met & (least(turned, turned_last) <= flat) & (most(turned, turned_last) >= -flat);
    if (bits_of(across) == 0) return out;
    out.side = bits_of(across & between_planes(node));
    return out;
  }

 private:
  using Flags = std::int32_t __attribute__((vector_size(sizeof(Lanes))));
  static constexpr double kRounding = 1e-6;

  struct Box {
    std::array<float, 3> low{}, high{};
    void set(int k, double from, double to) {
      low[static_cast<std::size_t>(k)] = static_cast<float>(from);
      high[static_cast<std::size_t>(k)] = static_cast<float>(to);
    }
    Flags meets(const Surface::Node& node) const {
      return (node.low[0] <= high[0]) & (node.high[0] >= low[0]) & (node.low[1] <= high[1]) &
             (node.high[1] >= low[1]) & (node.low[2] <= high[2]) & (node.high[2] >= low[2]);
    }
  };
  struct Axis {
    std::array<float, 3> unit{};
    float low = 0, high = 0;
  };

  static unsigned bits_of(const Flags& flags) {
#if defined(__AVX__)
    return static_cast<unsigned>(_mm256_movemask_ps(reinterpret_cast<__m256>(flags)));
#else
    unsigned out = 0;
    for (std::size_t k = 0; k < Surface::kWidth; ++k)
      out |= static_cast<unsigned>(flags[k] & 1) << k;
    return out;
#endif
  }

  static Lanes least(const Lanes& a, const Lanes& b) { return a < b ? a : b; }
  static Lanes most(const Lanes& a, const Lanes& b) { return a > b ? a : b; }

  Flags between_planes(const Surface::Node& node) const {
    Flags out = ~Flags{};
    for (std::size_t i = 0; i < axis_count_; ++i) {
      const Axis& axis = axes_[i];
      Lanes low{}, high{};
      for (std::size_t k = 0; k < 3; ++k) {
        const bool down = axis.unit[k] < 0;
        low += axis.unit[k] * (down ? node.high[k] : node.low[k]);
        high += axis.unit[k] * (down ? node.low[k] : node.high[k]);
      }
      out &= (low <= axis.high) & (high >= axis.low);
    }
    return out;
  }

  Box start_, end_, all_;
  std::array<float, 3> along_{}, along_last_{};
  double length_ = 0;
  float turn_ = 0;
  bool moves_ = false;
  bool is_point_ = false;
  std::array<Axis, 4> axes_;
  std::size_t axis_count_ = 0;
};

/// The nodes that a search has still to look at.
class OpenNodes {
 public:
  bool empty() const { return count_ == 0; }
  std::uint32_t take() { return nodes_[--count_]; }
  /// Adds the children of these bits; the first is taken first.
  void add(const Surface::Node& node, unsigned bits) {
    while (bits != 0) {
      const auto k = static_cast<unsigned>(std::bit_width(bits)) - 1;
      bits ^= 1U << k;
      nodes_[count_++] = node.children[k];
    }
  }

 private:
  // At most 11 levels of eight children hold 2^32 triangles.
  std::array<std::uint32_t, 12 * Surface::kWidth> nodes_;
  std::size_t count_ = 0;
};

template <class Visit>
void Surface::near_segment(const Vec3& start, const Vec3& along, const Visit& visit) const {
  if (nodes_.empty()) return;
  SegmentMotion still;
  still.start = start;
  still.end = start + along;
  const SurfaceQuery query(still, centre_, radius_);
  OpenNodes open;
  std::uint32_t at = 0;
  for (;;) {
    const Node& node = nodes_[at];
    unsigned bits = query.met(node);
    if (node.leaf) {
      for (; bits != 0; bits &= bits - 1) {
        if (!visit(node.children[static_cast<std::size_t>(std::countr_zero(bits))])) return;
      }
    } else {
      open.add(node, bits);
    }
    if (open.empty()) return;
    at = open.take();
  }
}

template <class Visit>
void Surface::touchable(const SegmentMotion& motion, const Visit& visit) const {
  if (nodes_.empty()) return;
  const SurfaceQuery query(motion, centre_, radius_);
  OpenNodes open;
  std::uint32_t at = 0;
  for (;;) {
    const Node& node = nodes_[at];
    const SurfaceQuery::Touched touched = query.touched(node, normals_[at]);
    if (node.leaf) {
      for (unsigned bits = touched.any(); bits != 0; bits &= bits - 1) {
        const auto k = static_cast<unsigned>(std::countr_zero(bits));
        const unsigned what = ((touched.start >> k & 1) != 0 ? surface_pair::kTip : 0U) |
                              ((touched.end >> k & 1) != 0 ? surface_pair::kTail : 0U) |
                              ((touched.side >> k & 1) != 0 ? surface_pair::kSides : 0U);
        if (!visit(node.children[k], static_cast<std::uint8_t>(what))) return;
      }
    } else {
      open.add(node, touched.any());
    }
    if (open.empty()) return;
    at = open.take();
  }
}

}  // namespace palpate::rendering
