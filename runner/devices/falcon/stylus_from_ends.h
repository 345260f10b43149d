#pragma once
// The pose of a stylus whose ends are held by two devices, and the rigid transformation between the
// devices' frames.

#include <span>
#include <stdexcept>

#include "rendering/probe.h"
#include "runner/devices/falcon/calibration.h"
#include "runner/servo/device.h"
#include "stimuli/vec.h"

namespace palpate::runner::devices {

/// One point in the frames of both devices, m.
struct PairedPoint {
  Vec3 tip_frame, tail_frame;
};

struct RigidFit {
  Pose tail_in_tip;     ///< tip_frame = orientation * tail_frame + position
  double residual = 0;  ///< m, root mean square
  double worst = 0;     ///< m
};

/// The points do not determine a transformation; what() gives the reason.
class RegistrationError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The rigid transformation with least squared error, in closed form: Horn 1987, with the rotation
/// from the singular value decomposition of the covariance (Arun, Huang & Blostein 1987) and its
/// sign as Umeyama 1991. At least 4 points, spread by 10 mm or more in at least two directions.
/// \throws RegistrationError.
RigidFit fit_rigid(std::span<const PairedPoint> points);

/// The segment between the ends; checks that its length equals that of the stylus.
class StylusFromEnds {
 public:
  /// \param length     m, between the centres of the grips
  /// \param tolerance  m; larger than both devices' errors and the motion in a tick
  StylusFromEnds(const Pose& tail_in_tip, double length, double tolerance = 0.004)
      : tail_in_tip_(tail_in_tip), length_(length), tolerance_(tolerance) {}

  /// \param tip, tail  m, each in its own device's frame.
  /// \return false: the distance of the ends has been wrong for kMaxWrong ticks in a row. A grip
  /// has come off, a joint has slipped, or a device has lost its reference.
  bool update(const Vec3& tip, const Vec3& tail) noexcept;
  /// The last stylus of the right length, in the tip device's frame.
  const rendering::LineProbe& stylus() const { return stylus_; }
  double length() const { return length_; }
  double stretch() const {
    return stretch_;
  }  ///< m, measured minus nominal length, of the last update
  /// Rotates a force on the tail from the tip device's frame into the tail device's.
  Vec3 to_tail_frame(const Vec3& force) const;

  static constexpr int kMaxWrong = 5;

 private:
  Pose tail_in_tip_;
  double length_, tolerance_;
  rendering::LineProbe stylus_;
  double stretch_ = 0;
  int wrong_ = kMaxWrong;  // no valid reading yet
};

}  // namespace palpate::runner::devices

namespace palpate::runner::devices::falcon {

/// Of the relative pose of two Falcons that hold a stylus, from points that both have visited.
struct RegistrationSettings {
  double stylus_length = 0.12;  ///< m, between the centres of the grips on the stylus
  /// Vector from the tip's grip to the tail's while points are taken, m, tip's frame: zero with the
  /// grips pinned together, else the stylus in its jig (its direction must not change).
  Vec3 offset;
  int points = 8;
  double still = 0.5;  ///< s of rest at each point
};

/// The whole guided procedure; zero force. \throws GuideError, RegistrationError.
/// \param tip, tail  one Falcon each
PairRegistration register_pair(servo::Device& tip, servo::Device& tail, servo::Clock& clock,
                               Guide& guide, const RegistrationSettings& settings);

}  // namespace palpate::runner::devices::falcon
