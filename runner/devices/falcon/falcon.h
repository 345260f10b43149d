#pragma once
// A Novint Falcon: kinematics, driver, and device. All calls from one thread.

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "runner/devices/falcon/boot.h"
#include "runner/devices/falcon/calibration.h"
#include "runner/devices/falcon/packets.h"
#include "runner/devices/falcon/parameters.h"
#include "runner/devices/falcon/stylus_from_ends.h"
#include "runner/devices/falcon/transport.h"
#include "runner/servo/device.h"
#include "stimuli/vec.h"

namespace palpate::runner::devices::falcon {

// Kinematics and statics of the Falcon: encoder counts to position, force to motor torques. Lengths
// in m, angles in rad, in the Falcon's own frame: x right, y up, z out of the device towards the
// user, z = 0 at its base. Pure functions.
//
// A leg is a two-link arm in its plane (Clavel 1991; Stamper 1997). The Jacobian differs from
// libnifalcon's, which has a wrong third column (up to 66 %); tests compare ours with finite
// differences.

/// Joint angles of a leg, rad.
struct LegAngles {
  double thigh = 0;  ///< theta 1, the one with motor and encoder
  double shin = 0;   ///< theta 2, of the shin in the leg's plane
  double tilt = 0;   ///< theta 3, of the shin out of the plane
};
using Legs = std::array<LegAngles, 3>;

/// Rows are d(thigh angle of leg i) / d(position), rad/m.
using Jacobian = std::array<Vec3, 3>;

/// Encoder counts to thigh angles (rad) and back (not rounded).
Vec3 thigh_angles(const Vec3& counts);
Vec3 encoder_counts(const Vec3& thighs);

/// Inverse kinematics; nullopt: a leg cannot reach the position.
std::optional<Legs> inverse(const Vec3& position) noexcept;

Jacobian jacobian(const Legs& legs) noexcept;

struct ForwardResult {
  Vec3 position;
  int iterations = 0;
};

/// Forward kinematics: Newton's method. Steps are limited to 20 mm and halved until the residual
/// falls. From the last tick's position it takes at most 4 steps. nullopt: no convergence, or a
/// result out of the device's reach.
std::optional<ForwardResult> forward(const Vec3& thighs, const Vec3& start) noexcept;

/// Torques at the thighs, N m, that give `force` (N) on the hand; nullopt at a singularity.
std::optional<Vec3> torque_for(const Jacobian& j, const Vec3& force) noexcept;
/// The force (N) on the hand that torques (N m) give.
Vec3 force_of(const Jacobian& j, const Vec3& torque) noexcept;

/// The largest force (N) that can be rendered in every direction at a position with no torque above
/// `max_torque` (N m); 0: out of reach.
double force_in_every_direction(const Vec3& position, double max_torque) noexcept;

// The driver of one Falcon: position of its grip and force on it. `falcon` uses one, `falcon2` two.
// Each servo tick calls update, then push; neither throws nor waits.

struct DriverSettings {
  double counts_per_torque = kCountsPerTorque;  ///< 1/(N m); from the calibration
  /// Without a reply, a packet is sent again after this time.
  std::int64_t resend_ns = 4'000'000;
  /// The device counts as lost after this time without a reply.
  std::int64_t silence_ns = 25'000'000;
  std::function<void(Transport&)>
      boot;  ///< starts the firmware, for reopen(); empty: always running
};

struct DriverReading {
  Vec3 position;  ///< m, world frame, origin at the device's centre; the last valid one while in
                  ///< trouble
  std::uint8_t buttons = 0;
  servo::DeviceTrouble trouble = servo::DeviceTrouble::silent;

  /// Whether the position is usable: it is new, or the last one repeated because a reply is late.
  bool usable() const {
    return trouble == servo::DeviceTrouble::none || trouble == servo::DeviceTrouble::late;
  }
};

/// Counts of events on the serial line.
struct DriverCounts {
  std::uint64_t replies = 0;
  std::uint64_t late = 0;         ///< commands not sent because a reply was still pending
  std::uint64_t resent = 0;       ///< commands sent before the previous reply had arrived
  std::uint64_t malformed = 0;    ///< packets discarded
  std::uint64_t implausible = 0;  ///< positions discarded
  std::uint64_t saturated = 0;    ///< forces reduced to the limit of the motors
};

class FalconDriver {
 public:
  /// The firmware must be running. Waits for a first reply.
  FalconDriver(std::unique_ptr<Transport> transport, const DriverSettings& settings);
  /// Commands zero torque.
  ~FalconDriver();
  FalconDriver(const FalconDriver&) = delete;
  FalconDriver& operator=(const FalconDriver&) = delete;

  const DriverReading& update() noexcept;
  /// \param force  N, world frame, on the hand. While in trouble, zero force is sent.
  void push(const Vec3& force) noexcept;
  /// Commands zero torque and waits up to 60 ms for the reply. False: none came.
  bool halt() noexcept;

