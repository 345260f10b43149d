#pragma once
// Which bodies of a world touch or soon will touch, and when the next pair meets. Nothing here
// allocates.

#include <cstdint>
#include <span>

#include "rendering/bodies/body_world.h"

namespace palpate::rendering {

/// m/s, of the contact's bodies by the velocities of the state.
double separation_speed(const BodyWorldState& state, const BodyContact& contact);
/// m/s; slower approaches do not bounce. \param step  s
double resting_speed(const BodyWorld& world, double step);

class BodyMeetings {
 public:
  /// m; closer parts touch. Above rounding, below perception.
  static constexpr double kTouching = 1e-8;
  /// m; parts that meet are at most this far apart, so that they still touch when measured again
  /// with other rounding.
  static constexpr double kMet = 0.75 * kTouching;

  BodyMeetings(const BodyWorld& world, BodyWorldState& state) : world_(world), state_(state) {}

  /// Sets state.near, near_parts and contacts: parts that touch or may meet.
  /// \param within  s, the time in which they may meet
  /// \param extra   m, added to their reach
  /// \param chosen  bodies; empty: all
  void find(double within, double extra = 0, std::span<const char> chosen = {});
  /// The same without contacts, and with one near pair of parts for each pair of bodies.
  void find_near(double within, double extra);

  /// Whether anything is near an awake body, as by find_near. Wakes nothing.
  bool may_touch(std::uint32_t body, double within, double extra);

  /// s, until the next pair meets, at most `most`. Sets NearParts::apart.
  /// \pre find(), and the velocities of the state are the present ones
  double time_to_next(double most);

 private:
  Pose pose_of(std::uint32_t body) const;
  Pose pose_of_other(const BodyPair& pair) const;
  const CollidingPart& part_b(const BodyPair& pair, std::uint32_t part) const;
  const stimuli::CollisionSurface& surface_b(const BodyPair& pair) const;
  void begin_search();
  void look_for(double within, double extra, std::span<const char> chosen, bool places);
  void look_at_pair(std::uint32_t index, double within, double extra, bool places);
  void find_in_pair(std::uint32_t index, double within, double extra, bool places);
  bool wake_near();
  void place_parts(std::uint32_t body);
  double moved_since(const BodyPair& pair, const PairPlaces& measured) const;
  void measure_parts(std::uint32_t index, std::uint32_t parts_index, double reach, bool places);
  void measure_surfaces(std::uint32_t index, double reach, double turn, bool places);
  void add_contact(std::uint32_t index, const Vec3& place, const Vec3& normal, double gap);
  double turning_of(const BodyPair& pair) const;
  Gap gap_after(const BodyWorldState::NearParts& near, double time, double enough,
                GapMemory& memory, Vec3& closing) const;
  double meeting_time(const BodyWorldState::NearParts& near, double most);
  double meeting_again(BodyWorldState::NearParts& near, double most);
  struct TimeAndGap {
    double time = 0, gap = 0;
  };
  double meeting_between(const BodyWorldState::NearParts& near, TimeAndGap low, TimeAndGap high,
                         GapMemory& memory) const;

  const BodyWorld& world_;
  BodyWorldState& state_;
};

}  // namespace palpate::rendering
