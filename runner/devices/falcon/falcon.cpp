#include "runner/devices/falcon/falcon.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>
#include <iostream>
#include <optional>
#include <span>
#include <stdexcept>
#include <utility>

#include "data/base/text.h"
#include "protocols/parse.h"
#include "runner/devices/falcon/boot.h"
#include "runner/devices/falcon/parameters.h"
#include "runner/devices/falcon/usb.h"

namespace palpate::runner::devices::falcon {
namespace {

constexpr double kMaxStep = 0.02;     // m; beyond it the linear model is too inaccurate
constexpr double kConverged = 1e-11;  // rad, 1e-8 of a count
constexpr int kMaxIterations = 40;    // a warm start takes 4
constexpr int kMaxHalvings = 25;      // the step is then below the resolution of a double
constexpr double kSingular = 1e-6;    // volume of the unit rows

Vec3 residual_of(const Vec3& thighs, const Legs& legs) {
  return {thighs.x - legs[0].thigh, thighs.y - legs[1].thigh, thighs.z - legs[2].thigh};
}

/// Inverse of a matrix of three rows: its columns are their cross products over the determinant.
struct Inverse {
  std::array<Vec3, 3> columns;
  bool regular = false;

  explicit Inverse(const Jacobian& j) {
    const Vec3 c0 = glm::cross(j[1], j[2]), c1 = glm::cross(j[2], j[0]),
               c2 = glm::cross(j[0], j[1]);
    const double det = glm::dot(j[0], c0);
    const double size = glm::length(j[0]) * glm::length(j[1]) * glm::length(j[2]);
    regular = std::abs(det) > kSingular * size && std::isfinite(size);
    if (regular) columns = {c0 / det, c1 / det, c2 / det};
  }
};

bool within_reach(const Vec3& p) {
  return p.z >= kNearest && p.z <= kFarthest && std::hypot(p.x, p.y) <= kWidest;
}

constexpr int kMaxImplausible = 5;  // in a row; more: the encoders have lost their reference
constexpr double kSlack = 0.002;    // m, beyond the fastest hand's motion
constexpr std::int64_t kHaltReply = 20'000'000;  // ns
constexpr int kHaltTries = 3;

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

Vec3 thigh_angles(const Vec3& counts) { return kZeroAngle + kCountAngle * counts; }

Vec3 encoder_counts(const Vec3& thighs) { return (thighs - kZeroAngle) / kCountAngle; }

std::optional<Legs> inverse(const Vec3& p) noexcept {
  Legs legs;
  for (std::size_t i = 0; i < 3; ++i) {
    // Relative to the thigh's joint: u, w in the leg's plane, v at right angles to it.
    const double u = p.x * kLegCos[i] + p.y * kLegSin[i] - kBaseRadial + kGripRadial;
    const double v = -p.x * kLegSin[i] + p.y * kLegCos[i] - kBaseTangential + kGripTangential;
    const double w = p.z;
    const double lean = v / kShin;
    if (!(std::abs(lean) < 1)) return std::nullopt;
    const double tilt = std::acos(lean);
    const double shin = kShinEnds + kShin * std::sin(tilt);  // length of the shin in the plane
    const double reach2 = u * u + w * w;
    const double knee = (kThigh * kThigh + reach2 - shin * shin) / (2 * kThigh * std::sqrt(reach2));
    if (!(std::abs(knee) <= 1)) return std::nullopt;
    const double thigh = std::atan2(w, u) - std::acos(knee);
    legs[i] = {thigh, std::atan2(w - kThigh * std::sin(thigh), u - kThigh * std::cos(thigh)), tilt};
  }
  return legs;
}

Jacobian jacobian(const Legs& legs) noexcept {
  Jacobian j;
  for (std::size_t i = 0; i < 3; ++i) {
    const double lever = kThigh * std::sin(legs[i].shin - legs[i].thigh);
    const double slope = std::cos(legs[i].tilt) / std::sin(legs[i].tilt);
    const double along = std::cos(legs[i].shin);
    j[i] = Vec3(kLegCos[i] * along - kLegSin[i] * slope, kLegSin[i] * along + kLegCos[i] * slope,
                std::sin(legs[i].shin)) /
           lever;
  }
  return j;
}

std::optional<ForwardResult> forward(const Vec3& thighs, const Vec3& start) noexcept {
  ForwardResult at{start, 0};
  auto legs = inverse(at.position);
  if (!legs) {
    at.position = kCentre;
    legs = inverse(at.position);
  }
  Vec3 residual = residual_of(thighs, *legs);
  double error = glm::length(residual);
  while (!(error < kConverged)) {
    if (++at.iterations > kMaxIterations || !std::isfinite(error)) return std::nullopt;
    const Inverse j(jacobian(*legs));
    if (!j.regular) return std::nullopt;
    Vec3 step = j.columns[0] * residual.x + j.columns[1] * residual.y + j.columns[2] * residual.z;
    const double length = glm::length(step);
    if (length > kMaxStep) step *= kMaxStep / length;
    bool better = false;
    for (int halving = 0; halving < kMaxHalvings && !better; ++halving, step *= 0.5) {
      const Vec3 next = at.position + step;
      const auto next_legs = inverse(next);
      if (!next_legs) continue;
      const Vec3 next_residual = residual_of(thighs, *next_legs);
      if (!(glm::length(next_residual) < error)) continue;
      better = true;
      at.position = next;
      legs = next_legs;
      residual = next_residual;
      error = glm::length(residual);
    }
    if (!better) return std::nullopt;
  }
  if (!within_reach(at.position)) return std::nullopt;
  return at;
}

std::optional<Vec3> torque_for(const Jacobian& j, const Vec3& force) noexcept {
  const Inverse inverse_of_j(j);
  if (!inverse_of_j.regular) return std::nullopt;
  const auto& c = inverse_of_j.columns;
  return Vec3(glm::dot(c[0], force), glm::dot(c[1], force), glm::dot(c[2], force));
}

Vec3 force_of(const Jacobian& j, const Vec3& torque) noexcept {
  return torque.x * j[0] + torque.y * j[1] + torque.z * j[2];
}

double force_in_every_direction(const Vec3& position, double max_torque) noexcept {
  const auto legs = inverse(position);
  if (!legs) return 0;
  const Inverse j(jacobian(*legs));
  if (!j.regular) return 0;
  // A motor's torque is largest for forces along its column of the inverse.
  return max_torque / std::max({glm::length(j.columns[0]), glm::length(j.columns[1]),
                                glm::length(j.columns[2])});
}

FalconDriver::FalconDriver(std::unique_ptr<Transport> transport, const DriverSettings& settings)
    : transport_(std::move(transport)), settings_(settings) {
  restart();
}

FalconDriver::~FalconDriver() { halt(); }

void FalconDriver::restart() noexcept {
  stream_.reset();
  reading_ = {};
  waiting_ = located_ = fresh_ = false;
  replied_ns_ = transport_->now_ns();
  halt();
  update();
}

void FalconDriver::reopen() {
  if (reading_.trouble != servo::DeviceTrouble::unplugged &&
      reading_.trouble != servo::DeviceTrouble::silent)
    return;
  transport_->reopen();
  if (settings_.boot) settings_.boot(*transport_);
  restart();
}

void FalconDriver::take_replies(std::int64_t wait_ns) noexcept {
  bool fresh = false;
  std::array<std::uint8_t, 256> bytes{};
  for (std::size_t count = bytes.size(); count == bytes.size(); wait_ns = 0) {  // until all is read
    count = transport_->receive(bytes, wait_ns);
    for (const std::uint8_t byte : std::span(bytes).first(count)) {
      const auto packet = stream_.take(byte);
      if (!packet) continue;
      const auto reply = decode_reply(*packet);
      if (!reply) {
        stream_.count_bad();
        continue;
      }
      reply_ = *reply;
      fresh = true;
      ++counts_.replies;
    }
  }
  counts_.malformed = stream_.dropped();
  if (fresh) {
    replied_ns_ = transport_->now_ns();
    waiting_ = false;
    fresh_ = true;
  }
}

const DriverReading& FalconDriver::update() noexcept {
  take_replies(0);
  const bool fresh = std::exchange(fresh_, false);
  if (transport_->gone()) {
    reading_.trouble = servo::DeviceTrouble::unplugged;
  } else if (transport_->now_ns() - replied_ns_ > settings_.silence_ns || counts_.replies == 0) {
    reading_.trouble = servo::DeviceTrouble::silent;
  } else if (fresh) {
    reading_.buttons = reply_.buttons;
    if (reply_.all_homed()) {
      locate();
    } else {
      reading_.trouble = servo::DeviceTrouble::not_homed;
    }
  } else if (reading_.usable() && waiting_) {
    reading_.trouble = servo::DeviceTrouble::late;
  }
  if (!reading_.usable()) located_ = false;
  return reading_;
}

void FalconDriver::locate() noexcept {
  const auto& counts = reply_.counts;
  const auto found = forward(thigh_angles({counts[0], counts[1], counts[2]}),
                             located_ ? falcon_position_ : kCentre);
  const double passed = 1e-9 * static_cast<double>(replied_ns_ - located_ns_);  // s
  const bool plausible = found && (!located_ || glm::length(found->position - falcon_position_) <=
                                                    kSlack + kMaxSpeed * passed);
  if (!plausible) {
    ++counts_.implausible;
    // Repeat the last valid position, if any, for a few ticks.
    const bool lost = ++implausible_in_a_row_ >= kMaxImplausible || !located_;
    reading_.trouble = lost ? servo::DeviceTrouble::implausible : servo::DeviceTrouble::late;
    return;
  }
  implausible_in_a_row_ = 0;
  falcon_position_ = found->position;
  located_ns_ = replied_ns_;
  located_ = true;
  reading_.position = to_world(falcon_position_ - kCentre);
  reading_.trouble = servo::DeviceTrouble::none;
}

std::array<int, 3> FalconDriver::motors_for(const Vec3& force) noexcept {
  std::array<int, 3> motors{};
  const auto legs = inverse(falcon_position_);
  if (!legs) return motors;
  const auto torque = torque_for(jacobian(*legs), from_world(force));
  if (!torque) return motors;
  Vec3 counts = settings_.counts_per_torque * *torque;
  const double peak = std::max({std::abs(counts.x), std::abs(counts.y), std::abs(counts.z)});
  if (!std::isfinite(counts.x + counts.y + counts.z)) return motors;
  // Scale all three by one factor: separate clipping would rotate the force.
  if (peak > kMaxCount) {
    counts *= kMaxCount / peak;
    ++counts_.saturated;
  }
  for (int i = 0; i < 3; ++i) {
    motors[static_cast<std::size_t>(i)] = static_cast<int>(std::lround(counts[i]));
  }
  return motors;
}

bool FalconDriver::send(const std::array<int, 3>& motors) noexcept {
  const bool homed = reply_.all_homed() && reading_.trouble != servo::DeviceTrouble::silent;
  Command command;
  command.motors = motors;
  command.green = homed;
  command.red = !homed;
  if (!transport_->send(encode(command))) return false;
  motors_ = motors;
  sent_ns_ = transport_->now_ns();
  waiting_ = true;
  return true;
}

void FalconDriver::push(const Vec3& force) noexcept {
  if (transport_->gone()) return;
  // Send one packet at a time: it is unknown whether the firmware can handle several.
  if (waiting_) {
    if (transport_->now_ns() - sent_ns_ < settings_.resend_ns) {
      ++counts_.late;
      return;
    }
    ++counts_.resent;
    stream_.reset();
  }
  send(reading_.usable() && located_ ? motors_for(force) : std::array<int, 3>{});
}

bool FalconDriver::halt() noexcept {
  const auto await_reply = [this](std::int64_t wait_ns) {
    const std::int64_t end = transport_->now_ns() + wait_ns;
    for (std::int64_t left = wait_ns; waiting_ && left > 0 && !transport_->gone();
         left = end - transport_->now_ns()) {
      take_replies(left);
    }
    return !waiting_;
  };
  await_reply(settings_.resend_ns);
  for (int i = 0; i < kHaltTries && !transport_->gone(); ++i) {
    if (send({}) && transport_->drain(kHaltReply) && await_reply(kHaltReply)) return true;
  }
  return false;
}

double guaranteed_force(double counts_per_torque) {
  const double torque = kMaxCount / std::abs(counts_per_torque);
  double least = force_in_every_direction(kCentre, torque);
  constexpr int kSteps = 12;
  for (int i = 0; i <= kSteps; ++i) {
    const double polar = 3.14159265358979323846 * i / kSteps;
    for (int k = 0; k < 2 * kSteps; ++k) {
      const double turn = 3.14159265358979323846 * k / kSteps;
      const Vec3 direction(std::sin(polar) * std::cos(turn), std::sin(polar) * std::sin(turn),
                           std::cos(polar));
      least =
          std::min(least, force_in_every_direction(kCentre + kWorkspaceRadius * direction, torque));
    }
  }
  return least;
}

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
