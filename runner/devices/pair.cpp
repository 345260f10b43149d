#include "runner/devices/pair.h"

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <utility>

#include "protocols/parse.h"
#include "runner/devices/falcon/calibration.h"

namespace palpate::runner::devices {
namespace {

using falcon::Calibration;
using falcon::CalibrationState;
using falcon::CalibrationVerdict;
using falcon::PairRegistration;

Calibration calibration_of_pair(const servo::DeviceConfig& config) {
  return config.calibration.empty() ? Calibration{} : falcon::read_calibration(config.calibration);
}

/// \throws InputError if there is none
const PairRegistration& registration_of(const Calibration& calibration,
                                        const servo::DeviceConfig& config, const char* name) {
  const std::string &tip = config.serials[0], &tail = config.serials[1];
  if (const PairRegistration* pair = calibration.pair_of(tip, tail)) return *pair;
  throw protocols::InputError(
      {{config.calibration.empty() ? "(no calibration file)" : config.calibration, "/pairs",
        "expected a registration of the devices " + tip + " (tip) and " + tail +
            " (tail), which gives their relative pose: run palpate devices --calibrate --device " +
            name}});
}

}  // namespace

servo::DeviceCapabilities pair_of(const servo::DeviceCapabilities& end, const char* name) {
  servo::DeviceCapabilities can = end;
  can.name = name;
  can.sensed_freedom = can.actuated_freedom = 5;
  can.max_torque = 0;  // forces at both ends produce it
  return can;
}

PairDevice::PairDevice(std::unique_ptr<servo::Device> tip, std::unique_ptr<servo::Device> tail,
                       const StylusFromEnds& stylus, const char* name,
                       const std::string& calibration)
    : tip_(std::move(tip)), tail_(std::move(tail)), stylus_(stylus) {
  const servo::DeviceCapabilities &one = tip_->capabilities(), &other = tail_->capabilities();
  capabilities_ = pair_of(one, name);
  capabilities_.max_force = std::min(one.max_force, other.max_force);
  capabilities_.max_stiffness = std::min(one.max_stiffness, other.max_stiffness);
  capabilities_.max_rate = std::min(one.max_rate, other.max_rate);
  capabilities_.workspace_radius = std::min(one.workspace_radius, other.workspace_radius);
  capabilities_.resolution = std::max(one.resolution, other.resolution);
  capabilities_.serial = one.serial + ", " + other.serial;
  capabilities_.calibration = calibration;
}

servo::DeviceReading PairDevice::read() noexcept {
  const servo::DeviceReading tip = tip_->read(), tail = tail_->read();
  // Report the trouble of a lost end before that of a late one.
  servo::DeviceTrouble trouble = tip.trouble;
  if (!tip.lost && tail.trouble != servo::DeviceTrouble::none) trouble = tail.trouble;
  lost_ = tip.lost || tail.lost;
  if (!lost_ && !stylus_.update(tip.stylus.tip, tail.stylus.tip)) {
    lost_ = true;
    trouble = servo::DeviceTrouble::apart;
  }
  return {stylus_.stylus(), static_cast<std::uint8_t>((tip.buttons & 15U) | tail.buttons << 4U),
          lost_, trouble};
}

void PairDevice::write(const Vec3& device1, const Vec3& device2) noexcept {
  // Push with both or none: a force from one device alone would turn the stylus.
  tip_->write(lost_ ? Vec3(0) : device1, Vec3(0));
  tail_->write(lost_ ? Vec3(0) : stylus_.to_tail_frame(device2), Vec3(0));
}

void PairDevice::reopen() {
  lost_ = true;
  write(Vec3(0), Vec3(0));
  tip_->reopen();
  tail_->reopen();
}

void check_pair(const servo::DeviceConfig& config, const char* name) {
  if (config.serials.size() != 2 || config.serials[0] == config.serials[1]) {
    throw std::invalid_argument(std::string(name) +
                                " needs the serial numbers of two devices: first the one at the "
                                "stylus' tip, then the one at its tail (palpate devices lists "
                                "them)");
  }
  registration_of(calibration_of_pair(config), config, name);
}

std::unique_ptr<servo::Device> open_pair(const servo::DeviceConfig& config, const char* name,
                                         OpenEnd open_end) {
  const Calibration calibration = calibration_of_pair(config);
  const PairRegistration& pair = registration_of(calibration, config, name);
  servo::DeviceConfig one = config;
  one.serials = {config.serials[0]};
  std::unique_ptr<servo::Device> tip = open_end(one);
  one.serials = {config.serials[1]};
  std::unique_ptr<servo::Device> tail = open_end(one);
  const CalibrationVerdict known =
      judge_pair(calibration, config.serials[0], config.serials[1],
                 std::chrono::system_clock::now().time_since_epoch() / std::chrono::nanoseconds(1));
  const std::string text = (known.state == CalibrationState::good ? "" : "stale: ") + known.text +
                           "; " + tip->capabilities().calibration + "; " +
                           tail->capabilities().calibration;
  return std::make_unique<PairDevice>(std::move(tip), std::move(tail),
                                      StylusFromEnds(pair.tail_in_tip, pair.stylus_length), name,
                                      text);
}

}  // namespace palpate::runner::devices
