#pragma once
// Searches for triangles near a segment in the tree of a closed surface (surface.h). Included only
// by callers, because they are inlined.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "stimuli/surfaces/surface.h"

#if defined(__AVX__)
#include <immintrin.h>
#endif

namespace palpate::stimuli {

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
    const double length = std::sqrt(length2);
    const double size = radius + length + std::sqrt(std::max(glm::dot(a, a), glm::dot(c, c)));
    const double room = motion.room + kRounding * size;
    first_ = {a, along};
    last_ = {c, later};
    room_ = static_cast<float>(room);
    start_ = Box(a, c, room);
    is_point_ = !(length2 > 0);
    if (is_point_) return;
    end_ = Box(b, d, room);
    // A segment that only translates is at rest among boxes that are larger by its way.
    turns_ = motion.start_way != motion.end_way;
    if (!turns_) way_ = to_floats(motion.start_way);
    const Vec3 way = turns_ ? Vec3(0) : motion.start_way;
    const Vec3 below = room + glm::max(way, 0.0), above = room - glm::min(way, 0.0);
    below_ = to_floats(below);
    above_ = to_floats(above);
    length_ = static_cast<float>(length);
    turn_ = static_cast<float>(motion.turn + kRounding * length);
    // The axis along which the segment is longest: across it, a box has only a portion beside it.
    const Vec3 middle = glm::abs(along + later);
    const int k = middle.x >= middle.y && middle.x >= middle.z ? 0 : middle.y >= middle.z ? 1 : 2;
    axis_ = static_cast<std::size_t>(k);
    const double least = kLeastSlope * length;
    divides_ = (along[k] > least && later[k] > least) || (along[k] < -least && later[k] < -least);
    if (!divides_) return;
    up_ = along[k] > 0;
    const double enter = up_ ? -below[k] : above[k], leave = up_ ? above[k] : -below[k];
    passing_ = Passing(a[k], along[k], enter, leave);
    passing_last_ = Passing(c[k], later[k], enter, leave);
  }

  /// The children that the moving segment may meet: one bit each.
  unsigned met(const Surface::Node& node) const {
    return bits_of(is_point_ ? start_.meets(node) : portion_in(node).meets);
  }

  struct Touched {
    unsigned start = 0, end = 0, side = 0;  ///< one bit for each child
    unsigned any() const { return start | end | side; }
  };
  /// The children that the segment may touch with each end, and on a silhouette edge.
  Touched touched(const Surface::Node& node) const {
    Touched out;
    const Flags at_start = start_.meets(node);
    if (is_point_) {
      out.start = bits_of(at_start);
      return out;
    }
    const auto along = [&](const std::array<float, 3>& v) -> Lanes {
      return v[0] * node.middle[0] + v[1] * node.middle[1] + v[2] * node.middle[2];
    };
    Lanes height = along(first_.from);
    const Lanes slope = along(first_.along);
    if (!turns_) height += least(along(way_), Lanes{});
    const Lanes height_last = turns_ ? along(last_.from) : height;
    const Lanes slope_last = turns_ ? along(last_.along) : slope;
    const Lanes top = node.top + room_;  // above it nothing is touched
    out.start = bits_of(at_start & (least(height, height_last) <= top));
    out.end = bits_of(end_.meets(node) & (least(height + slope, height_last + slope_last) <= top));
    // Of a silhouette one normal is to either side of the segment.
    const Lanes flat = length_ * node.radius + turn_;
    const Flags across = (least(slope, slope_last) <= flat) & (most(slope, slope_last) >= -flat);
    const Portion beside = portion_in(node);
    Lanes lowest = least(height + beside.from * slope, height + beside.to * slope);
    if (turns_) {
      lowest = least(lowest, least(height_last + beside.from * slope_last,
                                   height_last + beside.to * slope_last));
    }
    out.side = bits_of(across & beside.meets & (lowest <= top));
    return out;
  }

 private:
  using Flags = std::int32_t __attribute__((vector_size(sizeof(Lanes))));
  static constexpr double kRounding = 1e-6;
  static constexpr double kLeastSlope = 0.1;  // of the length; a steeper axis divides the segment

  static std::array<float, 3> to_floats(const Vec3& v) {
    return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
  }
  struct Line {
    std::array<float, 3> from{}, along{};
    Line() = default;
    Line(const Vec3& at, const Vec3& way) : from(to_floats(at)), along(to_floats(way)) {}
  };
  struct Box {
    std::array<float, 3> low{}, high{};
    Box() = default;
    Box(const Vec3& a, const Vec3& b, double room) {
      for (int k = 0; k < 3; ++k) {
        low[static_cast<std::size_t>(k)] = static_cast<float>(std::min(a[k], b[k]) - room);
        high[static_cast<std::size_t>(k)] = static_cast<float>(std::max(a[k], b[k]) + room);
      }
    }
    Flags meets(const Surface::Node& node) const {
      return (node.low[0] <= high[0]) & (node.high[0] >= low[0]) & (node.low[1] <= high[1]) &
             (node.high[1] >= low[1]) & (node.low[2] <= high[2]) & (node.high[2] >= low[2]);
    }
  };
  /// Fractions of the segment at which it passes a box's faces across the axis: scale * face + at.
  struct Passing {
    float scale = 0, enter = 0, leave = 0;
    Passing() = default;
    Passing(double start, double along, double enter_room, double leave_room)
        : scale(static_cast<float>(1 / along)),
          enter(static_cast<float>((enter_room - start) / along)),
          leave(static_cast<float>((leave_room - start) / along)) {}
  };
  /// The fractions of the segment that are beside a box, and whether these meet it.
  struct Portion {
    Lanes from, to;
    Flags meets;
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

  Portion portion_in(const Surface::Node& node) const {
    Portion out{Lanes{}, Lanes{} + 1.0F, ~Flags{}};
    if (divides_) {
      const Lanes &near = up_ ? node.low[axis_] : node.high[axis_],
                  &far = up_ ? node.high[axis_] : node.low[axis_];
      Lanes enter = near * passing_.scale + passing_.enter,
            leave = far * passing_.scale + passing_.leave;
      if (turns_) {
        enter = least(enter, near * passing_last_.scale + passing_last_.enter);
        leave = most(leave, far * passing_last_.scale + passing_last_.leave);
      }
      out.from = most(enter, out.from);
      out.to = least(leave, out.to);
      out.meets = out.from <= out.to;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      if (k == axis_ && divides_) continue;
      const auto bounds = [&](const Line& line, Lanes& low, Lanes& high) {
        const Lanes a = line.from[k] + out.from * line.along[k],
                    b = line.from[k] + out.to * line.along[k];
        low = least(a, b);
        high = most(a, b);
      };
      Lanes low, high;
      bounds(first_, low, high);
      if (turns_) {
        Lanes low_last, high_last;
        bounds(last_, low_last, high_last);
        low = least(low, low_last);
        high = most(high, high_last);
      }
      out.meets &= (low <= node.high[k] + above_[k]) & (high >= node.low[k] - below_[k]);
    }
    return out;
  }

  Line first_, last_;
  std::array<float, 3> way_{};              ///< of a segment that does not turn
  std::array<float, 3> below_{}, above_{};  ///< m; boxes are larger by it
  Box start_, end_;
  Passing passing_, passing_last_;
  std::size_t axis_ = 0;
  float length_ = 0;
  float room_ = 0;
  float turn_ = 0;
  bool turns_ = false;  ///< its ends have different ways
  bool is_point_ = false;
  bool divides_ = false;  ///< the axis divides the segment
  bool up_ = false;       ///< the segment goes up along the axis
};

