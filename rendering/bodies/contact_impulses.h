#pragma once
// The impulses in the contacts that BodyMeetings has found: bodies bounce, or are held apart, by
// linear complementarity problems. Nothing here allocates.

#include <cstddef>
#include <cstdint>
#include <span>

#include "rendering/bodies/body_world.h"

namespace palpate::rendering {

class ContactImpulses {
 public:
  ContactImpulses(const BodyWorld& world, BodyWorldState& state) : world_(world), state_(state) {}

  /// Makes bodies that touch and approach each other bounce, with the restitution of the pair. Sets
  /// the velocities of the state.
  /// \param left  s, of the step
  /// \param step  s, the whole step, for kAtOnce
  /// \return whether any bounced
  bool bounce(double left, double step);

  /// Computes impulses that keep every contact from closing by more than its gap within a step.
  /// Groups of bodies without a meeting by BodyMeetings::time_to_next move freely. Sets state.push,
  /// twist and pushed.
  /// \param springs  springs that press
  void hold_apart(double step, std::span<PressingSpring> springs);

  /// Adds those impulses to one body.
  void add_impulses(std::size_t body);

 private:
  using Row = BodyWorldState::Row;
  /// Share of a step; contacts this soon after a first one, as at the far end of an edge that lies
  /// almost flat, bounce together with it.
  static constexpr double kAtOnce = 4e-3;

  void set_velocities(double step);
  void find_islands();
  void begin_rows();
  void add_row(std::uint32_t a, std::uint32_t b, const Vec3& place, const Vec3& direction,
               double least_speed, double bound, int leader, int spring);
  void add_friction(const BodyContact& contact, int leader, double friction);
  void solve_rows(std::span<PressingSpring> springs, double step);
  bool makes_energy() const;
  void solve_bounce();
  void apply_rows(std::span<PressingSpring> springs);

  const BodyWorld& world_;
  BodyWorldState& state_;
};

}  // namespace palpate::rendering
