#include "runner/devices/falcon/homing.h"

namespace palpate::runner::falcon {

void wait_until_homed(Device& device, Clock& clock, Guide& guide) {
  constexpr std::int64_t kTickNs = 1'000'000;
  DeviceTrouble announced = DeviceTrouble::none;
  for (;;) {
    clock.wait_until(clock.now_ns() + kTickNs);
    const DeviceReading reading = device.read();
    device.write(Vec3(0), Vec3(0));
    if (!reading.lost && reading.trouble == DeviceTrouble::none) return;
    if (reading.trouble == DeviceTrouble::unplugged ||
        reading.trouble == DeviceTrouble::guard_lost) {
      throw GuideError(advice(reading.trouble));
    }
    if (reading.lost && reading.trouble != announced && reading.trouble != DeviceTrouble::guarded) {
      announced = reading.trouble;
      guide.say(device.capabilities().serial + ": " + advice(announced));
    }
    if (guide.answer() == Guide::Answer::stop) throw GuideError("stopped; nothing was stored");
  }
}

}  // namespace palpate::runner::falcon
