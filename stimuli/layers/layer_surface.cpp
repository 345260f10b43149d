// Dual contouring (Ju, Losasso, Schaefer & Warren 2002) of the depth, on an octree whose cells are
// divided where the surface may be missed or its measured error is too large. Departs: planes are
// collected from the shortest edges round each leaf, so a leaf beside smaller ones has a corner of
// the surface wherever they do.

#include "stimuli/layers/layer_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <queue>
#include <unordered_map>
#include <utility>
#include <vector>

#include "stimuli/layers/layer_field.h"
#include "stimuli/layers/plane_corner.h"
#include "stimuli/polygon_soup.h"

namespace palpate::stimuli {
namespace {

using Index = std::uint32_t;
using Sample = LayerField::Sample;

constexpr double kSmallest = 2;  // times that error: width of a cell; smaller ones gain nothing
constexpr double kCoarsest = 1. / 96;  // of the size: cells need be no smaller to begin with
constexpr std::size_t kMostSamples = 500'000;  // depths; some 2 s
constexpr int kMostLevels = 18;                // so that a place of the grid fits into 64 bits

constexpr double kSurelyLeft = 0.9;  // of the greatest depth: there cells find what is left
constexpr double kOffBorder = 0.1;   // of a face: surfaces in it keep apart from its neighbours

/// The edges of a cell: corners differ in one bit, bit k for axis k.
constexpr std::array<std::array<Index, 2>, 12> kCellEdges = {{{0, 1},
                                                              {2, 3},
                                                              {4, 5},
                                                              {6, 7},
                                                              {0, 2},
                                                              {1, 3},
                                                              {4, 6},
                                                              {5, 7},
                                                              {0, 4},
                                                              {1, 5},
                                                              {2, 6},
                                                              {3, 7}}};

/// Whether corners of a cell that are alike hang together along its edges, inside and outside.
bool is_simple(unsigned inside) {
  for (const unsigned side : {inside, ~inside & 255U}) {
    unsigned reached = side & (~side + 1);
    for (unsigned before = 0; before != reached;) {
      before = reached;
      for (const auto& [a, b] : kCellEdges) {
        if ((reached >> a & 1) != 0 || (reached >> b & 1) != 0)
          reached |= side & (1U << a | 1U << b);
      }
    }
    if (reached != side) return false;
  }
  return true;
}

class Contour {
 public:
  /// \param attempt  another one has another grid
  Contour(const LayerField& field, double depth, const Vec3& low, const Vec3& high, int attempt)
      : field_(field), slack_(2 * field.slack()), error_(kLayerError * depth) {
    const Vec3 extent = high - low;
    // Not aligned with faces, which would lie between two layers of cells.
    size_ = 1.07 * std::max({extent.x, extent.y, extent.z});
    const Vec3 aside = (1 - 0.7 * attempt) * Vec3(0.011, -0.0137, 0.0071);
    origin_ = 0.5 * (low + high) - size_ * (0.5 + aside);
    base_ = std::max(depth, kCoarsest * size_);
    levels_ = 1;
    while (levels_ < kMostLevels && std::ldexp(size_, -levels_) > kSmallest * error_) ++levels_;
    cells_.push_back({});
    cells_[0].width = Index{2} << levels_;
    cells_[0].centre = sample({cells_[0].width / 2, cells_[0].width / 2, cells_[0].width / 2});
  }

  LayerSurface made() {
    std::vector<Index> queue = {0};
    while (!queue.empty()) {
      divide(std::move(queue));
      queue = trace();
    }
    if (soup_.faces.empty()) return {};
    ClosedSurface surface;
    try {
      surface = closed();
    } catch (const MeshError&) {
      // Rounding may bring polygons together that touch. With a corner in each face, few touch.
      careful_ = true;
      trace();
      surface = closed();
    }
    return {std::move(surface), std::max(worst_, found_error())};
  }

 private:
  using Place = std::array<Index, 3>;  ///< on the grid of the smallest cells' halves

