#pragma once
// The contacts of a step and the impulses in them. Internal to body_world.cpp.

#include <cstddef>
#include <span>

#include "rendering/bodies/body_world.h"

namespace palpate::rendering {

class BodyContacts {
 public:
  /// m; closer parts touch. Above rounding, below perception.
  static constexpr double kTouching = 1e-8;
  /// m; parts that meet are at most this far apart, so that they still touch when measured again
  /// with other rounding.
  static constexpr double kMet = 0.75 * kTouching;
  /// Share of a step; contacts this soon after a first one, as at the far end of an edge that lies
  /// almost flat, bounce together with it.
  static constexpr double kAtOnce = 4e-3;

  BodyContacts(const BodyWorld& world, BodyWorldState& state) : world_(world), state_(state) {}

  /// Sets state.near, near_parts and contacts: parts that touch or may meet.
  /// \param within  s, the time in which they may meet
  /// \param extra   m, added to their reach
  /// \param chosen  bodies; empty: all
  void find(double within, double extra = 0, std::span<const char> chosen = {});
  /// The same without contacts, and with one near pair of parts for each pair of bodies.
  void find_near(double within, double extra);

  /// Whether anything is near an awake body, as by find_near. Wakes nothing.
  bool may_touch(std::uint32_t body, double within, double extra);

  /// Makes bodies that touch and approach each other bounce, with the restitution of the pair.
  /// \param left  s, of the step
  /// \param step  s, the whole step, for kAtOnce
  /// \return whether any bounced
  bool bounce(double left, double step);

  /// s, until the next pair meets, at most `most`. Sets NearParts::apart: not meeting until then.
  /// Parts that rest on each other are not apart.
  double time_to_next(double most);

  /// Computes impulses that keep every contact from closing by more than its gap within a step.
  /// Groups of bodies without a meeting by time_to_next move freely. Sets state.push, twist and
  /// pushed.
  /// \param springs  springs that press
  /// \param chosen   bodies; empty: all
  void hold_apart(double step, std::span<PressingSpring> springs, std::span<const char> chosen);

  /// Adds those impulses to one body.
  void add_impulses(std::size_t body);

 private:
  using Row = BodyWorldState::Row;

  Pose pose_of(std::uint32_t body) const;
  Pose pose_of_other(const BodyPair& pair) const;
  const CollidingPart& part_b(const BodyPair& pair, std::uint32_t part) const;
  void place_parts(std::uint32_t body);
  void find_in_pair(std::uint32_t index, double within, double extra, bool places);
  void measure_parts(std::uint32_t index, std::uint32_t parts_index, double reach, bool places);
  double moved_since(const BodyPair& pair, const PairPlaces& measured) const;
  void begin_search();
  void look_at_pair(std::uint32_t index, double within, double extra, bool places);
  void look_for(double within, double extra, std::span<const char> chosen, bool places);
  bool wake_near();
  Gap gap_after(const BodyWorldState::NearParts& near, double time, double enough,
                GapMemory& memory, Vec3& closing) const;
  double meeting_time(const BodyWorldState::NearParts& parts, double most);
  double meeting_again(BodyWorldState::NearParts& parts, double most);
  struct TimeAndGap {
    double time = 0, gap = 0;
  };
  double meeting_between(const BodyWorldState::NearParts& parts, TimeAndGap low, TimeAndGap high,
                         GapMemory& memory) const;
  void set_velocities(double step);
  void find_islands();
  double resting_speed(double step) const;
  double separation_speed(const BodyContact& contact) const;
  void add_row(std::uint32_t a, std::uint32_t b, const Vec3& place, const Vec3& direction,
               double least_speed, double bound, int leader, int spring);
  void add_friction(const BodyContact& contact, int leader, double friction);
  void begin_rows();
  void solve_rows(std::span<PressingSpring> springs, double step);
  bool makes_energy() const;
  void solve_bounce();
  void apply_rows(std::span<PressingSpring> springs);

  const BodyWorld& world_;
  BodyWorldState& state_;
};

}  // namespace palpate::rendering
