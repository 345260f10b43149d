#pragma once
// One ideal tool in one tick: it turns, translates and reports where it touches. Internal to
// the contact law of unions (union_contact.h). World frame, SI units.

#include <cstddef>
#include <cstdint>

#include "rendering/near_pairs.h"
#include "rendering/union_contact.h"
#include "rendering/union_state.h"

namespace palpate::rendering {

/// Faces abut if they are closer to each other than this many skins.
inline constexpr double kAbutting = 4;

/// The ideal tool of one group, in one tick. Translations are relative to the virtual tool's tip.
class IdealTool {
 public:
  IdealTool(UnionTick& tick, std::uint32_t group_index)
      : tick_(tick),
        all_(tick.state.unions),
        index_(group_index),
        group_(tick.scene.groups()[group_index]),
        memory_(all_.groups[group_index]),
        pairs_(tick, group_),
        carried_(pairs_.carried()) {}

  void follow();

 private:
  /// m, from the tip to a point fixed to the tool; `grasp` as in GroupState.
  Vec3 turned(const Vec3& grasp, const ToolPose& pose) const {
    return carried_ != nullptr ? pose.frame * grasp : grasp.z * pose.d;
  }
  Plane plane_of(std::uint32_t near, ContactFeature feature) const;

  // union_contact.cpp
  ToolPose first_contact(const ToolPose& from, bool& entered);

  // Turning.
  double turn(const ToolPose& from, double most);
  bool settle(const ToolPose& from, const PlacedTool& placed_from, const ToolPose& to,
              double most_push);
  bool push_out(const Vec3& from, double most_push);
  bool put_plane(std::uint32_t near, ContactFeature feature);

  // Translating.
  void resume_planes();
  void translate();
  bool find_goal(Vec3& goal);
  bool next_hit(const Vec3& goal, std::uint32_t& near, PairCast& first);
  void move_to_hit(const Vec3& goal, std::uint32_t near, const PairCast& hit);
  bool find_exact_place();
  bool in_the_way_at_rest(Plane& plane);
  void take_plane(const Plane& plane);
  void let_go_of_idle_planes();
  bool let_go_of_slid_planes(bool at_rest);
  bool slid_off(const Plane& plane) const;
  bool slide_on(Plane& plane);
  bool slid_off_at_rest(const Plane& plane, double slack) const;
  bool past_a_facet_at_rest() const;
  bool parted_here(const NearPair& near) const;

  // Contacts.
  void add_contacts();
  void add_contact(const Plane& plane, const Vec3& shift);
  void spread_over_parts(const NearPair& carrying, const WalkResult& hit, const Vec3& tip,
                         LoadedContact& c);
  void remember(std::size_t first_contact);
  void remember_planes();
  void remember_grasp(std::size_t first_contact);

  UnionTick& tick_;
  UnionMemory& all_;
  std::uint32_t index_;
  const PartGroup& group_;
  GroupState& memory_;
  NearPairs pairs_;
  const Tool* carried_;
  ToolPose pose_;  ///< its orientation; the tip is the virtual one plus at_
  Vec3 at_;        ///< m, from the virtual tip to the ideal one, a skin off its contacts
  Vec3 exact_;     ///< m, the same without the skin, once it rests
  Planes planes_;
  bool stuck_ = false;
  bool in_crack_ = false;  ///< opposite planes leave the tool less than a skin
};

}  // namespace palpate::rendering
