#pragma once
// The methods for penetration depth, direction and contact point that `palpate accuracy` compares,
// behind one interface: the renderers, variants of their walk, and other libraries. Each is defined
// once, in contact_methods().

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "rendering/facet_walk.h"
#include "rendering/probe.h"
#include "runner/evidence/accuracy/local_depths.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/shapes.h"

namespace palpate::runner::evidence {

/// The walk of facet_walk.h, rewritten as plainly as possible for any floating-point precision, to
/// measure the cost and gain of single precision. Not for the servo.
template <class Real>
class PlainWalk {
 public:
  using Vector = glm::vec<3, Real>;

  explicit PlainWalk(const stimuli::ConvexMesh& mesh) : size_(static_cast<Real>(mesh.size())) {
    for (const Vec3& v : mesh.vertices()) vertices_.push_back(Vector(v));
    for (const stimuli::Facet& f : mesh.facets()) {
      facets_.push_back(
          {Vector(f.normal), static_cast<Real>(f.offset), f.first_side, f.side_count});
    }
    for (std::uint32_t f = 0; f < mesh.facets().size(); ++f) {
      const stimuli::Facet& facet = mesh.facets()[f];
      for (std::uint32_t i = facet.first_side; i < facet.first_side + facet.side_count; ++i) {
        const stimuli::Side& s = mesh.sides()[i];
        const stimuli::Edge& edge = mesh.edges()[s.edge];
        sides_.resize(mesh.sides().size());
        sides_[i] = {Vector(s.inward), static_cast<Real>(s.offset), s.edge, s.across,
                     edge.left == f ? edge.v0 : edge.v1};
      }
    }
    edges_.assign(mesh.edges().begin(), mesh.edges().end());
    fan_first_.assign(mesh.fan_first().begin(), mesh.fan_first().end());
    fan_edges_.assign(mesh.fan_edges().begin(), mesh.fan_edges().end());
  }

  /// As walk_segment; the result is widened to double.
  rendering::WalkResult walk(rendering::ContactFeature start, const Vec3& tip,
                             const Vec3& d) const {
    const Vector t(tip), v(d);
    // Allow for as many units in the last place as the walk in double precision.
    const Real gain = Real(4.5) * std::numeric_limits<Real>::epsilon() * size_;
    At at = resume(start, t, v);
    for (std::size_t steps = 0; at.depth >= 0 && steps < facets_.size() + edges_.size(); ++steps) {
      At next;
      if (!step(at, t, v, next) || !(next.depth < at.depth - gain)) break;
      at = next;
    }
    rendering::WalkResult result;
    result.normal = Vec3(at.normal);
    result.depth = static_cast<double>(at.depth);
    result.probe_fraction = std::clamp(static_cast<double>(at.probe_fraction), 0.0, 1.0);
    if (at.depth >= 0) result.feature = at.feature;
    return result;
  }

 private:
  using Kind = rendering::ContactFeature::Kind;
  struct PlainFacet {
    Vector normal;
    Real offset;
    std::uint32_t first_side, side_count;
  };
  struct PlainSide {
    Vector inward;
    Real offset;
    std::uint32_t edge, across, corner;
  };
  struct At {
    rendering::ContactFeature feature;
    Vector normal;
    Real depth = 0, probe_fraction = 0, edge_fraction = 0;
  };

  At face(std::uint32_t index, const Vector& tip, const Vector& d) const {
    const PlainFacet& f = facets_[index];
    const Real slope = glm::dot(f.normal, d), height = f.offset - glm::dot(f.normal, tip);
    At at;
    at.feature = {Kind::facet, false, index};
    at.normal = f.normal;
    at.probe_fraction = slope >= 0 ? Real(0) : Real(1);
    at.depth = slope >= 0 ? height : height - slope;
    return at;
  }

  bool ahead(std::uint32_t index, const Vector& d) const {
    return glm::dot(facets_[index].normal, d) >= 0;
  }

  bool edge(std::uint32_t index, const Vector& tip, const Vector& d, At& at) const {
    const stimuli::Edge& e = edges_[index];
    const bool left = ahead(e.left, d);
    if (left == ahead(e.right, d)) return false;
    const Vector line = vertices_[e.v1] - vertices_[e.v0], w = tip - vertices_[e.v0];
    const Vector c = glm::cross(line, d);
    const Real c2 = glm::dot(c, c);
    constexpr Real kParallel = sizeof(Real) == 8 ? Real(1e-9) : Real(1e-5);
    if (c2 <= kParallel * kParallel * glm::dot(line, line) * glm::dot(d, d)) return false;
    at.feature = {Kind::edge, left, index};
    at.normal = (left ? c : -c) / std::sqrt(c2);
    at.depth = -glm::dot(at.normal, w);
    at.probe_fraction = glm::dot(glm::cross(w, line), c) / c2;
    at.edge_fraction = glm::dot(glm::cross(w, d), c) / c2;
    return true;
  }

  At resume(rendering::ContactFeature start, const Vector& tip, const Vector& d) const {
    if (start.kind != Kind::edge) return face(start.index, tip, d);
    At at;
    if (edge(start.index, tip, d, at)) return at;
    const stimuli::Edge& e = edges_[start.index];
    const bool both = ahead(e.left, d) && ahead(e.right, d);
    return face(start.left_ahead != both ? e.left : e.right, tip, d);
  }