  const DriverReading& reading() const { return reading_; }
  const DriverCounts& counts() const { return counts_; }
  const std::string& serial() const { return transport_->serial(); }
  servo::DeviceTimes times() const noexcept { return {located_ns_, sent_ns_}; }
  /// Counts sent last, -4095 to 4095.
  const std::array<int, 3>& motors() const { return motors_; }
  double counts_per_torque() const { return settings_.counts_per_torque; }
  Transport& transport() { return *transport_; }
  /// Resets the state after the line was opened again; the firmware must be running. Waits for a
  /// first reply.
  void restart() noexcept;
  /// If unplugged or silent: opens the line again, starts the firmware and restarts.
  /// \throws TransportError
  void reopen();

 private:
  void take_replies(std::int64_t wait_ns) noexcept;
  void locate() noexcept;
  std::array<int, 3> motors_for(const Vec3& force) noexcept;
  bool send(const std::array<int, 3>& motors) noexcept;

  std::unique_ptr<Transport> transport_;
  DriverSettings settings_;
  PacketStream stream_;
  DriverReading reading_;
  DriverCounts counts_;
  Reply reply_;
  Vec3 falcon_position_{kCentre};  ///< m, Falcon frame
  std::int64_t replied_ns_ = 0, sent_ns_ = 0, located_ns_ = 0;
  bool waiting_ = false, located_ = false, fresh_ = false;
  int implausible_in_a_row_ = 0;
  std::array<int, 3> motors_{};
};

/// The largest force (N) that the motors can render in every direction everywhere in the workspace.
double guaranteed_force(double counts_per_torque);

/// Position and force of one point, no rotation.
class FalconDevice final : public servo::Device {
 public:
  /// \param calibration  state of its force calibration, for DeviceCapabilities
  explicit FalconDevice(std::unique_ptr<FalconDriver> driver, const std::string& calibration = "");

  const servo::DeviceCapabilities& capabilities() const override { return capabilities_; }
  /// Tip and tail are both the grip: the device senses no axis.
  servo::DeviceReading read() noexcept override;
  /// Both forces act on the one grip.
  void write(const Vec3& device1, const Vec3& device2) noexcept override;

  void reopen() override { driver_->reopen(); }
  servo::DeviceTimes times() const noexcept override { return driver_->times(); }

  FalconDriver& driver() { return *driver_; }

 private:
  std::unique_ptr<FalconDriver> driver_;
  servo::DeviceCapabilities capabilities_;
};

/// Two Falcons that hold the ends of a stylus, like the two Phantoms of Ho, Basdogan & Srinivasan
/// (2000), section 2: five degrees of freedom, sensed and actuated. World frame: the tip's device.
class Falcon2Device final : public servo::Device {
 public:
  Falcon2Device(std::unique_ptr<FalconDriver> tip, std::unique_ptr<FalconDriver> tail,
                const StylusFromEnds& stylus, const std::string& calibration = "");

  const servo::DeviceCapabilities& capabilities() const override { return capabilities_; }
  /// Lost if either device is lost or the distance of the ends differs from the stylus' length.
  /// Buttons of the tip's grip are bits 0 to 3, of the tail's 4 to 7.
  servo::DeviceReading read() noexcept override;
  /// \param device1, device2  N, world frame: eq. (1)'s forces at tip and tail.
  void write(const Vec3& device1, const Vec3& device2) noexcept override;

  /// Both ends command zero force during that time.
  void reopen() override;
  servo::DeviceTimes times() const noexcept override {
    return servo::later_of(tip_->times(), tail_->times());
  }

  FalconDriver& tip() { return *tip_; }
  FalconDriver& tail() { return *tail_; }
  const StylusFromEnds& stylus() const { return stylus_; }

 private:
  std::unique_ptr<FalconDriver> tip_, tail_;
  StylusFromEnds stylus_;
  servo::DeviceCapabilities capabilities_;
  bool lost_ = true;
};

// Functions for the Falcon's rows in the registry of devices. They open Falcons from a
// DeviceConfig; only homing remains to be done.

/// Connected Falcons. \throws TransportError if USB cannot be used.
std::vector<servo::ConnectedDevice> connected_falcons(const servo::DeviceConfig& config);

/// See DeviceKind::nominal.
servo::DeviceCapabilities nominal_falcon(const servo::DeviceConfig& config);
servo::DeviceCapabilities nominal_falcon2(const servo::DeviceConfig& config);

/// See DeviceKind::check.
void check_falcon(const servo::DeviceConfig& config);
void check_falcon2(const servo::DeviceConfig& config);

/// One Falcon. Its capabilities' `calibration` is empty if none is stored. It begins with "stale"
/// if too old, with "implausible" if its scale is not used. \throws TransportError, InputError.
std::unique_ptr<servo::Device> open_falcon(const servo::DeviceConfig& config);

/// The two Falcons of config.serials, the one at the stylus' tip first. config.calibration must
/// have their registration. \throws TransportError, InputError.
std::unique_ptr<servo::Device> open_falcon2(const servo::DeviceConfig& config);

}  // namespace palpate::runner::devices::falcon
