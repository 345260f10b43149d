#pragma once
// Continuous detection of the first contact: the facet of M by which the probe came in.

#include <memory>

#include "rendering/bounding_tree.h"
#include "rendering/facet_walk.h"
#include "rendering/probe.h"
#include "rendering/support_map.h"
#include "stimuli/convex_mesh.h"

namespace palpate::rendering {

/// The two hierarchies of the paper's section 4(a). A mesh that is small enough to scan has none,
/// and where only points are shown there is no tree of edges.
class ContactTrees {
 public:
  /// Facets or edges; so few are scanned faster than any tree is climbed.
  static constexpr std::size_t kScan = 64;

  /// \param scanned  for measurements: so many primitives get no tree
  ContactTrees(const stimuli::ConvexMesh& mesh, bool with_edges, std::size_t scanned = kScan);

  const BoundingTree* polygons() const { return polygons_.nodes().empty() ? nullptr : &polygons_; }
  const BoundingTree* edges() const { return edges_.nodes().empty() ? nullptr : &edges_; }
  const SupportMap* support_map() const { return support_map_.empty() ? nullptr : &support_map_; }

 private:
  BoundingTree polygons_, edges_;
  SupportMap support_map_;
};

/// Where and when the probe came in.
struct FirstContact {
  MinkowskiFacet facet;  ///< kind none: it did not
  double time = 2;       ///< fraction of the tick, 0 to 1
};

/// The earliest entry while both ends move linearly from `before` to `after`. Mesh frame.
/// Exact for any length of motion and any rotation within the tick: an end point meets a facet's
/// plane at the root of a linear equation, the segment meets an edge at a root of a quadratic one.
/// \param tolerance  m; how far outside of a polygon's or edge's rim still counts, against rounding
FirstContact first_contact_segment(const stimuli::ConvexMesh& mesh, const ContactTrees& trees,
                                   const LineProbe& before, const LineProbe& after,
                                   double tolerance);

/// The same for the tip alone.
FirstContact first_contact_point(const stimuli::ConvexMesh& mesh, const ContactTrees& trees,
                                 const Vec3& before, const Vec3& after, double tolerance);

}  // namespace palpate::rendering
