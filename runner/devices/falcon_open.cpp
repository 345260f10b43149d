#include "runner/devices/falcon_open.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

#include "protocols/parse.h"
#include "runner/devices/falcon.h"
#include "runner/devices/falcon2.h"
#include "runner/devices/falcon_image.h"
#include "runner/devices/falcon_usb.h"

namespace palpate::falcon {
namespace {

std::int64_t unix_ns() {
  return std::chrono::system_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
}

Calibration calibration_of(const FalconOptions& options) {
  return options.calibration.empty() ? Calibration{} : read_calibration(options.calibration);
}

double scale_of(const std::string& serial, const Calibration& calibration) {
  const ForceCalibration* force = calibration.force_of(serial);
  return force != nullptr ? force->counts_per_torque : kCountsPerTorque;
}

}  // namespace

std::unique_ptr<FalconArm> open_arm(const std::string& serial, const std::string& firmware,
                                    const Calibration& calibration, const BootReport& report) {
  std::optional<FirmwareImage> image;  // a bad file is found before the device is touched
  if (!firmware.empty()) image = read_image(firmware);
  auto line = open_usb(serial);
  boot(*line, image ? &*image : nullptr, {}, report);
  ArmSettings settings;
  settings.counts_per_torque = scale_of(line->serial(), calibration);
  return std::make_unique<FalconArm>(std::move(line), settings);
}

OpenedDevice open_falcon(const FalconOptions& options, const BootReport& report) {
  const Calibration calibration = calibration_of(options);
  auto arm = open_arm(options.serial, options.firmware, calibration, report);
  OpenedDevice opened;
  opened.serials = {arm->serial()};
  opened.calibration = judge_forces(calibration, opened.serials, unix_ns());
  opened.device = std::make_unique<FalconDevice>(std::move(arm));
  return opened;
}

OpenedDevice open_falcon2(const FalconOptions& options, const BootReport& report) {
  if (options.serial.empty() || options.tail_serial.empty() ||
      options.serial == options.tail_serial) {
    throw TransportError(
        "falcon2 needs the serial numbers of two Falcons: first the one at the stylus' tip, then "
        "the one at its tail (palpate devices lists them)");
  }
  const Calibration calibration = calibration_of(options);
  const PairRegistration* pair = calibration.pair_of(options.serial, options.tail_serial);
  if (pair == nullptr) {
    throw InputError(
        {{options.calibration.empty() ? "(no calibration file)" : options.calibration, "/pairs",
          "expected a registration of the Falcons " + options.serial + " (tip) and " +
              options.tail_serial +
              " (tail), without which nobody knows how they stand to each other: run "
              "palpate devices --calibrate --device falcon2"}});
  }
  auto tip = open_arm(options.serial, options.firmware, calibration, report);
  auto tail = open_arm(options.tail_serial, options.firmware, calibration, report);
  const double max_force =
      std::min(sure_force(tip->counts_per_torque()), sure_force(tail->counts_per_torque()));
  OpenedDevice opened;
  opened.serials = {tip->serial(), tail->serial()};
  opened.calibration = both(judge_forces(calibration, opened.serials, unix_ns()),
                            judge_pair(calibration, tip->serial(), tail->serial(), unix_ns()));
  opened.device = std::make_unique<Falcon2Device>(
      std::move(tip), std::move(tail), StylusFromEnds(pair->tail_in_tip, pair->stylus_length),
      max_force);
  return opened;
}

}  // namespace palpate::falcon