/// The nodes that a search has still to look at.
class OpenNodes {
 public:
  /// So many are looked at together: the processor waits for them at the same time.
  static constexpr std::size_t kTogether = 8;

  explicit OpenNodes(std::uint32_t root) { nodes_[count_++] = root; }
  bool empty() const { return count_ == 0; }
  std::size_t together() const { return std::min(count_, kTogether); }
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
  std::array<std::uint32_t, 12 * Surface::kWidth * kTogether> nodes_;
  std::size_t count_ = 0;
};

template <class Visit>
void Surface::near_segment(const Vec3& start, const Vec3& along, const Visit& visit) const {
  if (nodes_.empty()) return;
  SegmentMotion still;
  still.start = start;
  still.end = start + along;
  const SurfaceQuery query(still, centre_, radius_);
  OpenNodes open(root_);
  while (!open.empty()) {
    const std::uint32_t at = open.take();
    const Node& node = nodes_[index_of(at)];
    unsigned bits = query.met(node);
    if (!is_leaf(at)) {
      open.add(node, bits);
      continue;
    }
    for (; bits != 0; bits &= bits - 1) {
      if (!visit(node.children[static_cast<std::size_t>(std::countr_zero(bits))])) return;
    }
  }
}

template <class Visit>
void Surface::touchable(const SegmentMotion& motion, const Visit& visit) const {
  if (nodes_.empty()) return;
  const SurfaceQuery query(motion, centre_, radius_);
  OpenNodes open(root_);
  std::array<std::uint32_t, OpenNodes::kTogether> names;
  std::array<SurfaceQuery::Touched, OpenNodes::kTogether> found;
  while (!open.empty()) {
    const std::size_t count = open.together();
    for (std::size_t i = 0; i < count; ++i) {
      names[i] = open.take();
      found[i] = query.touched(nodes_[index_of(names[i])]);
    }
    for (std::size_t i = 0; i < count; ++i) {
      const Node& node = nodes_[index_of(names[i])];
      const SurfaceQuery::Touched& touched = found[i];
      if (!is_leaf(names[i])) {
        open.add(node, touched.any());
        continue;
      }
      for (unsigned bits = touched.any(); bits != 0; bits &= bits - 1) {
        const auto k = static_cast<unsigned>(std::countr_zero(bits));
        const unsigned what = ((touched.start >> k & 1) != 0 ? surface_pair::kTip : 0U) |
                              ((touched.end >> k & 1) != 0 ? surface_pair::kTail : 0U) |
                              ((touched.side >> k & 1) != 0 ? surface_pair::kSides : 0U);
        if (!visit(node.children[k], static_cast<std::uint8_t>(what))) return;
      }
    }
  }
}

}  // namespace palpate::stimuli
