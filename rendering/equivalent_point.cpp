#include "rendering/equivalent_point.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "rendering/probes.h"
#include "stimuli/convex_mesh.h"

namespace palpate::rendering {
namespace {

using Kind = ContactFeature::Kind;

constexpr int kMostFaces = 12;  // to each side; each face moves the point by less than its length

/// Angle of the segment to a face as a share of the blend angle, -1 to 1; 1: its first end dips.
double turned_by(double slope, double length) {
  if (slope >= tick::kSinBlendAngle * length) return 1;
  if (slope <= -tick::kSinBlendAngle * length) return -1;
  return std::clamp(tick::small_asin(slope / length) / tick::kBlendAngle, -1.0, 1.0);
}

/// A facet of one of the parts.
struct Face {
  std::size_t part = 0;
  std::uint32_t facet = 0;
};

/// The segment over the faces of all parts.
class Faces {
 public:
  Faces(std::span<const FacedPart> parts, double tolerance)
      : parts_(parts), tolerance_(tolerance), length_(glm::length(parts[0].d)) {}

  tick::Portion portion(const Face& face) const {
    const FacedPart& at = parts_[face.part];
    return tick::touching_portion(*at.part->mesh, face.facet, at.ideal, at.d);
  }

  /// The face beyond the side over which the segment leaves a face, towards its end or its
  /// beginning.
  Face beyond(const Face& face, bool towards_end) const {
    const FacedPart& at = parts_[face.part];
    const stimuli::Facet& facet = facet_of(face);
    if (facet.side_count == 3) return crossed_triangle(face, towards_end).next;
    Face out = face;
    double nearest = HUGE_VAL;
    for (std::uint32_t i = facet.first_side; i < facet.first_side + facet.side_count; ++i) {
      const stimuli::Side& side = at.part->mesh->sides()[i];
      const double slope = glm::dot(side.inward, at.d) * (towards_end ? 1 : -1);
      if (!(slope < 0)) continue;
      const double start =
          glm::dot(side.inward, towards_end ? at.ideal : at.ideal + at.d) - side.offset;
      if (start / -slope >= nearest) continue;
      nearest = start / -slope;
      out.facet = side.across;
    }
    return out;
  }

  /// By how much `face` and the following ones, towards the end or the beginning, move the point
  /// from `from`. Counts in `along` the faces within the blend angle.
  /// \param on  the point at `from`, on the surface, world frame
  double way(Face face, double from, const Vec3& on, bool towards_end, int& along) const {
    Face last = face;
    double moved = 0;
    for (int i = 0; i < kMostFaces; ++i) {
      // A convex surface falls away: once a face is past the blend angle, so are all beyond it. But
      // where the solid was cut, another part may continue behind the cut's wall.
      double angle = turned_to(face);
      Crossed at = crossed(face, towards_end);
      const bool past_angle = towards_end ? angle >= 1 : angle <= -1;
      const bool beside = !(at.portion.enter <= at.portion.leave);
      if (past_angle || beside || (i > 0 && std::abs(angle) >= 1)) {
        const bool continued = continues(face, from, i > 0 ? foot(last, from) : on, towards_end);
        if (!continued && (past_angle || beside)) break;
        if (continued) {
          angle = turned_to(face);
          at = crossed(face, towards_end);
        }
      }
      const double end =
          towards_end ? std::max(from, at.portion.leave) : std::min(from, at.portion.enter);
      along += std::abs(angle) < 1;
      moved += (end - from) * 0.5 * (towards_end ? 1 - angle : 1 + angle);
      from = end;
      if (towards_end ? from >= 1 : from <= 0) break;
      last = face;
      face = at.next;
    }
    return moved;
  }

  /// The point of the segment at a fraction, moved onto a face. World frame.
  Vec3 foot(const Face& face, double fraction) const {
    const FacedPart& at = parts_[face.part];
    const stimuli::Facet& facet = facet_of(face);
    const Vec3 point = at.ideal + fraction * at.d;
    return at.part->world_vector(point -
                                 (glm::dot(facet.normal, point) - facet.offset) * facet.normal) +
           at.part->position;
  }

