#pragma once
// A virtual stylus moved with the mouse, for trying sessions without hardware: five degrees of
// freedom sensed, none actuated, so contact is seen but not felt.

#include "runner/servo/device.h"
#include "runner/servo/triple_buffer.h"

namespace palpate::runner::devices {

/// Target pose of the stylus, set by pointer, wheel and modifiers. Belongs to the window's thread.
/// Device frame, which is the world's: x to the right, y away from the viewer, z up.
struct StylusTarget {
  Vec3 tip;           ///< m
  double length = 0;  ///< m
  double yaw = 0;     ///< rad, about z, of the axis from tip to tail; 0: in the plane of y and z
  double pitch = 0;   ///< rad, up

  /// \param by  m
  void move(const Vec3& by);
  /// \param right, up  rad, of the tail about the tip
  void turn(double right, double up);
  /// Sets the pose of that stylus, within the target's limits. m
  void point(const rendering::LineProbe& stylus);
  Vec3 axis() const;  ///< unit, tip to tail
  rendering::LineProbe stylus() const { return {tip, tip + length * axis()}; }
};

/// The device. set_target() is called by the window's thread, the rest by the servo's; neither
/// waits for the other.
class MouseStylus final : public servo::Device {
 public:
  /// \param length  m, of the stylus; \param rate  Hz, of the servo
  MouseStylus(double length, double rate);

  /// Start pose: above and in front of the workspace, outside of any home zone.
  StylusTarget initial_target() const;
  void set_target(const rendering::LineProbe& target) noexcept { target_.write(target); }

  const servo::DeviceCapabilities& capabilities() const override { return capabilities_; }
  servo::DeviceReading read() noexcept override;
  void write(const Vec3&, const Vec3&) noexcept override {}  // no motors

 private:
  double length_, follow_, longest_step_;
  servo::DeviceCapabilities capabilities_;
  servo::TripleBuffer<rendering::LineProbe> target_;
  rendering::LineProbe wanted_, now_;
};

}  // namespace palpate::runner::devices
