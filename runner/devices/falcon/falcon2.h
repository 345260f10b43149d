#pragma once
// Two Falcons hold the ends of a stylus: the display of two Phantoms in Ho, Basdogan & Srinivasan
// (2000), section 2. Senses and drives five degrees of freedom. The frame is that of the tip's
// device; the rest of the program need not know that there are two.

#include <memory>
#include <string>

#include "runner/devices/falcon/arm.h"
#include "runner/devices/falcon/stylus_from_ends.h"
#include "runner/servo/device.h"

namespace palpate::runner::falcon {

class Falcon2Device final : public Device {
 public:
  Falcon2Device(std::unique_ptr<FalconArm> tip, std::unique_ptr<FalconArm> tail,
                const StylusFromEnds& stylus, const std::string& calibration = "");

  const DeviceCapabilities& capabilities() const override { return capabilities_; }
  /// Lost when either device is, or when the ends are not as far apart as the stylus is long.
  /// Buttons of the tip's grip are bits 0 to 3, of the tail's 4 to 7.
  DeviceReading read() noexcept override;
  /// \param device1, device2  N, world frame: eq. (1)'s forces at tip and tail.
  void write(const Vec3& device1, const Vec3& device2) noexcept override;

  /// Neither end pushes meanwhile.
  void reopen() override;

  FalconArm& tip() { return *tip_; }
  FalconArm& tail() { return *tail_; }
  const StylusFromEnds& stylus() const { return stylus_; }

 private:
  std::unique_ptr<FalconArm> tip_, tail_;
  StylusFromEnds stylus_;
  DeviceCapabilities capabilities_;
  bool lost_ = true;
};

}  // namespace palpate::runner::falcon
