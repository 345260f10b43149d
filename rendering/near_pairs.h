#pragma once
// The pairs of part and segment that an ideal tool can bring together within a tick, and where a
// motion of the tool first enters a part. Internal to the contact law of unions (union_contact.h).
// World frame, SI units.

#include <cstddef>
#include <cstdint>
#include <span>

#include "rendering/facet_walk.h"
#include "rendering/first_contact.h"
#include "rendering/probe.h"
#include "rendering/scene.h"
#include "rendering/tool.h"
#include "rendering/union_contact.h"

namespace palpate::rendering {

/// A convex part C and its search structures. With a segment S of a tool of fixed orientation it
/// forms M = C (+) (-S). Mesh frame, m.
struct CastMesh {
  const stimuli::ConvexMesh& mesh;
  const ContactTrees& trees;
  Vec3 inside;  ///< m, a point well inside of it
  /// Counts scans of all facets of M, which rounding sometimes makes necessary.
  std::uint64_t& full_scans;
};

/// The facet of M that holds the segment, or whose plane separates it (WalkResult::depth < 0).
/// Steps from facet to neighbouring facet of M, as the walk does (facet_walk.h).
/// \param start  any feature, preferably near the result; none: begins under the segment
/// \param d      the segment from tip to tip + d; zero or below rounding: a point
WalkResult locate(const CastMesh& part, ContactFeature start, const Vec3& tip, const Vec3& d);

/// The first meeting of a straight motion with M.
struct PairCast {
  bool hit = false;
  double time = 1;         ///< hit: of the motion, 0 to 1, never too late
  ContactFeature feature;  ///< hit: the facet of M entered; else one that separates at the end
};

/// The line is clipped by planes of facets of M: that of a facet seen from the line's beginning is
/// met no later than M itself, and past a side of the facet that of its neighbour is met later. So
/// wherever the steps end, the segment has not entered M before. Exact, whatever the length of the
/// motion.
/// \param start  as above
/// \param motion of the segment; it is outside of M at first (else it is hit at time 0)
PairCast cast(const CastMesh& part, ContactFeature start, const Vec3& tip, const Vec3& d,
              const Vec3& motion);

/// m, from the feature to the segment moved along the feature's normal onto its plane.
double distance_off(const stimuli::ConvexMesh& mesh, ContactFeature feature, const Vec3& tip,
                    const Vec3& d);

/// Moves the segment along the feature's normal onto its plane and returns the facet of M beyond
/// the side that the segment is then past. Kind none: it is past no side.
ContactFeature feature_beyond(const stimuli::ConvexMesh& mesh, ContactFeature feature,
                              const Vec3& tip, const Vec3& d);

/// Measures the same feature wherever the segment is. If the segment has turned so that the feature
/// is no longer a facet of M, measures the facet of the mesh whose normal it has reached.
WalkResult measure(const stimuli::ConvexMesh& mesh, ContactFeature feature, const Vec3& tip,
                   const Vec3& d);

/// Where a motion of the tool first enters a pair.
struct Entry {
  bool entered = false;
  double time = 2;  ///< of the motion
  ContactFeature feature;
};

/// Whether the pair's plane keeps the segment from the part all the way between two translations.
inline bool apart(const NearPair& near, const Vec3& from, const Vec3& to) {
  return near.has_plane && glm::dot(near.normal, from) + near.height > 0 &&
         glm::dot(near.normal, to) + near.height > 0;
}

/// A segment in the world, m.
struct PosedSegment {
  Vec3 start, along;
};

/// The pairs of one group, in one tick. Translations are relative to the virtual tool's tip.
class NearPairs {
 public:
  NearPairs(UnionTick& tick, const PartGroup& group)
      : tick_(tick),
        all_(tick.state.unions),
        group_(group),
        carried_(tick.sides ? tick.scene.tool() : nullptr) {}

  std::span<NearPair> all() { return all_.near; }
  std::span<const NearPair> all() const { return all_.near; }
  std::size_t size() const { return all_.near.size(); }
  NearPair& operator[](std::size_t i) { return all_.near[i]; }
  const NearPair& operator[](std::size_t i) const { return all_.near[i]; }

  const ScenePart& part_of(const NearPair& near) const { return tick_.scene.parts()[near.part]; }
  PairState& state_of(const NearPair& near) { return all_.pairs[near.pair]; }
  CastMesh mesh_of(const NearPair& near) {
    const ScenePart& part = part_of(near);
    return {*part.mesh, *part.trees, part.inside, all_.full_scans};
  }

  /// The segments' tool; null: the stylus itself.
  const Tool* carried() const { return carried_; }
  void place(const ToolPose& pose, PlacedTool& out) const {
    rendering::place(carried_, tick_.sides, pose, out);
  }
  PlacedSegment placed(const ToolPose& pose, std::uint32_t segment) const {
    return place_segment(carried_, tick_.sides, pose, segment);
  }
  /// The virtual tool.
  const PlacedTool& now() const { return all_.now; }

  /// Collects the pairs that the tool can touch while it comes from `from` and then stays within
  /// `reach` of the virtual tool.
  /// \param motion  m, of any point of the tool from there to the virtual tool
  void collect(const ToolPose& from, const PlacedTool& placed_from, double motion, double reach);

  /// Places the pairs' segments for this orientation of the tool.
  /// \param oriented kept by reference
  void orient(const PlacedTool& oriented);
  const PlacedTool& oriented() const { return *oriented_; }

  /// Mesh frame, m; the segment's tip where the tool, oriented, is moved by y.
  Vec3 local(const NearPair& near, const Vec3& y) const {
    return near.tip + part_of(near).shrink * part_of(near).local_vector(y);
  }

  /// The segment in the part's frame, scaled down by the part's margin.
  LineProbe shrunk(const NearPair& near, const Vec3& tip, const PlacedSegment& segment) const;

  /// Where a segment whose ends move linearly first enters the part. If it does not enter,
  /// remembers the plane that separates them.
  Entry sweep(NearPair& near, const LineProbe& before, const LineProbe& after);

  /// Whether a plane that touches the part's bounding sphere separates the two at both poses, and
  /// so all the way between. If so, remembers it. Much cheaper than a cast.
  bool part_by_sphere(NearPair& near, const PosedSegment& from, const PosedSegment& to);
  /// The pair's segment at a pose of the tool.
  static PosedSegment posed(const NearPair& near, const Vec3& tip, const PlacedTool& tool) {
    const PlacedSegment& segment = tool.segments[near.segment];
    return {tip + segment.from, segment.along};
  }
  /// The same for the oriented tool, moved by y.
  PosedSegment posed(const NearPair& near, const Vec3& y) const {
    return posed(near, tick_.tool.tip + y, *oriented_);
  }

  /// Whether the virtual tool is inside of a part.
  bool virtual_inside();

 private:
  template <class Visit>
  void visit_near_parts(const Visit& visit) const;

  UnionTick& tick_;
  UnionMemory& all_;
  const PartGroup& group_;
  const Tool* carried_;
  const PlacedTool* oriented_ = nullptr;
};

}  // namespace palpate::rendering
