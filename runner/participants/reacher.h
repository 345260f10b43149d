#pragma once
// A simulated hand that moves from home to targets and learns to push against a field.

#include <cstdint>
#include <optional>

#include "data/base/random.h"
#include "data/record.h"
#include "protocols/protocol.h"
#include "protocols/schedule.h"
#include "runner/devices/simulated.h"
#include "runner/servo/sample.h"
#include "runner/workspace_map.h"

namespace palpate::runner::participants {

/// Unit vector at right angles to a movement: to its left seen from +z; of one along z towards +y.
/// \param along  unit
Vec3 side_of(const Vec3& along);

/// The hand's plan is a straight movement of least jerk (Flash & Hogan 1985). Its memory has a fast
/// and a slow state, x <- a x + b e (Smith, Ghazizadeh & Shadmehr 2006; constants as usually quoted
/// from there, not taken from the paper itself), here in N s/m: the sideways force in proportion to
/// speed that it expects. A model that is not fitted to any person.
struct ReacherSettings {
  double fast_retention = 0.59, fast_learning = 0.21;
  double slow_retention = 0.992, slow_learning = 0.02;
  double reaction = 0.25;     ///< s, from time zero to the movement
  double duration = 0.48;     ///< s, of the plan
  double duration_sd = 0.02;  ///< s
  double aim_sd = 0.001;      ///< m, of the plan's end, in each direction
};

/// The two states of memory, N s/m.
struct MotorMemory {
  double fast = 0, slow = 0;
  double expected() const { return fast + slow; }
  /// After a trial. \param error  N s/m, the field less what was expected; 0: only forgets
  void learn(double error, const ReacherSettings& settings);
};

class Reacher {
 public:
  /// \param hand  the device's hand. \param stylus, protocol  must outlive it
  Reacher(const ReacherSettings& settings, const devices::HandImpedance& hand,
          devices::SimulatedStylus& stylus, const protocols::Protocol& protocol, std::uint64_t seed,
          int number);

  /// Puts the hand at home.
  void begin(const protocols::Trial& trial);
  /// Moves the hand. It stays at the target.
  void step(const servo::Sample& sample);
  /// Learns from the deviation of a trial, from this run or an earlier one of the session. A clamp
  /// shows no error.
  void learn(const data::TrialRecord& record);
  const MotorMemory& memory() const { return memory_; }

 private:
  struct Planned {
    Vec3 place, velocity;  ///< m, m/s, of the tip
  };
  Planned planned(double time) const;
  devices::HandTarget target_at(double time) const;

  ReacherSettings settings_;
  devices::SimulatedStylus& stylus_;
  const protocols::Protocol& protocol_;
  std::uint64_t seed_;
  int number_;
  WorkspaceMap workspace_;
  double period_, grip_;
  double compliance_;  ///< m/N, of the tip: of the hand's place and of its turning about the grip
  MotorMemory memory_;
  Vec3 home_, aim_, side_;
  double duration_ = 0.5;  ///< s
};

}  // namespace palpate::runner::participants
