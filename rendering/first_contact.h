#pragma once
// Continuous collision detection: at which time of a tick, and through which facet of M
// (facet_walk.h), the probe enters an object. Mesh frame, SI units.

#include <cstdint>

#include "rendering/contact_feature.h"
#include "rendering/facet_map.h"
#include "rendering/probe.h"
#include "stimuli/bounding_tree.h"
#include "stimuli/surfaces/support_map.h"
#include "stimuli/vec.h"

namespace palpate::stimuli {
class ConvexMesh;
}

namespace palpate::rendering {

/// The bounding-volume hierarchies of one mesh: of polygons and of edges, as in section 4(a) of the
/// paper. A mesh that is small enough to scan has no trees, and the point renderer needs no tree of
/// edges.
class ContactTrees {
 public:
  /// Facets or edges; a scan of up to so many is faster than any tree.
  static constexpr std::size_t kScanLimit = 64;

  /// \param scan_limit  for measurements: up to so many facets or edges get no tree
  /// \param small_mesh  for measurements: a mesh of up to so many vertices gets no maps
  ContactTrees(const stimuli::ConvexMesh& mesh, bool with_edges,
               std::size_t scan_limit = kScanLimit,
               std::size_t small_mesh = stimuli::SupportMap::kSmallMesh);

  const stimuli::BoundingTree* polygons() const {
    return polygons_.nodes().empty() ? nullptr : &polygons_;
  }
  const stimuli::BoundingTree* edges() const { return edges_.nodes().empty() ? nullptr : &edges_; }
  /// Two large faces meet at less than twice the blend angle of equation (2).
  bool shallow_ridges() const { return shallow_ridges_; }
  const stimuli::SupportMap* support_map() const {
    return support_map_.empty() ? nullptr : &support_map_;
  }
  const FacetMap* facet_map() const { return facet_map_.empty() ? nullptr : &facet_map_; }

 private:
  stimuli::BoundingTree polygons_, edges_;
  stimuli::SupportMap support_map_;
  FacetMap facet_map_;
  bool shallow_ridges_ = false;
};

/// Where and when the probe entered.
struct FirstContact {
  ContactFeature feature;  ///< kind none: it did not enter
  double time = 2;         ///< time of impact, as a fraction of the tick: 0 to 1
};

/// The earliest entry while both ends move linearly from `before` to `after`. Exact for any length
/// of motion and any rotation within the tick: an end point meets a facet's plane at the root of a
/// linear equation, the segment meets an edge at a root of a quadratic one.
/// \param tolerance  m; a point this far past the end of an edge or the side of a polygon counts as
/// on it
FirstContact first_contact_segment(const stimuli::ConvexMesh& mesh, const ContactTrees& trees,
                                   const LineProbe& before, const LineProbe& after,
                                   double tolerance);

/// The same for the tip alone.
FirstContact first_contact_point(const stimuli::ConvexMesh& mesh, const ContactTrees& trees,
                                 const Vec3& before, const Vec3& after, double tolerance);

}  // namespace palpate::rendering
