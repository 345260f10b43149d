#include "rendering/active_planes.h"

#include <algorithm>
#include <glm/geometric.hpp>

namespace palpate::rendering {
namespace {

// Sine squared of the angle between two planes, and the triple product of three: below it their
// intersection is nowhere.
constexpr double kParallelPair = 1e-15;
constexpr double kParallelTriple = 1e-12;

/// The conditions of Karush, Kuhn and Tucker, tried on one set of planes after the other.
class Candidates {
 public:
  Candidates(std::span<const PlaneBound> half_spaces, double tolerance)
      : spaces_(half_spaces), tolerance_(tolerance) {}

  ConstrainedPoint nearest() {
    const std::size_t count = spaces_.size();
    if (accepts(Vec3(0))) return result_;
    for (std::size_t a = 0; a < count; ++a) {
      if (try_face(a)) return result_;
    }
    for (std::size_t a = 0; a < count; ++a) {
      for (std::size_t b = a + 1; b < count; ++b) {
        if (try_edge(a, b)) return result_;
      }
    }
    for (std::size_t a = 0; a < count; ++a) {
      for (std::size_t b = a + 1; b < count; ++b) {
        for (std::size_t c = b + 1; c < count; ++c) {
          if (try_vertex(a, b, c)) return result_;
        }
      }
    }
    return {};
  }

 private:
  bool accepts(const Vec3& point) {
    for (const PlaneBound& space : spaces_) {
      if (!(glm::dot(space.normal, point) >= space.bound - tolerance_)) return false;
    }
    result_.point = point;
    result_.found = true;
    return true;
  }

  /// m, by which the plane is above a point that should be on it: rounding, large where planes are
  /// nearly parallel, which one step of refinement takes away.
  static double above(const PlaneBound& plane, const Vec3& point) {
    return plane.bound - glm::dot(plane.normal, point);
  }

  bool try_face(std::size_t a) {
    const PlaneBound& space = spaces_[a];
    if (!(space.bound >= 0) || !accepts(space.bound * space.normal)) return false;
    result_.multipliers[a] = space.bound;
    return true;
  }

  bool try_edge(std::size_t a, std::size_t b) {
    const PlaneBound &p = spaces_[a], &q = spaces_[b];
    const Vec3 along = glm::cross(p.normal, q.normal);
    const double sine2 = glm::dot(along, along);
    if (!(sine2 > kParallelPair)) return false;
    const Vec3 up_p = glm::cross(q.normal, along) / sine2;  // up by one over p, along q
    const Vec3 up_q = glm::cross(along, p.normal) / sine2;
    Vec3 point = p.bound * up_p + q.bound * up_q;
    point += above(p, point) * up_p + above(q, point) * up_q;
    // From the point, whose rounding the multipliers of a narrow wedge, far larger, do not share.
    const double of_p = glm::dot(point, up_p), of_q = glm::dot(point, up_q);
    if (!(of_p >= 0 && of_q >= 0) || !accepts(point)) return false;
    result_.multipliers[a] = of_p;
    result_.multipliers[b] = of_q;
    return true;
  }

  bool try_vertex(std::size_t a, std::size_t b, std::size_t c) {
    const PlaneBound &p = spaces_[a], &q = spaces_[b], &r = spaces_[c];
    const Vec3 qr = glm::cross(q.normal, r.normal), rp = glm::cross(r.normal, p.normal),
               pq = glm::cross(p.normal, q.normal);
    const double triple = glm::dot(p.normal, qr);
    if (!(triple * triple > kParallelTriple * kParallelTriple)) return false;
    Vec3 point = (p.bound * qr + q.bound * rp + r.bound * pq) / triple;
    point += (above(p, point) * qr + above(q, point) * rp + above(r, point) * pq) / triple;
    const double of_p = glm::dot(point, qr) / triple, of_q = glm::dot(point, rp) / triple,
                 of_r = glm::dot(point, pq) / triple;
    if (!(of_p >= 0 && of_q >= 0 && of_r >= 0) || !accepts(point)) return false;
    result_.multipliers[a] = of_p;
    result_.multipliers[b] = of_q;
    result_.multipliers[c] = of_r;
    return true;
  }

  std::span<const PlaneBound> spaces_;
  double tolerance_;
  ConstrainedPoint result_;
};

}  // namespace

ConstrainedPoint constrained_point(std::span<const PlaneBound> half_spaces, double tolerance) {
  return Candidates(half_spaces.first(std::min(half_spaces.size(), kMostPlanes)), tolerance)
      .nearest();
}

}  // namespace palpate::rendering
