#pragma once
// What stands in the world, compiled once per trial into the least work that shows it.

#include <algorithm>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>
#include <vector>

#include "rendering/facet_walk.h"
#include "rendering/first_contact.h"
#include "rendering/force.h"
#include "rendering/probe.h"
#include "rendering/separation.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/object_spec.h"

namespace palpate::rendering {

/// One convex part to be placed in a scene.
struct SceneObject {
  std::shared_ptr<const stimuli::ConvexMesh> mesh;
  Pose pose;
  stimuli::Material material;
  int object =
      0;  ///< index of the object in the scene; the parts of a compound share it, side by side
  std::shared_ptr<const ContactTrees> trees;  ///< built by the scene when empty
};

/// One convex part as the tick sees it. World frame unless said otherwise.
struct ScenePart {
  std::shared_ptr<const stimuli::ConvexMesh> mesh;
  std::shared_ptr<const ContactTrees> trees;
  Mat3 to_world;             ///< rotation from the mesh frame
  Vec3 position;             ///< m, of the mesh frame's origin
  Vec3 sphere_centre;        ///< m
  double sphere_radius = 0;  ///< m
  double tolerance = 0;      ///< m; below it a length is rounding, for this size and distance
  stimuli::Material material;
  int object = 0;

  // Inlined: a tick turns three to five vectors, at ten instructions each.
  [[gnu::always_inline]] Vec3 local_point(const Vec3& world) const {
    return local_vector(world - position);
  }
  [[gnu::always_inline]] Vec3 local_vector(const Vec3& world) const {
    return {glm::dot(to_world[0], world), glm::dot(to_world[1], world),
            glm::dot(to_world[2], world)};
  }
  [[gnu::always_inline]] Vec3 world_vector(const Vec3& local) const {
    return to_world[0] * local.x + to_world[1] * local.y + to_world[2] * local.z;
  }
};

/// What a tick over a scene must do beyond one convex part that is a plain spring. A tick is
/// compiled for each combination, so that what is not needed costs nothing.
struct Needs {
  bool several_parts = false;  ///< a survey of what is in reach, a list of contacts, sums over it
  bool damping = false;        ///< of some material
  bool friction = false;
  bool layers = false;

  static constexpr std::size_t kCount = 16;  ///< combinations
  static constexpr Needs of(std::size_t index) {
    return {(index & 1) != 0, (index & 2) != 0, (index & 4) != 0, (index & 8) != 0};
  }
  constexpr std::size_t index() const {
    return std::size_t{several_parts} | std::size_t{damping} << 1 | std::size_t{friction} << 2 |
           std::size_t{layers} << 3;
  }
  constexpr bool plain_springs() const { return !damping && !friction && !layers; }
};

/// What is remembered of one part from tick to tick.
struct PartState {
  MinkowskiFacet facet;       ///< kind none: not in contact
  SeparatingPlane plane;      ///< mesh frame; where valid, the last pose was beyond it
  MinkowskiFacet watch;       ///< not in contact: of a plane that lately separated, if any
  std::uint32_t support = 0;  ///< vertex that the last search for a plane ended on
  bool blocked = false;       ///< the trial began inside: no force until it has been left once
  Vec3 share;    ///< m; its part of the ideal probe's translation, where parts share one
  Vec3 yielded;  ///< m; the translation that its siblings' shares gave it at the last tick
  Grip grip;     ///< where the material has friction
};

/// A renderer's whole memory. Copy it to replay from here.
struct RenderState {
  std::vector<PartState> parts;
  std::vector<std::uint32_t> near_parts;  ///< in order; the others are out of reach for now
  LineProbe surveyed;                     ///< where the probe was when near_parts was drawn up
  double clearance = 0;  ///< m; that far from `surveyed` the other parts are out of reach
  LineProbe last;        ///< last good pose
  bool has_last = false;
  std::vector<LoadedContact> contacts;  ///< of the last tick; with room for all
};

/// Immutable; shared by the servo and the display.
class Scene {
 public:
  /// \param side_contact  false leaves out what only a segment needs (the tree of edges)
  explicit Scene(std::vector<SceneObject> objects, bool side_contact = true);

  const std::vector<ScenePart>& parts() const { return parts_; }
  /// Chooses the tick that both renderers run.
  Needs needs() const { return Needs::of(needs_index_); }
  std::size_t needs_index() const { return needs_index_; }
  RenderState initial_state() const;

 private:
  std::vector<ScenePart> parts_;
  std::size_t needs_index_ = 0;
};

/// Whether the probe can touch the part soon, or may have passed it on the way here.
/// \param gap   m, between the probe and the part's bounding sphere
/// \param step  m, how far the probe came in this tick
inline bool in_reach(const ScenePart& part, double gap, double step) {
  // A quarter of the radius of room to move before the list must be drawn up again.
  return gap - step <= 0.25 * part.sphere_radius;
}

/// Lists the parts that the probe can reach soon. No allocation.
void list_near_parts(const Scene& scene, RenderState& state, const LineProbe& probe);

/// The same, unless the last list still holds.
inline void survey(const Scene& scene, RenderState& state, const LineProbe& probe) {
  if (state.clearance == std::numeric_limits<double>::infinity()) return;  // all are near, for good
  const Vec3 tip_way = probe.tip - state.surveyed.tip, tail_way = probe.tail - state.surveyed.tail;
  const double moved2 = std::max(glm::dot(tip_way, tip_way), glm::dot(tail_way, tail_way));
  if (moved2 >= state.clearance * state.clearance) list_near_parts(scene, state, probe);
}

}  // namespace palpate::rendering