  const PlainSide* beyond(const PlainFacet& f, const Vector& p) const {
    const PlainSide* sides = &sides_[f.first_side];
    const auto outside = [&](std::uint32_t i) {
      return glm::dot(sides[i].inward, p) < sides[i].offset;
    };
    if (f.side_count <= 12) {
      const PlainSide* worst = nullptr;
      Real most = 0;
      for (std::uint32_t i = 0; i < f.side_count; ++i) {
        const Real distance = sides[i].offset - glm::dot(sides[i].inward, p);
        if (distance > most) {
          most = distance;
          worst = &sides[i];
        }
      }
      return worst;
    }
    if (outside(0)) return &sides[0];
    if (outside(f.side_count - 1)) return &sides[f.side_count - 1];
    const Vector apex = vertices_[sides[0].corner];
    const Vector turn = glm::cross(f.normal, p - apex);
    std::uint32_t low = 1, high = f.side_count - 1;
    while (high - low > 1) {
      const std::uint32_t middle = (low + high) / 2;
      (glm::dot(vertices_[sides[middle].corner] - apex, turn) <= 0 ? low : high) = middle;
    }
    return outside(low) ? &sides[low] : nullptr;
  }

  bool step(const At& at, const Vector& tip, const Vector& d, At& next) const {
    if (at.feature.kind == Kind::facet) {
      const PlainFacet& f = facets_[at.feature.index];
      const PlainSide* side = beyond(f, tip + at.probe_fraction * d + at.depth * at.normal);
      if (!side) return false;
      if (!edge(side->edge, tip, d, next)) next = face(side->across, tip, d);
      return true;
    }
    const stimuli::Edge& e = edges_[at.feature.index];
    if (at.probe_fraction < 0 || at.probe_fraction > 1) {
      next = face((at.probe_fraction < 0) == at.feature.left_ahead ? e.left : e.right, tip, d);
      return true;
    }
    if (at.edge_fraction >= 0 && at.edge_fraction <= 1) return false;
    const std::uint32_t vertex = at.edge_fraction > 1 ? e.v1 : e.v0;
    for (std::uint32_t i = fan_first_[vertex]; i < fan_first_[vertex + 1]; ++i) {
      const std::uint32_t other = fan_edges_[i];
      if (other == at.feature.index) continue;
      if (ahead(edges_[other].left, d) == ahead(edges_[other].right, d)) continue;
      if (!edge(other, tip, d, next)) next = face(edges_[other].left, tip, d);
      return true;
    }
    return false;
  }

  Real size_;
  std::vector<Vector> vertices_;
  std::vector<PlainFacet> facets_;
  std::vector<PlainSide> sides_;
  std::vector<stimuli::Edge> edges_;
  std::vector<std::uint32_t> fan_first_, fan_edges_;
};

/// The result of one method for one pose. Frame of the object.
struct ContactEstimate {
  bool touching = false;
  double depth = 0;  ///< m; NaN: the method gave up
  Vec3 normal;       ///< unit, out of the object
  Vec3 point;        ///< m, contact point on the ideal probe; NaN if the method gives none
};

/// One method over one mesh, with its state between ticks.
class ContactMethod {
 public:
  virtual ~ContactMethod() = default;
  virtual ContactEstimate tick(const rendering::LineProbe& probe) = 0;
};

struct MethodDefinition {
  std::string name;          ///< "walk", ...
  std::string description;   ///< a line for a legend
  bool has_history = false;  ///< needs every tick of a path, in order
  bool keeps_side = false;   ///< a god-object: stays on the side by which it entered
  bool visits_all = false;   ///< every facet, at every tick: slow on fine meshes
  std::unique_ptr<ContactMethod> (*make)(const stimuli::ConvexMesh& mesh, bool segment) = nullptr;
};

/// All methods of this build. The mesh must outlive the result of `make`. `segment` false: the
/// probe is its tip alone.
std::vector<MethodDefinition> contact_methods();

/// The distribution of one kind of error over the ticks on which it is defined.
struct ErrorSpread {
  std::size_t count = 0;
  double rms = 0, p999 = 0, worst = 0;  ///< p999: 99.9 % are at most this large
};

ErrorSpread error_spread(std::vector<double> errors);

/// The errors of a method against the exact local penetration depths.
struct ErrorSummary {
  std::size_t ticks = 0;    ///< compared
  std::size_t lost = 0;     ///< false negatives: touching, but no contact found; its force is 0
  std::size_t phantom = 0;  ///< false positives
  std::size_t gave_up = 0;  ///< of `lost`: the method reported a failure
  std::size_t deeper = 0;   ///< ticks held at a local minimum that is not the least
  ErrorSpread depth;        ///< m, along the held direction
  ErrorSpread normal;       ///< rad
  ErrorSpread point;        ///< m; where the contact point is defined (kFlat)
  ErrorSpread force;        ///< N, as a vector, at kStiffness
  ErrorSpread torque;       ///< N m, as a vector about the tip, at kStiffness, as for `point`
};

constexpr double kStiffness = 800;  ///< N/m, of the compared forces and torques
/// rad (2 degrees). A probe closer to parallel with a flat of the object touches it along a length:
/// the contact point is then a convention (the renderer's is equation (2) within 1 degree).
constexpr double kFlat = 0.0349065850398866;

/// Collects estimates and summarises their errors.
class ErrorTally {
 public:
  /// \param truth  all local depths, least first; empty: not touching. The estimate is compared
  /// with the one nearest to it in direction
  void add(const rendering::LineProbe& probe, const std::vector<LocalDepth>& truth,
           const ContactEstimate& estimate);
  ErrorSummary summary() const;

 private:
  ErrorSummary counts_;
  std::vector<double> depth_, normal_, point_, force_, torque_;
};

}  // namespace palpate::runner::evidence
