#pragma once
// A stylus whose ends two devices hold: its pose from both, and where the devices stand to each
// other. Pure functions and a little state.

#include <span>
#include <stdexcept>

#include "rendering/probe.h"
#include "stimuli/vec.h"

namespace palpate::runner {

/// The same place seen by two devices, each in its own frame, m.
struct PairedPoint {
  Vec3 tip_frame, tail_frame;
};

struct RigidFit {
  Pose tail_in_tip;     ///< tip_frame = orientation * tail_frame + position
  double residual = 0;  ///< m, root mean square
  double worst = 0;     ///< m
};

/// The points do not fix a placement; what() says why.
class RegistrationError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The placement with least squares, in closed form: Horn 1987, with the rotation from the singular
/// value decomposition of the covariance (Arun, Huang & Blostein 1987) and its sign as Umeyama
/// 1991. At least 4 points, spread by 10 mm or more in at least two directions. \throws
/// RegistrationError.
RigidFit fit_rigid(std::span<const PairedPoint> points);

/// The segment between the ends; watches that it stays as long as the stylus is.
class StylusFromEnds {
 public:
  /// \param length     m, between the centres of the grips
  /// \param tolerance  m; both devices' errors and one tick's motion are below it
  StylusFromEnds(const Pose& tail_in_tip, double length, double tolerance = 0.004)
      : tail_in_tip_(tail_in_tip), length_(length), tolerance_(tolerance) {}

  /// \param tip, tail  m, each in its own device's frame. False when the ends have been farther
  ///                   apart or nearer than the stylus allows for kMaxWrong ticks in a row: a hand
  ///                   has let go, a joint has slipped, or a device has lost its place.
  bool update(const Vec3& tip, const Vec3& tail) noexcept;
  /// The last one whose length was right, in the tip device's frame.
  const rendering::LineProbe& stylus() const { return stylus_; }
  double length() const { return length_; }
  double stretch() const { return stretch_; }  ///< m, of the last update; longer: positive
  /// A force on the tail, in the tip's frame, as the tail's device must show it.
  Vec3 to_tail_frame(const Vec3& force) const;

  static constexpr int kMaxWrong = 5;

 private:
  Pose tail_in_tip_;
  double length_, tolerance_;
  rendering::LineProbe stylus_;
  double stretch_ = 0;
  int wrong_ = kMaxWrong;  // nothing right has been seen yet
};

}  // namespace palpate::runner
