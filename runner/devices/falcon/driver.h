#pragma once
// The driver of one Falcon: position of its grip and force on it. `falcon` uses one, `falcon2` two.
// Each servo tick calls update, then push; neither throws nor waits. All calls from one thread.

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "runner/devices/falcon/packets.h"
#include "runner/devices/falcon/parameters.h"
#include "runner/devices/falcon/transport.h"
#include "runner/servo/device.h"
#include "stimuli/vec.h"

namespace palpate::runner::devices::falcon {

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

}  // namespace palpate::runner::devices::falcon
