#pragma once
// How a simulated hand explores: it comes from above, slides along with a wandering heading and a
// light indentation, lifts, comes again. It knows of contact only late, and nothing of shapes.

#include <cstdint>
#include <vector>

#include "runner/participants/simulated_settings.h"
#include "stimuli/random.h"

namespace palpate::runner {

/// What the hand feels at one moment.
struct Felt {
  bool contact = false;
  Vec3 normal;       ///< unit, of the force
  Vec3 surface;      ///< m; where the surface was felt
  double along = 0;  ///< m from the tip along the stylus to that place
};

class Explorer {
 public:
  /// \param grip  m from the tip; \param wall_stiffness  N/m, that a light force is judged by
  Explorer(const SimulatedSettings& settings, double grip, double wall_stiffness, double tick);

  /// Draws the first approach; the stylus at its start.
  HandTarget begin(stimuli::Random random);
  /// One tick. `stylus` and `now` are as felt at this tick; contact in `now` is acted on only after
  /// the reaction delay.
  HandTarget step(const Felt& now, const rendering::LineProbe& stylus);

 private:
  enum class Stage { approach, follow, search, retreat };

  void draw_approach();
  Vec3 velocity(const Felt& known);
  Vec3 slide(const Felt& known);
  Vec3 fly_to_start();
  void turn_axis();
  void yield_to_force(const rendering::LineProbe& stylus);

  SimulatedSettings settings_;
  double grip_, tick_;
  double sink_;        ///< m; how far below the felt surface the hand aims
  double max_offset_;  ///< m; how far the hand's aim may be from where the stylus is
  stimuli::Random random_{0};
  std::vector<Felt> past_;  ///< ring: what was felt during the reaction delay
  std::size_t now_ = 0;
  Stage stage_ = Stage::approach;
  Vec3 tip_, axis_{0, 0, 1};               ///< where the hand wants the stylus
  Vec3 start_, aim_, goal_axis_{0, 0, 1};  ///< of the approach
  Vec3 heading_;                           ///< unit
  double left_ = 0;                        ///< s, of this stage
};

}  // namespace palpate::runner
