#include "runner/devices/falcon/falcon.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <iostream>
#include <optional>
#include <stdexcept>
#include <utility>

#include "data/base/text.h"
#include "protocols/parse.h"
#include "runner/devices/falcon/boot.h"
#include "runner/devices/falcon/parameters.h"
#include "runner/devices/falcon/usb.h"

namespace palpate::runner::devices::falcon {
namespace {

std::int64_t unix_ns() {
  return std::chrono::system_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
}

Calibration calibration_in(const std::string& path) {
  return path.empty() ? Calibration{} : read_calibration(path);
}

std::optional<FirmwareImage> image_in(const std::string& path) {
  if (path.empty()) return std::nullopt;
  return read_image(path);
}

/// \throws InputError if the calibration has no registration of these two.
const PairRegistration& registration_in(const Calibration& calibration,
                                        const servo::DeviceConfig& config) {
  const std::string &tip = config.serials[0], &tail = config.serials[1];
  if (const PairRegistration* pair = calibration.pair_of(tip, tail)) return *pair;
  throw protocols::InputError(
      {{config.calibration.empty() ? "(no calibration file)" : config.calibration, "/pairs",
        "expected a registration of the Falcons " + tip + " (tip) and " + tail +
            " (tail), which gives their relative pose: run "
            "palpate devices --calibrate --device falcon2"}});
}

CalibrationVerdict judge(const Calibration& calibration, const std::vector<std::string>& serials) {
  CalibrationVerdict verdict = judge_forces(calibration, serials, unix_ns());
  if (serials.size() == 2) {
    verdict = both(verdict, judge_pair(calibration, serials[0], serials[1], unix_ns()));
  }
  return verdict;
}

/// The text for DeviceCapabilities; empty: missing.
std::string summary_of(const CalibrationVerdict& verdict) {
  switch (verdict.state) {
    case CalibrationState::good:
      return verdict.text;
    case CalibrationState::stale:
      return "stale: " + verdict.text;
    case CalibrationState::implausible:
      return "implausible: " + verdict.text;
    case CalibrationState::missing:
      return "";
  }
  return "";
}

servo::DeviceCapabilities nominal(const char* name, int freedom) {
  servo::DeviceCapabilities can;
  can.name = name;
  can.sensed_freedom = can.actuated_freedom = freedom;
  can.max_stiffness = kMaxStiffness;
  can.max_rate = kMaxRate;
  can.workspace_radius = kWorkspaceRadius;
  can.resolution = kResolution;
  return can;
}

void show_progress(const std::string& serial, const BootProgress& progress) {
  if (isatty(STDERR_FILENO) == 0) return;
  using Step = BootProgress::Step;
  if (progress.step == Step::monitor && progress.attempt > 1) {
    std::cerr << "\n  " << printable(progress.trouble) << "; attempt " << progress.attempt << "\n";
  }
  if (progress.step != Step::uploading) return;
  std::cerr << "\rFalcon " << printable(serial) << ": firmware "
            << 100 * progress.sent / progress.size << " %"
            << (progress.sent == progress.size ? "\n" : "") << std::flush;
}

/// The driver of one Falcon, with the calibrated scale of force if there is a plausible one. Shows
/// the progress of an upload on a terminal. \throws TransportError, InputError.
std::unique_ptr<FalconDriver> open_driver(const std::string& serial, const std::string& firmware,
                                          const Calibration& calibration) {
  const auto image = image_in(firmware);  // read first: report a bad file before opening the device
  auto line = open_usb(serial);
  const std::string name = line->serial();
  DriverSettings settings;
  settings.boot = [image, name](Transport& transport) {
    boot(transport, image ? &*image : nullptr, {},
         [&name](const BootProgress& progress) { show_progress(name, progress); });
  };
  settings.boot(*line);
  const ForceCalibration* force = calibration.force_of(name);
  if (force != nullptr && plausible(*force)) {
    settings.counts_per_torque = force->counts_per_torque;
  }
  return std::make_unique<FalconDriver>(std::move(line), settings);
}

}  // namespace

FalconDevice::FalconDevice(std::unique_ptr<FalconDriver> driver, const std::string& calibration)
    : driver_(std::move(driver)) {
  capabilities_ = {"falcon",
                   3,
                   3,
                   guaranteed_force(driver_->counts_per_torque()),
                   kMaxStiffness,
                   kMaxRate,
                   kWorkspaceRadius,
                   kResolution,
                   false,
                   driver_->serial(),
                   calibration};
}

servo::DeviceReading FalconDevice::read() noexcept {
  const DriverReading& at = driver_->update();
  return {{at.position, at.position}, at.buttons, !at.usable(), at.trouble};
}

void FalconDevice::write(const Vec3& device1, const Vec3& device2) noexcept {
  driver_->push(device1 + device2);
}

Falcon2Device::Falcon2Device(std::unique_ptr<FalconDriver> tip, std::unique_ptr<FalconDriver> tail,
                             const StylusFromEnds& stylus, const std::string& calibration)
    : tip_(std::move(tip)), tail_(std::move(tail)), stylus_(stylus) {
  capabilities_ = {"falcon2",
                   5,
                   5,
                   std::min(guaranteed_force(tip_->counts_per_torque()),
                            guaranteed_force(tail_->counts_per_torque())),
                   kMaxStiffness,
                   kMaxRate,
                   kWorkspaceRadius,
                   kResolution,
                   false,
                   tip_->serial() + ", " + tail_->serial(),
                   calibration};
}

servo::DeviceReading Falcon2Device::read() noexcept {
  const DriverReading& tip = tip_->update();
  const DriverReading& tail = tail_->update();
  servo::DeviceTrouble trouble = tip.trouble;
  if (tip.usable() && tail.trouble != servo::DeviceTrouble::none) trouble = tail.trouble;
  lost_ = !tip.usable() || !tail.usable();
  if (!lost_ && !stylus_.update(tip.position, tail.position)) {
    lost_ = true;
    trouble = servo::DeviceTrouble::apart;
  }
  return {stylus_.stylus(), static_cast<std::uint8_t>(tip.buttons | tail.buttons << 4), lost_,
          trouble};
}

void Falcon2Device::reopen() {
  // Halt both: a device keeps its last command while it receives no packets.
  tip_->halt();
  tail_->halt();
  tip_->reopen();
  tail_->reopen();
}

void Falcon2Device::write(const Vec3& device1, const Vec3& device2) noexcept {
  // Push with both or none: a force from one device alone would turn the stylus.
  tip_->push(lost_ ? Vec3(0) : device1);
  tail_->push(lost_ ? Vec3(0) : stylus_.to_tail_frame(device2));
}

servo::DeviceCapabilities nominal_falcon(const servo::DeviceConfig& /*config*/) {
  return nominal("falcon", 3);
}
servo::DeviceCapabilities nominal_falcon2(const servo::DeviceConfig& /*config*/) {
  return nominal("falcon2", 5);
}

std::vector<servo::ConnectedDevice> connected_falcons(const servo::DeviceConfig& /*config*/) {
  std::vector<servo::ConnectedDevice> connected;
  for (UsbListing& listing : list_usb()) {
    connected.push_back({std::move(listing.serial), std::move(listing.trouble)});
  }
  return connected;
}

void check_falcon(const servo::DeviceConfig& config) {
  if (config.serials.size() > 1) {
    throw std::invalid_argument("falcon is one device; " + std::to_string(config.serials.size()) +
                                " serial numbers are given");
  }
  calibration_in(config.calibration);
  image_in(config.firmware);
}

void check_falcon2(const servo::DeviceConfig& config) {
  if (config.serials.size() != 2 || config.serials[0] == config.serials[1]) {
    throw std::invalid_argument(
        "falcon2 needs the serial numbers of two Falcons: first the one at the stylus' tip, then "
        "the one at its tail (palpate devices lists them)");
  }
  registration_in(calibration_in(config.calibration), config);
  image_in(config.firmware);
}

std::unique_ptr<servo::Device> open_falcon(const servo::DeviceConfig& config) {
  const Calibration calibration = calibration_in(config.calibration);
  auto driver =
      open_driver(config.serials.empty() ? "" : config.serials[0], config.firmware, calibration);
  const std::string known = summary_of(judge(calibration, {driver->serial()}));
  return std::make_unique<FalconDevice>(std::move(driver), known);
}

std::unique_ptr<servo::Device> open_falcon2(const servo::DeviceConfig& config) {
  const Calibration calibration = calibration_in(config.calibration);
  const PairRegistration& pair = registration_in(calibration, config);
  auto tip = open_driver(config.serials[0], config.firmware, calibration);
  auto tail = open_driver(config.serials[1], config.firmware, calibration);
  const std::string known = summary_of(judge(calibration, config.serials));
  return std::make_unique<Falcon2Device>(
      std::move(tip), std::move(tail), StylusFromEnds(pair.tail_in_tip, pair.stylus_length), known);
}

}  // namespace palpate::runner::devices::falcon