 private:
  const stimuli::Facet& facet_of(const Face& face) const {
    return parts_[face.part].part->mesh->facets()[face.facet];
  }

  /// The portion of the segment over a face, and the next face.
  struct Crossed {
    tick::Portion portion;
    Face next;
  };
  Crossed crossed(const Face& face, bool towards_end) const {
    if (facet_of(face).side_count == 3) return crossed_triangle(face, towards_end);
    return {portion(face), beyond(face, towards_end)};
  }

  /// As tick::touching_portion; reads facets only.
  Crossed crossed_triangle(const Face& face, bool towards_end) const {
    const FacedPart& at = parts_[face.part];
    const stimuli::Facet& facet = facet_of(face);
    const Vec3 a = at.ideal - (glm::dot(facet.normal, at.ideal) - facet.offset) * facet.normal;
    const Vec3 along = at.d - glm::dot(facet.normal, at.d) * facet.normal;
    Crossed out{{}, face};
    double nearest = HUGE_VAL;
    for (const stimuli::Neighbour& side : facet.triangle) {
      const stimuli::Facet& across = at.part->mesh->facets()[side.across];
      const double height = across.offset - glm::dot(across.normal, a);
      const double slope = -glm::dot(across.normal, along);
      const double at_side = -height / slope;
      out.portion.enter = slope > 0 ? std::max(out.portion.enter, at_side) : out.portion.enter;
      out.portion.leave = slope < 0 ? std::min(out.portion.leave, at_side) : out.portion.leave;
      if ((slope == 0) & (height < 0)) out.portion.leave = -1;
      if (!(towards_end ? slope < 0 : slope > 0)) continue;
      const double way = towards_end ? at_side : -at_side;
      if (way >= nearest) continue;
      nearest = way;
      out.next.facet = side.across;
    }
    return out;
  }

  double turned_to(const Face& face) const {
    return turned_by(glm::dot(facet_of(face).normal, parts_[face.part].d), length_);
  }

  bool is_on(const stimuli::ConvexMesh& mesh, std::uint32_t index, const Vec3& point) const {
    const stimuli::Facet& facet = mesh.facets()[index];
    if (std::abs(glm::dot(facet.normal, point) - facet.offset) > tolerance_) return false;
    for (std::uint32_t i = facet.first_side; i < facet.first_side + facet.side_count; ++i) {
      const stimuli::Side& side = mesh.sides()[i];
      if (glm::dot(side.inward, point) < side.offset - tolerance_) return false;
    }
    return true;
  }

  /// Whether a face of another part continues where one ends; if so, sets `face` to it.
  bool continues(Face& face, double from, const Vec3& on, bool towards_end) const {
    const std::size_t own = face.part;
    for (std::size_t k = 0; k < parts_.size(); ++k) {
      if (k == own) continue;
      const stimuli::ConvexMesh& mesh = *parts_[k].part->mesh;
      const Vec3 point = parts_[k].part->local_point(on);
      const Vec3 from_middle = point - mesh.centre();
      const double farthest = mesh.radius() + tolerance_;
      if (glm::dot(from_middle, from_middle) > farthest * farthest) continue;
      const auto takes = [&](std::uint32_t facet) {
        const Face other{k, facet};
        // Skip inner walls, where parts abut: they stand across the segment.
        if (std::abs(turned_to(other)) >= 1 || !is_on(mesh, facet, point)) return false;
        const tick::Portion at = portion(other);
        const double gap = tolerance_ / length_;
        if (!(at.enter <= at.leave)) return false;
        if (!(towards_end ? at.leave > from + gap : at.enter < from - gap)) return false;
        face = other;
        return true;
      };
      if (mesh.facets().size() <= ContactTrees::kScanLimit) {
        for (std::uint32_t facet = 0; facet < mesh.facets().size(); ++facet) {
          if (takes(facet)) return true;
        }
      } else if (takes_near(mesh, parts_[k].feature, point, takes)) {
        return true;
      }
    }
    return false;
  }

