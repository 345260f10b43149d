#pragma once
// A simulated stylus: held at both ends by simulated devices and at the grip by a simulated hand.

#include <cstdint>

#include "runner/servo/device.h"

namespace palpate::runner::devices {

/// Each end of the stylus is held by one device.
struct SimulatedDeviceSettings {
  double end_mass = 0.075;         ///< kg, apparent, at each end
  double damping = 0.5;            ///< N s/m, viscous, of both together
  double friction = 0.05;          ///< N, Coulomb, of both together
  double resolution = 3e-5;        ///< m, of each end's position
  double max_force = 8.5;          ///< N, of each device
  double max_stiffness = 3500;     ///< N/m
  double workspace_radius = 0.25;  ///< m; the grip stops there
};

/// The hand as a mechanical impedance about a target pose; it does not know the object.
struct HandImpedance {
  double stiffness = 400;       ///< N/m
  double damping = 10;          ///< N s/m
  double mass = 0.1;            ///< kg, moving with the stylus
  double turn_stiffness = 1;    ///< N m/rad
  double turn_damping = 0.035;  ///< N m s/rad
};

/// Target pose of the hand.
struct HandTarget {
  Vec3 grip;           ///< m
  Vec3 velocity;       ///< m/s, of grip
  Vec3 axis{0, 0, 1};  ///< unit, tip to tail
};

/// m x'' = -k x - b x' integrated exactly over one tick (matrix exponential), so that the
/// simulation is stable for any stiffness.
class SpringDamper {
 public:
  SpringDamper(double mass, double damping, double stiffness, double tick);
  void advance(Vec3& position, Vec3& velocity) const {
    const Vec3 x = position;
    position = xx_ * x + xv_ * velocity;
    velocity = vx_ * x + vv_ * velocity;
  }

 private:
  double xx_, xv_, vx_, vv_;
};

/// Five degrees of freedom, sensed and actuated. Deterministic. read() advances time by one tick.
class SimulatedStylus final : public servo::Device {
 public:
  /// \param length, grip  m; grip measured from the tip, taken as the centre of mass
  SimulatedStylus(const SimulatedDeviceSettings& device, const HandImpedance& hand, double length,
                  double grip, double tick);

  /// Puts it at rest at the target, without force.
  void reset(const HandTarget& target);
  void set_target(const HandTarget& target);
  /// True position of the grip, m, not quantised.
  const Vec3& grip() const { return position_; }

  const servo::DeviceCapabilities& capabilities() const override { return capabilities_; }
  servo::DeviceReading read() noexcept override;
  void write(const Vec3& device1, const Vec3& device2) noexcept override;

 private:
  void find_away() noexcept;

  SimulatedDeviceSettings settings_;
  HandImpedance hand_;
  double length_, grip_;
  double mass_, friction_step_;
  SpringDamper shift_, turn_;
  servo::DeviceCapabilities capabilities_;
  HandTarget target_;
  Vec3 position_, velocity_;   ///< m, m/s, of the grip
  Vec3 axis_{0, 0, 1}, spin_;  ///< unit tip to tail; rad/s
  Vec3 away_;                  ///< rad; rotation from the target's axis to axis_
  bool away_is_known_ = true, target_turns_ = false;
  Vec3 force_, torque_;  ///< N; N m about the grip, held over the tick
};

struct StrokeSettings {
  double distance = 0.1;  ///< m, from the centre of the workspace, at rest
  double rest = 1.0;      ///< s, between strokes, so that a trial can begin
  double stroke = 1.5;    ///< s, forth and back
};

/// The device of `run --device simulated`: its hand rests outside the workspace, strokes through it
/// and back, and repeats this without feedback.
class StrokingStylus final : public servo::Device {
 public:
  /// \param rate  Hz, of the servo
  StrokingStylus(double length, double grip, double rate, const StrokeSettings& settings = {});

  const servo::DeviceCapabilities& capabilities() const override { return stylus_.capabilities(); }
  servo::DeviceReading read() noexcept override;
  void write(const Vec3& device1, const Vec3& device2) noexcept override {
    stylus_.write(device1, device2);
  }

 private:
  HandTarget target_at(double time) const;  ///< \param time  s, since a rest began

  StrokeSettings settings_;
  double grip_, tick_;
  double time_ = 0;
  SimulatedStylus stylus_;
};

}  // namespace palpate::runner::devices
