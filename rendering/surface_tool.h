#pragma once
// One ideal tool on one closed surface in one tick: it turns, translates and reports
// where it touches (surface_contact.cpp). Internal to the law of surfaces (surface_contact.h).
// Local frame of the surface, SI units; poses are in the world.

#include <cstddef>
#include <cstdint>
#include <optional>

#include "rendering/active_planes.h"
#include "rendering/surface_contact.h"
#include "rendering/surface_state.h"
#include "rendering/union_state.h"

namespace palpate::rendering {

/// A plane that holds the tool. Translations are relative to the virtual tool.
struct SurfacePlane {
  SurfacePatch patch;
  Vec3 normal;            ///< out of the solid
  double depth = 0;       ///< m, of the virtual tool below it: dot(normal, y) >= depth outside
  double multiplier = 0;  ///< m, of the normal in the way from the virtual to the ideal tool
  bool stays = false;     ///< a release and hit in place is rounding: keep the patch
  bool step = false;      ///< the side of a step of rounding, for this tick alone
};

class SurfaceTool {
 public:
  SurfaceTool(UnionTick& tick, std::uint32_t index)
      : tick_(tick),
        all_(tick.state.unions),
        placed_(tick.scene.surfaces()[index]),
        surface_(*placed_.surface),
        own_(all_.surfaces[index]),
        memory_(all_.groups[placed_.group]),
        group_(placed_.group),
        carried_(tick.sides ? tick.scene.tool() : nullptr),
        skin_(placed_.skin),
        tolerance_(placed_.tolerance),
        target_(tick.tool) {}

  void follow();
  bool virtual_inside();

 private:
  static constexpr double kExact = 1e-5;  // of the skin; shorter distances are rounding

  // surface_contact.cpp
  PosedTool pose(const ToolPose& at) const;
  Vec3 turned(const Vec3& grasp, const ToolPose& at) const {
    return carried_ != nullptr ? at.frame * grasp : grasp.z * at.d;
  }
  double tool_size() const;
  bool far_away();
  bool is_clear(const stimuli::SegmentMotion& motion) const;
  void step(const ToolPose& target, const ToolPose& from);
  void meet(const ToolPose& target, const ToolPose& from);
  void rest();
  void carry();
  /// Whether the tool has found its place, and room to stay there.
  bool is_at_ease() const { return !stuck_ && !in_crack_ && planes_.leave_room(); }
  SurfacePlane plane_at(const SurfacePatch& patch) const;

  // Turning.
  double turn(const ToolPose& from, double most);
  bool approach(const ToolPose& from);
  bool settle(const PosedTool& from, double most_push);
  void lower_planes();
  PatchHit sweep(const PosedTool& from, const PosedTool& to, const Vec3& shift,
                 double border = 0) const;

  // Translating.
  double room_on_triangles(double aside) const;
  void list_about(const Vec3& at, const Vec3& way, double aside);
  bool fill_list(std::size_t most);
  void list_triangle(std::uint32_t index, std::uint8_t what, std::uint8_t segment);
  bool same_turn() const;
  double off_way2(const Vec3& at) const;
  bool in_room(const Vec3& at, double share = 1) const;
  void find_list();
  Vec3 from_list() const { return turned_.segments[0].start - own_.listed.segments[0].start; }
  double border() const;
  PatchHit cast(const Vec3& from, const Vec3& to);
  double cast_on_list(const Vec3& from, const Vec3& to, double done, PatchHit& first) const;
  void resume_planes();
  void translate();
  void find_rest();
  bool find_goal(Vec3& goal);
  void move_to_hit(const Vec3& goal, const PatchHit& hit);
  bool find_exact_place();
  bool rests();
  bool in_valley() const;
  bool is_step(const PatchPlane& plane, double under) const;
  bool in_the_way_at_rest(SurfacePlane& plane);
  void leave_steps();
  void take_plane(const SurfacePlane& plane);
  void release_idle_planes();
  bool release_slid_planes(const Vec3& at, double slack);
  double off_patch(const SurfacePlane& plane, const Vec3& at) const;
  bool past_a_patch_at_rest() const;
  bool parted_here(const SurfacePatch& patch) const;
  bool holds(const SurfacePatch& patch) const;

  // surface_contact.cpp
  void add_contacts();
  SurfacePatch flattest(const SurfacePatch& patch) const;
  void add_contact(const SurfacePlane& plane, const Vec3& shift);
  void remember(std::size_t first_contact);

  UnionTick& tick_;
  UnionMemory& all_;
  const PlacedSurface& placed_;
  const stimuli::Surface& surface_;
  SurfaceState& own_;
  GroupState& memory_;
  std::uint32_t group_;
  const Tool* carried_;
  double skin_, tolerance_;

  ToolPose target_;   ///< the virtual tool; at a first contact an earlier pose
  ToolPose pose_;     ///< the ideal tool's orientation; its tip is the virtual one plus at_
  PosedTool turned_;  ///< of that orientation, with the virtual tip
  Vec3 at_;           ///< from the virtual to the ideal tool, one skin off its contacts
  Vec3 exact_;        ///< the same without the skin, at rest
  PlanesOf<SurfacePlane> planes_;
  /// The side of a step of rounding that it is deepest in at exact_.
  std::optional<SurfacePlane> step_;
  struct Parted {
    SurfacePatch patch;
    Vec3 at;
    int times = 0;
  };
  std::array<Parted, 8> parted_;  ///< the last patches that released the tool in this tick
  std::size_t parted_count_ = 0;
  bool fresh_ = false;    ///< the list was made in this step
  bool in_list_ = false;  ///< the list is for the tool's orientation
  Vec3 moved_;            ///< m; then: from the listed tool to the turned one
  double per_way2_ = 0;   ///< 1/m^2; then: of the listed way's squared length
  bool stuck_ = false;
  bool in_crack_ = false;  ///< opposite planes are less than a skin apart
};

}  // namespace palpate::rendering