  /// The same on a large mesh, among the facets around the one under the point.
  template <class Takes>
  static bool takes_near(const stimuli::ConvexMesh& mesh, ContactFeature start, const Vec3& point,
                         const Takes& takes) {
    if (start.kind == Kind::none) start = {Kind::facet, false, 0};
    if (start.kind == Kind::edge) start = {Kind::facet, false, mesh.edges()[start.index].left};
    const WalkResult under = walk_point(mesh, start, point);
    const std::uint32_t facet =
        under.feature.kind != Kind::none ? under.feature.index : under.separating_feature.index;
    if (takes(facet)) return true;
    const stimuli::Facet& centre = mesh.facets()[facet];
    if (centre.side_count == 3) {
      for (const stimuli::Neighbour& next : centre.triangle) {
        if (takes(next.across)) return true;
      }
      return false;
    }
    for (std::uint32_t i = centre.first_side; i < centre.first_side + centre.side_count; ++i) {
      if (takes(mesh.sides()[i].across)) return true;
    }
    return false;
  }

  std::span<const FacedPart> parts_;
  double tolerance_;
  double length_;
};

}  // namespace

void spread_over_faces(std::span<const FacedPart> parts, const WalkResult& hit, double tolerance,
                       LoadedContact& c) {
  const FacedPart& carrying = parts[0];
  const ScenePart& part = *carrying.part;
  if (!(glm::dot(carrying.d, carrying.d) > 0)) return;
  const Faces faces(parts, tolerance);
  int along = 0;
  double at = hit.probe_fraction;
  if (hit.feature.kind == Kind::edge) {
    const stimuli::Edge& edge = part.mesh->edges()[hit.feature.index];
    const Face ahead{0, hit.feature.left_ahead ? edge.left : edge.right};
    const Face behind{0, hit.feature.left_ahead ? edge.right : edge.left};
    const Vec3 on = part.world_vector(carrying.ideal + at * carrying.d) + part.position;
    const double forwards = faces.way(ahead, at, on, true, along);
    at += forwards + faces.way(behind, at, on, false, along);
  } else {
    const Face face{0, hit.feature.index};
    const tick::Portion portion = faces.portion(face);
    if (!(portion.enter <= portion.leave)) return;
    const Vec3 on = faces.foot(face, portion.enter);
    at = portion.enter + faces.way(face, portion.enter, on, true, along);
    if (portion.enter > 0)
      at += faces.way(faces.beyond(face, false), portion.enter, on, false, along);
  }
  if (along < 2) return;  // one face is (2) itself
  c.probe_fraction = std::clamp(at, 0.0, 1.0);
  c.contact.type = ContactType::segment_face;
}

void place_along_border(const stimuli::ConvexMesh& mesh, const WalkResult& hit, const Vec3& tip,
                        const Vec3& d, double length, double slack, LoadedContact& c) {
  std::uint32_t index = hit.feature.index;
  if (hit.feature.kind == Kind::edge) {
    const stimuli::Edge& edge = mesh.edges()[index];
    const double left = glm::dot(mesh.facets()[edge.left].normal, d);
    const double right = glm::dot(mesh.facets()[edge.right].normal, d);
    index = std::abs(left) <= std::abs(right) ? edge.left : edge.right;
  }
  const stimuli::Facet& facet = mesh.facets()[index];
  const double slope = glm::dot(facet.normal, d);
  if (std::abs(slope) >= tick::kSinBlendAngle * length) return;
  const double angle = turned_by(slope, length);
  tick::Portion portion;
  if (facet.side_count > tick::kClippedOneByOne) {
    portion.clip_by_many(mesh, index, tip, d, slack);
  } else {
    for (std::uint32_t i = facet.first_side; i < facet.first_side + facet.side_count; ++i) {
      const stimuli::Side& side = mesh.sides()[i];
      portion.clip(glm::dot(side.inward, tip) - side.offset + slack, glm::dot(side.inward, d));
    }
  }
  if (!(portion.enter <= portion.leave)) return;
  c.probe_fraction = 0.5 * ((1 + angle) * portion.enter + (1 - angle) * portion.leave);
  c.contact.type = ContactType::segment_face;
}

}  // namespace palpate::rendering