  struct Cell {
    Place at{};
    Index width = 0;   ///< of the grid
    Index child = 0;   ///< the first of eight; 0: a leaf
    Index centre = 0;  ///< sample
    Index corner = 0;  ///< of the surface, plus 1; 0: none
    bool near = true;  ///< the surface may pass through it: its corners are sampled
  };

  /// The corner of the surface in a leaf.
  struct LeafCorner {
    PlaneCorner planes;  ///< that it was made of
    Vec3 place;          ///< m
    double error = 0;    ///< m
  };

  /// How a polygon is divided: along its first diagonal, the other one, or from its crossing.
  enum class Way : std::uint8_t { straight, turned, fan };

  /// Where an edge of cells crosses the surface.
  struct Crossing {
    Vec3 place, normal;
    int axis = 0;               ///< of the edge
    double low = 0, high = 0;   ///< m, its ends
    std::vector<Vec3> checked;  ///< corners of the polygon round it, when it was judged
    double error = HUGE_VAL;    ///< m, of that
    Way way = Way::fan;
  };

  /// Where the surface goes through a face.
  struct FacePoint {
    Vec3 from, to;  ///< m, corners of the leaves that it was found for
    Vec3 place;     ///< m
  };

  ClosedSurface closed() {
    soup_.vertices = corners_;
    soup_.coordinate_error = 1e-12 * size_;
    return closed_surface(soup_).surface;
  }

  Vec3 at(const Place& p) const {
    return origin_ + size_ / cells_[0].width * Vec3(p[0], p[1], p[2]);
  }
  static std::uint64_t key(const Place& p) {
    return p[0] | std::uint64_t{p[1]} << 21U | std::uint64_t{p[2]} << 42U;
  }
  static std::uint64_t mixed(std::uint64_t key) {
    key *= 0x9e3779b97f4a7c15U;
    return key ^ key >> 32U;
  }
  struct Mixed {
    std::size_t operator()(std::uint64_t key) const { return mixed(key); }
  };

  Index sample(const Place& p, const Sample* near = nullptr) {
    const auto [known, is_new] = known_.try_emplace(key(p), static_cast<Index>(samples_.size()));
    if (is_new) samples_.push_back(evaluate(at(p), near));
    return known->second;
  }
  Sample evaluate(const Vec3& place, const Sample* near) {
    ++evaluations_;
    return field_.at(place, near);
  }
  bool is_inside(const Sample& s) const { return s.height > slack_; }
  double radius(const Cell& cell) const {
    return 0.5 * std::sqrt(3.0) * cell.width * (size_ / cells_[0].width);
  }
  static Place corner_of(const Cell& cell, Index k) {
    return {cell.at[0] + (k & 1) * cell.width, cell.at[1] + (k >> 1 & 1) * cell.width,
            cell.at[2] + (k >> 2) * cell.width};
  }

  /// Divides the cells, and of the new ones those in which the surface may be missed.
  void divide(std::vector<Index> queue) {
    while (!queue.empty()) {
      std::vector<Index> next;
      for (const Index c : queue) {
        if (evaluations_ > kMostSamples || cells_[c].width <= 2 || cells_[c].child != 0) continue;
        const auto first = static_cast<Index>(cells_.size());
        cells_[c].child = first;
        const Index half = cells_[c].width / 2;
        for (Index k = 0; k < 8; ++k) {
          Cell cell;
          for (Index axis = 0; axis < 3; ++axis)
            cell.at[axis] = cells_[c].at[axis] + (k >> axis & 1) * half;
          cell.width = half;
          const Sample above = samples_[cells_[c].centre];
          cell.centre =
              sample({cell.at[0] + half / 2, cell.at[1] + half / 2, cell.at[2] + half / 2}, &above);
          cells_.push_back(cell);
          if (may_miss(first + k)) next.push_back(first + k);
        }
      }
      queue = std::move(next);
    }
  }

