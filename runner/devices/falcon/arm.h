#pragma once
// One Falcon at work: where its grip is, and forces on it. Used by `falcon` alone and by `falcon2`
// twice. A tick calls update, then push; neither throws nor waits.

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

namespace palpate::runner::falcon {

struct ArmSettings {
  double counts_per_torque = kCountsPerTorque;  ///< 1/(N m); from the calibration
  /// A packet or its reply may be lost: after so long it is sent again.
  std::int64_t resend_ns = 4'000'000;
  /// Without a reply for so long the device is lost.
  std::int64_t silence_ns = 25'000'000;
  std::function<void(Transport&)> boot;  ///< makes the firmware run, for reopen(); none: it does
};

struct ArmReading {
  Vec3 position;  ///< m, world frame about the device's centre; the last good one when in trouble
  std::uint8_t buttons = 0;
  DeviceTrouble trouble = DeviceTrouble::silent;

  /// The last good position still stands: nothing worse than a late reply.
  bool usable() const { return trouble == DeviceTrouble::none || trouble == DeviceTrouble::late; }
};

/// What the line was like.
struct ArmCounts {
  std::uint64_t replies = 0;
  std::uint64_t late = 0;         ///< pushes that waited for a reply still: not sent
  std::uint64_t resent = 0;       ///< sent without a reply to the one before
  std::uint64_t malformed = 0;    ///< packets thrown away
  std::uint64_t implausible = 0;  ///< positions thrown away
  std::uint64_t saturated = 0;    ///< forces scaled down to what the motors take
};

class FalconArm {
 public:
  /// Firmware must run. Waits for a first reply, if only to know whether it is homed.
  FalconArm(std::unique_ptr<Transport> transport, const ArmSettings& settings);
  /// Leaves the motors without torque.
  ~FalconArm();
  FalconArm(const FalconArm&) = delete;
  FalconArm& operator=(const FalconArm&) = delete;

  const ArmReading& update() noexcept;
  /// \param force  N, world frame, on the hand. Nothing is pushed in trouble.
  void push(const Vec3& force) noexcept;
  /// Zero torque, and waits (up to 60 ms) until the device has it. False: it could not be told.
  bool halt() noexcept;

  const ArmReading& reading() const { return reading_; }
  const ArmCounts& counts() const { return counts_; }
  const std::string& serial() const { return transport_->serial(); }
  /// As last sent.
  const std::array<int, 3>& motors() const { return motors_; }
  double counts_per_torque() const { return settings_.counts_per_torque; }
  Transport& transport() { return *transport_; }
  /// After the line was opened again and the firmware runs: as if new. Waits for a first reply.
  void restart() noexcept;
  /// Where it is unplugged or silent: opens the line again, makes the firmware run, restarts.
  /// \throws TransportError
  void reopen();

 private:
  void take_replies(std::int64_t wait_ns) noexcept;
  void locate() noexcept;
  std::array<int, 3> motors_for(const Vec3& force) noexcept;
  bool send(const std::array<int, 3>& motors) noexcept;

  std::unique_ptr<Transport> transport_;
  ArmSettings settings_;
  PacketStream stream_;
  ArmReading reading_;
  ArmCounts counts_;
  Reply reply_;
  Vec3 falcon_position_{kCentre};  ///< m, Falcon frame
  std::int64_t replied_ns_ = 0, sent_ns_ = 0, located_ns_ = 0;
  bool waiting_ = false, located_ = false, fresh_ = false;
  int implausible_in_a_row_ = 0;
  std::array<int, 3> motors_{};
};

/// The force (N) that the motors can show in every direction everywhere in the workspace.
double sure_force(double counts_per_torque);

}  // namespace palpate::runner::falcon
