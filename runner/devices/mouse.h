#pragma once
// A stylus for anyone without hardware: pointer, wheel and modifiers move and turn it in the
// console's view, and contact is seen, not felt. Five degrees of freedom.

#include "runner/servo/device.h"
#include "runner/servo/triple_buffer.h"

namespace palpate::runner {

/// Where the pointer wants the stylus. Belongs to the thread of the window. Frame: the view's, x to
/// the right, y up, z towards the viewer.
struct MouseHand {
  Vec3 tip;           ///< m
  double length = 0;  ///< m
  double yaw = 0;     ///< rad, about y: of the axis from tip to tail
  double pitch = 0;   ///< rad, up

  /// \param across, up, towards  m
  void move(double across, double up, double towards);
  /// \param right, up  rad, of the tail about the tip
  void turn(double right, double up);
  Vec3 axis() const;  ///< unit, tip to tail
  rendering::LineProbe stylus() const { return {tip, tip + length * axis()}; }
};

/// The device. aim() by the window's thread, the rest by the servo's; neither waits for the other.
class MouseStylus final : public Device {
 public:
  /// \param length  m, of the stylus; \param rate  Hz, of the servo
  MouseStylus(double length, double rate);

  /// Where the stylus starts: above and before the workspace, outside of any home zone's radius.
  MouseHand resting_hand() const;
  void aim(const rendering::LineProbe& target) noexcept { target_.write(target); }

  const DeviceCapabilities& capabilities() const override { return capabilities_; }
  DeviceReading read() noexcept override;
  void write(const Vec3&, const Vec3&) noexcept override {}  // nothing to push with

 private:
  double length_, follow_, longest_step_;
  DeviceCapabilities capabilities_;
  TripleBuffer<rendering::LineProbe> target_;
  rendering::LineProbe wanted_, now_;
};

}  // namespace palpate::runner