  /// Whether the surface may pass a leaf otherwise than the crossings of its edges show.
  bool may_miss(Index c) {
    Cell& cell = cells_[c];
    const Sample centre = samples_[cell.centre];
    const double radius = this->radius(cell);
    cell.near = std::abs(centre.height) <= radius + slack_;
    if (!cell.near) return false;
    unsigned inside = 0;
    std::array<Index, 8> corner{};
    for (Index k = 0; k < 8; ++k) {
      corner[k] = sample(corner_of(cell, k), &centre);
      inside |= is_inside(samples_[corner[k]]) ? 1U << k : 0;
    }
    const bool crossed = inside != 0 && inside != 255;
    const double width = cell.width * (size_ / cells_[0].width);
    if (!crossed && width <= base_) {
      std::array<Vec3, 8> places{};
      for (Index k = 0; k < 8; ++k) places[k] = samples_[corner[k]].place;
      if (field_.hidden(centre, places, width) <= error_) return false;
    }
    if (field_.is_plane(centre, radius)) return false;
    if (!crossed || width > base_ || !is_simple(inside)) return true;
    // The planes at the crossings must explain how deep the centre is.
    double least = HUGE_VAL, most = -HUGE_VAL;
    for (const auto& [a, b] : kCellEdges) {
      if ((inside >> a & 1) == (inside >> b & 1)) continue;
      const Crossing& x = crossing(corner_of(cell, a), corner_of(cell, b));
      const double height = glm::dot(x.normal, x.place - centre.place);
      least = std::min(least, height);
      most = std::max(most, height);
    }
    return centre.height < least - error_ || centre.height > most + error_;
  }

