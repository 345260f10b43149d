// Whatever comes over the wire: packets are found, and say the same when they are written again.
// Whatever a firmware file holds: it is refused with the reason, or its structure is right.

#include "runner/devices/falcon/packets.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "protocols/parse.h"
#include "runner/devices/falcon/boot.h"
#include "runner/devices/falcon/driver.h"
#include "runner/devices/falcon/parameters.h"

namespace {

/// A line on which these bytes come in, some at each tick.
class Wire final : public palpate::runner::devices::falcon::Transport {
 public:
  Wire(const std::uint8_t* data, std::size_t size) : left_(data, size) {}
  const std::string& serial() const override { return serial_; }
  void control(std::uint8_t /*request*/, std::uint16_t /*value*/) override {}
  void reopen() override {}
  bool send(std::span<const std::uint8_t> /*bytes*/) noexcept override { return true; }
  std::size_t receive(std::span<std::uint8_t> bytes, std::int64_t wait_ns) noexcept override {
    now_ += wait_ns;
    const std::size_t count = std::min({bytes.size(), left_.size(), std::size_t{21}});
    std::copy_n(left_.begin(), count, bytes.begin());
    left_ = left_.subspan(count);
    return count;
  }
  bool drain(std::int64_t /*wait_ns*/) noexcept override { return true; }
  bool gone() const noexcept override { return false; }
  std::int64_t now_ns() noexcept override { return now_; }
  void tick() { now_ += 1'000'000; }
  bool empty() const { return left_.empty(); }

 private:
  std::span<const std::uint8_t> left_;
  std::string serial_ = "FUZZ";
  std::int64_t now_ = 1'000'000'000;
};

/// Whatever the device replies, positions stay within its reach and motors within their range, and
/// in trouble there is no torque.
void move_an_arm(const std::uint8_t* data, std::size_t size) {
  using namespace palpate::runner::devices::falcon;
  auto line = std::make_unique<Wire>(data, size);
  Wire& wire = *line;
  FalconDriver driver(std::move(line), {});
  while (!wire.empty()) {
    wire.tick();
    const DriverReading& reading = driver.update();
    const double size_m = std::max(
        {std::abs(reading.position.x), std::abs(reading.position.y), std::abs(reading.position.z)});
    if (!(size_m < 0.5)) std::abort();
    driver.push({1, -2, 3});
    for (const int motor : driver.motors()) {
      if (std::abs(motor) > kMaxCount) std::abort();
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace palpate::runner::devices::falcon;
  PacketStream stream;
  for (std::size_t i = 0; i < size; ++i) {
    const auto packet = stream.take(data[i]);
    if (!packet) continue;
    if (packet->front() != '<' || packet->back() != '>') std::abort();
    if (const auto reply = decode_reply(*packet)) {
      const auto again = decode_reply(encode(*reply));
      if (!again || again->counts != reply->counts || again->buttons != reply->buttons ||
          again->homed != reply->homed) {
        std::abort();
      }
      for (const int count : reply->counts) {
        if (count < -32768 || count > 32767) std::abort();
      }
    }
    if (const auto command = decode_command(*packet)) {
      const auto again = decode_command(encode(*command));
      if (!again || again->homing != command->homing) std::abort();
    }
  }
  move_an_arm(data, size);
  const std::string serial = clean_serial({data, size});
  if (serial.size() > kMaxSerial ||
      clean_serial({reinterpret_cast<const std::uint8_t*>(serial.data()), serial.size()}) !=
          serial) {
    std::abort();
  }
  try {
    const FirmwareImage image = parse_image({data, data + size}, "image.bin");
    if (image.bytes.size() != size || image.blocks < 1) std::abort();
  } catch (const palpate::protocols::InputError&) {
  }
  return 0;
}
