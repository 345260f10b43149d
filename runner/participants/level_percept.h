#pragma once
// What a hand tells of a level while it explores: one estimate for each interval.
//
//   stiffness   mean of force over depth, of ticks in contact, as the hand met them. Likewise where
//               identification is of things that differ in stiffness alone
//   a length    ("..._m") that the felt surface depends on: who knows what kind of object it is
//               takes the level whose surface passes through the places felt, least squares,
//               linear about the true level. The places have the noise of the model's percepts
//   any other   (friction, damping, depth of layers, angles, meshes): no estimate

#include <optional>

#include "protocols/protocol.h"
#include "protocols/schedule.h"
#include "runner/participants/shape_observer.h"
#include "runner/servo/sample.h"

namespace palpate::runner {

class LevelPercept {
 public:
  /// \param protocol  must outlive it
  explicit LevelPercept(const protocols::Protocol& protocol) : protocol_(protocol) {}

  /// Before an interval. \param trial  of version 2
  void begin(const protocols::Trial& trial, const protocols::Interval& interval);
  void add(const Sample& sample);
  void add(const Percept& percept);
  int contact_ticks() const { return contact_ticks_; }

  /// As the hand met it: the participant's noise is to come.
  std::optional<double> stiffness() const;
  /// With the noise of the percepts.
  std::optional<double> length() const;

 private:
  void know_object(const protocols::TaskBlock& block, const protocols::Interval& interval);

  const protocols::Protocol& protocol_;
  Quat orientation_{1, 0, 0, 0};
  bool of_stiffness_ = false;
  double stiffness_sum_ = 0;  ///< N/m
  int contact_ticks_ = 0;
  std::optional<double> level_;  ///< m; none: no length
  double step_ = 0;              ///< m, from `object_` to `other_`
  stimuli::ObjectSpec object_, other_;
  double squares_ = 0, products_ = 0;  ///< of the normal equation
};

/// Whether the stimuli of a block are alike but for their stiffness.
bool differ_in_stiffness(const protocols::Protocol& protocol, const protocols::TaskBlock& block);

/// Whether two objects have the same form in the same place.
bool have_one_form(const stimuli::ObjectSpec& a, const stimuli::ObjectSpec& b);

}  // namespace palpate::runner
