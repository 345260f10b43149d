// Whatever comes over the wire: packets are found, and say the same when they are written again.
// Whatever a firmware file holds: it is refused with the reason, or its structure is right.

#include <cstdlib>

#include "protocols/parse.h"
#include "runner/devices/falcon_image.h"
#include "runner/devices/falcon_packets.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace palpate::falcon;
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
  try {
    const FirmwareImage image = parse_image({data, data + size}, "image.bin");
    if (image.bytes.size() != size || image.blocks < 1) std::abort();
  } catch (const palpate::InputError&) {
  }
  return 0;
}
