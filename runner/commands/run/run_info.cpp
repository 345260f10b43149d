#include "runner/commands/run/run_info.h"

#include <chrono>
#include <cstdint>
#include <utility>

#include "runner/build_info.h"
#include "runner/session/protocol_info.h"

namespace palpate::runner {

data::ClockStamp stamp_now(Clock& clock) {
  const std::int64_t before = clock.now_ns();
  const std::int64_t utc =
      std::chrono::system_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
  return {utc, before + (clock.now_ns() - before) / 2};
}

data::RunInfo run_info(const RunSettings& settings, const DeviceCapabilities& device, int session,
                       const data::ClockStamp& began, bool joystick) {
  data::RunInfo info;
  info.session = session;
  info.clock = began;
  info.program_version = PALPATE_VERSION;
  info.build = build_description();
  info.device = settings.device;
  info.device_calibration = device.calibration;
  if (!device.serial.empty()) info.device_calibration += " (serial " + device.serial + ")";
  info.response_device = settings.spoken    ? "spoken, typed by the experimenter"
                         : settings.buttons ? "device buttons"
                                            : "keyboard";
  if (!settings.response_box.empty()) info.response_device += ", serial response box";
  if (joystick) info.response_device += ", joystick";
  info.response_latency = settings.response_latency;
  info.consent_version = settings.consent;
  if (!settings.consent.empty()) info.consent_utc_ns = began.utc_ns;
  info.hand = settings.hand;
  info.after_withdrawal = settings.after_withdrawal;
  return info;
}

std::optional<data::ProtocolInfo> other_texts(const Admission& admission) {
  data::ProtocolInfo shown = info_of(admission.protocol);
  if (shown.sha256 == admission.enrolled.sha256) return std::nullopt;
  return shown;
}

}  // namespace palpate::runner
