#pragma once
// Two devices of one model that hold the ends of a stylus, each a point with forces, like the two
// Phantoms of Ho, Basdogan & Srinivasan (2000), section 2: five degrees of freedom, sensed and
// driven. World frame: the tip's device.

#include <memory>
#include <string>

#include "runner/devices/falcon/stylus_from_ends.h"
#include "runner/servo/device.h"

namespace palpate::runner::devices {

class PairDevice final : public servo::Device {
 public:
  /// \param name         name of the kind
  /// \param calibration  as in DeviceCapabilities
  PairDevice(std::unique_ptr<servo::Device> tip, std::unique_ptr<servo::Device> tail,
             const StylusFromEnds& stylus, const char* name, const std::string& calibration);

  const servo::DeviceCapabilities& capabilities() const override { return capabilities_; }
  /// Lost if either device is lost or the distance of the ends differs from the stylus's length.
  /// Buttons of the tip's grip are bits 0 to 3, of the tail's 4 to 7.
  servo::DeviceReading read() noexcept override;
  void write(const Vec3& device1, const Vec3& device2) noexcept override;
  /// Both ends command zero force first.
  void reopen() override;
  servo::DeviceTimes times() const noexcept override {
    return servo::later_of(tip_->times(), tail_->times());
  }

 private:
  std::unique_ptr<servo::Device> tip_, tail_;
  StylusFromEnds stylus_;
  servo::DeviceCapabilities capabilities_;
  bool lost_ = true;
};

/// One device of a pair, as a point.
using OpenEnd = std::unique_ptr<servo::Device> (*)(const servo::DeviceConfig& config);

/// Capabilities of a pair. \param end  those of each device
servo::DeviceCapabilities pair_of(const servo::DeviceCapabilities& end, const char* name);
/// See DeviceKind::check. \throws std::invalid_argument, InputError: no registration of the two
void check_pair(const servo::DeviceConfig& config, const char* name);
/// Opens the two devices of config.serials, the one at the stylus's tip first. \throws
/// std::runtime_error
std::unique_ptr<servo::Device> open_pair(const servo::DeviceConfig& config, const char* name,
                                         OpenEnd open_end);

}  // namespace palpate::runner::devices