  /// \param a, b  ends of an edge, sampled, one of them inside; a before b
  Crossing& crossing(const Place& a, const Place& b) {
    const int axis = a[0] != b[0] ? 0 : a[1] != b[1] ? 1 : 2;
    // The middle of an edge is that of no other one, on any level.
    const std::uint64_t name = key({(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2});
    const auto [known, is_new] = crossings_.try_emplace(name);
    if (!is_new) return known->second;
    Sample in = samples_[known_.at(key(a))], out = samples_[known_.at(key(b))];
    if (!is_inside(in)) std::swap(in, out);
    // Newton's method in a bracket: depth is linear over most edges.
    const double exact = 1e-12 * size_, near = 1e-3 * error_;
    Sample best = std::abs(in.height) < std::abs(out.height) ? in : out;
    for (int i = 0; i < 30 && out.height < 0 && std::abs(best.height) > exact; ++i) {
      const Vec3 way = out.place - in.place;
      const double slope = glm::dot(best.inwards, way);
      double at = in.height / (in.height - out.height);
      if (i > 0 && slope < 0) {
        const double newton =
            (glm::dot(best.place - in.place, way) - best.height * glm::dot(way, way) / slope) /
            glm::dot(way, way);
        if (newton > 0 && newton < 1) at = newton;
      }
      if (i % 4 == 3) at = 0.5;
      best = evaluate(in.place + at * way, &best);
      (best.height > 0 ? in : out) = best;
      if (i >= 4 && std::abs(best.height) <= near) break;
    }
    known->second.axis = axis;
    known->second.low = at(a)[axis];
    known->second.high = at(b)[axis];
    known->second.place = best.place;
    known->second.normal = -best.inwards;
    return known->second;
  }

  // The traversal of Ju et al. 2002, 3.2: every shortest edge once, with the four leaves round it.

  Index child(Index cell, Index k) const {
    return cells_[cell].child == 0 ? cell : cells_[cell].child + k;
  }
  bool is_leaf(Index cell) const { return cells_[cell].child == 0; }

  template <class Visit>
  void in_cell(Index c, const Visit& visit) {
    if (is_leaf(c)) return;
    for (Index k = 0; k < 8; ++k) in_cell(child(c, k), visit);
    for (Index axis = 0; axis < 3; ++axis) {
      const Index u = (axis + 1) % 3, v = (axis + 2) % 3;
      for (Index k = 0; k < 4; ++k) {
        const Index beside = (k & 1) << u | (k >> 1) << v;
        at_face(axis, child(c, beside), child(c, beside | 1U << axis), visit);
      }
      for (Index half = 0; half < 2; ++half) {
        std::array<Index, 4> round{};
        for (Index k = 0; k < 4; ++k)
          round[k] = child(c, half << axis | (k & 1) << u | (k >> 1) << v);
        at_edge(axis, round, visit);
      }
    }
  }

  template <class Visit>
  void at_face(Index axis, Index low, Index high, const Visit& visit) {
    if (is_leaf(low) && is_leaf(high)) return;
    const Index u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (Index k = 0; k < 4; ++k) {
      const Index beside = (k & 1) << u | (k >> 1) << v;
      at_face(axis, child(low, beside | 1U << axis), child(high, beside), visit);
    }
    for (const Index along : {u, v}) {
      const Index other = along == u ? v : u;
      for (Index half = 0; half < 2; ++half) {
        std::array<Index, 4> round{};
        for (Index s = 0; s < 2; ++s) {
          for (Index t = 0; t < 2; ++t) {
            const Index cell =
                child(s == 0 ? low : high, half << along | (1 - s) << axis | t << other);
            // Bit 0 of the place for the axis after `along`.
            round[axis == (along + 1) % 3 ? s + 2 * t : t + 2 * s] = cell;
          }
        }
        at_edge(along, round, visit);
      }
    }
  }

  template <class Visit>
  void at_edge(Index axis, const std::array<Index, 4>& round, const Visit& visit) {
    if (std::ranges::all_of(round, [&](Index c) { return is_leaf(c); })) {
      visit(axis, round);
      return;
    }
    const Index u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (Index half = 0; half < 2; ++half) {
      std::array<Index, 4> within{};
      for (Index k = 0; k < 4; ++k)
        within[k] = child(round[k], half << axis | (1 - (k & 1)) << u | (1 - (k >> 1)) << v);
      at_edge(axis, within, visit);
    }
  }

  /// Calls visit(crossing, leaves, low end is inside) for each shortest edge that is crossed.
  template <class Visit>
  void for_each_crossing(const Visit& visit) {
    in_cell(0, [&](Index axis, const std::array<Index, 4>& round) {
      Index k = 0;
      for (Index i = 1; i < 4; ++i) {
        if (cells_[round[i]].width < cells_[round[k]].width) k = i;
      }
      const Cell& least = cells_[round[k]];
      for (const Index c : round) {
        if (!cells_[c].near) return;
      }
      const Index u = (axis + 1) % 3, v = (axis + 2) % 3;
      Place a = least.at;
      a[u] += (1 - (k & 1)) * least.width;
      a[v] += (1 - (k >> 1)) * least.width;
      Place b = a;
      b[axis] += least.width;
      const bool low = is_inside(samples_[known_.at(key(a))]);
      if (low != is_inside(samples_[known_.at(key(b))])) visit(crossing(a, b), round, low);
    });
  }

  /// Makes the surface of the leaves. \return those to divide, because it is not exact there
  std::vector<Index> trace() {
    std::vector<PlaneCorner> planes;
    std::vector<Index> of;
    for (Cell& cell : cells_) cell.corner = 0;
    struct Crossed {
      Crossing* crossing;
      std::array<Index, 4> round;
    };
    std::vector<Crossed> crossed;
    for_each_crossing([&](Crossing& x, const std::array<Index, 4>& leaves, bool low) {
      crossed.push_back({&x, {leaves[0], leaves[1], leaves[3], leaves[2]}});
      auto& round = crossed.back().round;
      if (!low) std::swap(round[1], round[3]);  // counter-clockwise seen from outside
      for (std::size_t k = 0; k < 4; ++k) {
        if (round[k] == round[(k + 3) % 4]) continue;
        Cell& cell = cells_[round[k]];
        if (cell.corner == 0) {
          planes.emplace_back();
          of.push_back(round[k]);
          cell.corner = static_cast<Index>(planes.size());
        }
        planes[cell.corner - 1].add(x.place, x.normal);
      }
    });
    leaves_.resize(cells_.size());
    corners_.resize(planes.size());
    for (std::size_t i = 0; i < planes.size(); ++i) {
      LeafCorner& known = leaves_[of[i]];
      if (!(known.planes == planes[i])) known = corner_in(cells_[of[i]], planes[i]);
      corners_[i] = known.place;
    }
    soup_ = {};
    worst_ = 0;
    std::vector<double> error(cells_.size(), 0);
    for (const auto& [crossing, round] : crossed) {
      const double here = add_polygon(*crossing, round);
      worst_ = std::max(worst_, here);
      for (const Index c : round) error[c] = std::max(error[c], here);
    }
    std::vector<Index> out;
    for (Index c = 0; c < error.size(); ++c) {
      if (error[c] > error_ && cells_[c].width > 2 && evaluations_ <= kMostSamples)
        out.push_back(c);
    }
    std::ranges::sort(
        out, [&](Index a, Index b) { return error[a] != error[b] ? error[a] > error[b] : a < b; });
    return out;
  }

  /// Where the surface goes through the face that two leaves share, if the straight way between
  /// their corners does not.
  /// \return false: it does
  bool misses_face(Index a, Index b, Vec3& through) {
    if (cells_[a].width != cells_[b].width ? cells_[a].width > cells_[b].width : a > b)
      std::swap(a, b);
    const Cell &small = cells_[a], &large = cells_[b];
    const Vec3 low = at(small.at), high = at(corner_of(small, 7));
    const Vec3 from = leaves_[a].place, to = leaves_[b].place, way = to - from;
    int axis = 0;
    while (axis < 2 && large.at[axis] < small.at[axis] + small.width &&
           small.at[axis] < large.at[axis] + large.width)
      ++axis;
    const double face = large.at[axis] > small.at[axis] ? high[axis] : low[axis];
    const double share = way[axis] != 0 ? std::clamp((face - from[axis]) / way[axis], 0.0, 1.0) : 0;
    const Vec3 at_face = from + share * way;
    bool misses = false;
    for (const int other : {(axis + 1) % 3, (axis + 2) % 3})
      misses |= at_face[other] < low[other] || at_face[other] > high[other];
    if (!misses && !careful_) return false;
    FacePoint& known = faces_[std::uint64_t{a} << 32U | b];
    if (known.from != from || known.to != to) {
      const Vec3 room = kOffBorder * (high - low);
      Vec3 place = at_face;
      Sample best = samples_[small.centre];
      double least = HUGE_VAL;
      for (int i = 0; i < 4 && least > slack_; ++i) {
        place = glm::clamp(place, low + room, high - room);
        place[axis] = face;
        const Sample s = evaluate(place, &best);
        if (std::abs(s.height) < least) {
          least = std::abs(s.height);
          best = s;
        }
        Vec3 slope = s.inwards;
        slope[axis] = 0;
        const double steep = glm::dot(slope, slope);
        if (!(steep > 0)) break;
        place -= s.height / steep * slope;
      }
      known = {from, to, best.place};
    }
    through = known.place;
    return true;
  }

  /// A corner of a polygon as seen along the edge that it goes round: m, from that edge.
  struct Seen {
    double u, v, along;
  };
  Seen seen(const Vec3& p, const Crossing& x) const {
    const int u = (x.axis + 1) % 3, v = (x.axis + 2) % 3;
    return {p[u] - x.place[u], p[v] - x.place[v], p[x.axis]};
  }
  static double turn(const Seen& a, const Seen& b) { return a.u * b.v - a.v * b.u; }

  /// Whether an edge passes through the triangle.
  static bool is_crossed(const Seen& a, const Seen& b, const Seen& c, const Crossing& x) {
    const double ab = turn(a, b), bc = turn(b, c), ca = turn(c, a), sum = ab + bc + ca;
    const bool inside = (ab >= 0 && bc >= 0 && ca >= 0) || (ab <= 0 && bc <= 0 && ca <= 0);
    if (!inside || sum == 0) return false;
    const double along = (bc * a.along + ca * b.along + ab * c.along) / sum;
    return along >= x.low && along <= x.high;
  }

  /// Whether the quadrangle a b c d, divided from a to c, stays between the edge and its corners.
  static bool stays(const Seen& a, const Seen& b, const Seen& c, const Seen& d, const Crossing& x) {
    const double of_b = turn(a, b) + turn(b, c) + turn(c, a);
    const double of_d = turn(a, c) + turn(c, d) + turn(d, a);
    if (!(of_b * of_d > 0)) return false;  // folded
    const bool in_b = is_crossed(a, b, c, x);
    if (!in_b && !is_crossed(a, c, d, x)) return false;
    // The diagonal passes between the edge and the corner of the other triangle.
    const Seen& beyond = in_b ? d : b;
    const double of_a = turn(beyond, a), of_c = turn(beyond, c),
                 length2 = beyond.u * beyond.u + beyond.v * beyond.v;
    if (of_a == of_c || !(length2 > 0)) return false;
    const double t = of_a / (of_a - of_c);
    const double u = a.u + t * (c.u - a.u), v = a.v + t * (c.v - a.v);
    const double share = (u * beyond.u + v * beyond.v) / length2;
    const double along = a.along + t * (c.along - a.along);
    return share >= 0 && along >= x.low + share * (beyond.along - x.low) &&
           along <= x.high + share * (beyond.along - x.high);
  }

  /// Adds the polygon round a crossing. It stays in the space between the edge, the faces beside it
  /// and the corners in the leaves, which no other polygon enters (Ju & Udeshi 2006, 3): where two
  /// triangles do not, a fan does. \return its error
  double add_polygon(Crossing& x, const std::array<Index, 4>& round) {
    std::vector<Index> ring;
    std::vector<Vec3> places;
    bool plain = true;
    const auto add = [&](Index corner) {
      ring.push_back(corner);
      places.push_back(corners_[corner]);
    };
    for (std::size_t k = 0; k < 4; ++k) {
      const Index next = round[(k + 1) % 4];
      if (next == round[k]) continue;
      add(cells_[round[k]].corner - 1);
      Vec3 through;
      if (!misses_face(round[k], next, through)) continue;
      corners_.push_back(through);  // equal corners are one later
      add(static_cast<Index>(corners_.size() - 1));
      plain = false;
    }
    if (x.checked != places) judge(x, places, plain, round);
    if (x.way == Way::fan) {
      corners_.push_back(x.place);
      const auto middle = static_cast<Index>(corners_.size() - 1);
      for (std::size_t k = 0; k < ring.size(); ++k) {
        const Index next = ring[(k + 1) % ring.size()];
        if (next != ring[k]) soup_.faces.push_back({middle, ring[k], next});
      }
    } else {
      const std::size_t turn = x.way == Way::turned ? 1 : 0;
      soup_.faces.push_back({ring[turn], ring[turn + 1], ring[turn + 2]});
      if (ring.size() == 4)
        soup_.faces.push_back({ring[turn], ring[turn + 2], ring[(turn + 3) % 4]});
    }
    return x.error;
  }

  /// Takes the most exact way to divide a polygon, and measures its error.
  void judge(Crossing& x, const std::vector<Vec3>& places, bool plain,
             const std::array<Index, 4>& round) {
    const Sample near = samples_[cells_[round[0]].centre];
    const auto off = [&](const Vec3& place) { return std::abs(evaluate(place, &near).height); };
    x.checked = places;
    x.error = HUGE_VAL;
    x.way = Way::fan;
    const std::size_t count = places.size();
    double corners = 0;
    for (const Index c : round) corners = std::max(corners, leaves_[c].error);
    for (std::size_t turn = 0; plain && turn < count - 2; ++turn) {
      const Vec3 &a = places[turn], &b = places[turn + 1], &c = places[turn + 2],
                 &d = places[(turn + 3) % count];
      if (!(count == 4 ? stays(seen(a, x), seen(b, x), seen(c, x), seen(d, x), x)
                       : is_crossed(seen(a, x), seen(b, x), seen(c, x), x)))
        continue;
      double error = std::max(corners, off((a + b + c) / 3.0));
      if (count == 4 && error < x.error) error = std::max(error, off((a + c + d) / 3.0));
      if (count == 4 && error < x.error) error = std::max(error, off(0.5 * (a + c)));
      if (error >= x.error) continue;
      x.error = error;
      x.way = turn == 0 ? Way::straight : Way::turned;
      if (error <= 0.5 * error_) break;
    }
    if (x.way == Way::fan) {
      x.error = corners;
      for (std::size_t k = 0; k < count; ++k)
        x.error = std::max(x.error, off((x.place + places[k] + places[(k + 1) % count]) / 3.0));
    }
  }

  /// m, the largest error at corners, at middles of sides, and closely in the worst triangles. More
  /// than what cells are divided for, because that is measured at fewer places.
  double found_error() {
    constexpr std::size_t kClosely = 200;  // triangles
    constexpr int kSteps = 6;              // along their sides
    std::vector<Sample> at;
    at.reserve(corners_.size());
    for (const Vec3& corner : corners_)
      at.push_back(evaluate(corner, at.empty() ? nullptr : &at.back()));
    std::unordered_map<std::uint64_t, double, Mixed> of_side;
    const auto side_error = [&](Index a, Index b) {
      if (a > b) std::swap(a, b);
      const auto [known, is_new] = of_side.try_emplace(std::uint64_t{a} << 32U | b);
      if (is_new)
        known->second = std::abs(evaluate(0.5 * (corners_[a] + corners_[b]), &at[a]).height);
      return known->second;
    };
    std::vector<std::pair<double, Index>> errors;
    for (Index f = 0; f < soup_.faces.size(); ++f) {
      const std::vector<Index>& face = soup_.faces[f];
      double error = 0;
      for (std::size_t k = 0; k < 3; ++k)
        error =
            std::max({error, std::abs(at[face[k]].height), side_error(face[k], face[(k + 1) % 3])});
      errors.emplace_back(error, f);
    }
    const std::size_t count = std::min(kClosely, errors.size());
    std::ranges::partial_sort(errors, errors.begin() + static_cast<std::ptrdiff_t>(count),
                              std::greater());
    double most = errors.front().first;
    for (std::size_t i = 0; i < count; ++i) {
      const std::vector<Index>& face = soup_.faces[errors[i].second];
      for (int u = 0; u <= kSteps; ++u) {
        for (int v = 0; u + v <= kSteps; ++v) {
          const double first = u / static_cast<double>(kSteps);
          const double second = v / static_cast<double>(kSteps);
          const Vec3 place = first * corners_[face[0]] + second * corners_[face[1]] +
                             (1 - first - second) * corners_[face[2]];
          most = std::max(most, std::abs(evaluate(place, &at[face[0]]).height));
        }
      }
    }
    return most;
  }

  /// The corner of the surface in a leaf: on as many planes as agree with it.
  LeafCorner corner_in(const Cell& cell, const PlaneCorner& planes) {
    const Vec3 low = at(cell.at), high = at(corner_of(cell, 7));
    const Sample centre = samples_[cell.centre];
    Sample best;
    double least = HUGE_VAL;
    for (int rank = 3; rank > 0; --rank) {
      const Vec3 wanted = planes.corner(rank);
      const Vec3 place = glm::clamp(wanted, low, high);
      const Sample s = evaluate(place, &centre);
      const double off = std::abs(s.height);
      if (off < least) {
        least = off;
        best = s;
      }
      if (off <= 0.1 * error_) break;
    }
    // Under rounded edges the planes only touch the surface.
    if (least > slack_) {
      const Vec3 place = glm::clamp(best.place - best.height * best.inwards, low, high);
      const Sample s = evaluate(place, &best);
      if (std::abs(s.height) < least) best = s;
    }
    return {planes, best.place, std::abs(best.height)};
  }

  const LayerField& field_;
  double slack_, error_;  // m
  double size_ = 0;       // m, width of the first cell
  double base_ = 0;       // m, width of cells that may be taken for simple
  int levels_ = 0;
  bool careful_ = false;  ///< a corner in each face
  Vec3 origin_;
  std::vector<Cell> cells_;
  std::vector<Sample> samples_;
  std::unordered_map<std::uint64_t, Index, Mixed> known_;
  std::unordered_map<std::uint64_t, Crossing, Mixed> crossings_;
  std::unordered_map<std::uint64_t, FacePoint, Mixed> faces_;  ///< by leaves, the smaller first
  std::vector<LeafCorner> leaves_;                             ///< by cell
  std::vector<Vec3> corners_;
  PolygonSoup soup_;
  double worst_ = 0;
  std::size_t evaluations_ = 0;
};

}  // namespace

LayerSurface layer_surface(const SolidDepth& solid, double depth, const SolidDepth* within) {
  if (solid.empty() || (within != nullptr && within->empty())) return {};
  // Layers of neighbours overlap, so that there is no crack between them.
  const double beyond = within != nullptr ? kLayerError * depth : 0;
  const LayerField field(solid, depth, within, beyond);
  Vec3 low = solid.low() + depth, high = solid.high() - depth;
  if (within != nullptr) {
    low = glm::max(low, within->low() - beyond);
    high = glm::min(high, within->high() + beyond);
  }
  const Vec3 extent = high - low;
  if (!(std::min({extent.x, extent.y, extent.z}) > 0)) return {};
  constexpr int kMostAttempts = 3;
  for (int attempt = 0;; ++attempt) {
    try {
      return Contour(field, depth, low, high, attempt).made();
    } catch (const MeshError&) {
      if (attempt + 1 == kMostAttempts) throw;
    }
  }
}

double deepest_layer(const SolidDepth& solid, const SolidDepth* within) {
  if (solid.empty()) return 0;
  struct Cube {
    double most;  // m, no point is deeper
    Vec3 centre;
    double half;  // m
    bool operator<(const Cube& other) const { return most < other.most; }
  };
  std::priority_queue<Cube> left;
  double deepest = 0;
  const auto add = [&](const Vec3& centre, double half) {
    const double depth = solid.at(centre).depth, radius = std::sqrt(3.0) * half;
    const double own = within == nullptr ? HUGE_VAL : within->at(centre).depth;
    if (own > 0) deepest = std::max(deepest, depth);
    if (own > -radius) left.push({depth + radius, centre, half});
  };
  const Vec3 extent = solid.high() - solid.low();
  add(0.5 * (solid.low() + solid.high()), 0.5 * std::max({extent.x, extent.y, extent.z}));
  constexpr double kWithin = 1e-3;
  constexpr int kMostCubes = 4'000;  // some 0.1 s
  for (int i = 0; i < kMostCubes && !left.empty(); ++i) {
    const Cube cube = left.top();
    if (cube.most <= (1 + kWithin) * deepest) break;
    left.pop();
    for (Index k = 0; k < 8; ++k) {
      const Vec3 way((k & 1) != 0 ? 1 : -1, (k & 2) != 0 ? 1 : -1, (k & 4) != 0 ? 1 : -1);
      add(cube.centre + 0.5 * cube.half * way, 0.5 * cube.half);
    }
  }
  return kSurelyLeft * deepest;
}

}  // namespace palpate::stimuli
