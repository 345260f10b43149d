#include "runner/devices/falcon/packets.h"

#include <algorithm>

#include "runner/devices/falcon/parameters.h"

namespace palpate::runner::devices::falcon {
namespace {

constexpr std::uint8_t kBegin = '<', kEnd = '>', kZero = 'A';
// Bits of byte 13, host to device.
constexpr unsigned kHoming = 1, kGreen = 2, kBlue = 4, kRed = 8;

Packet frame(const std::array<int, 3>& numbers, unsigned bits) noexcept {
  Packet packet;
  packet.fill(kZero);
  packet[0] = kBegin;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto number = static_cast<unsigned>(numbers[i]);
    for (std::size_t nibble = 0; nibble < 4; ++nibble) {
      packet[1 + 4 * i + nibble] =
          static_cast<std::uint8_t>(kZero + ((number >> (4 * nibble)) & 15U));
    }
  }
  packet[13] = static_cast<std::uint8_t>(kZero + bits);
  packet[15] = kEnd;
  return packet;
}

struct Content {
  std::array<int, 3> numbers;
  unsigned bits;
};

std::optional<Content> open(const Packet& packet, unsigned max_bits) noexcept {
  if (packet[0] != kBegin || packet[15] != kEnd) return std::nullopt;
  Content content{};
  for (std::size_t i = 0; i < 3; ++i) {
    unsigned number = 0;
    for (std::size_t nibble = 0; nibble < 4; ++nibble) {
      const unsigned value = packet[1 + 4 * i + nibble] - unsigned{kZero};  // wraps below 'A'
      if (value > 15) return std::nullopt;
      number |= value << (4 * nibble);
    }
    content.numbers[i] = static_cast<std::int16_t>(static_cast<std::uint16_t>(number));
  }
  content.bits = packet[13] - unsigned{kZero};
  if (content.bits > max_bits) return std::nullopt;
  return content;
}

}  // namespace

Packet encode(const Command& command) noexcept {
  std::array<int, 3> motors{};
  for (std::size_t i = 0; i < 3; ++i) {
    motors[i] = std::clamp(command.motors[i], -kMaxCount, kMaxCount);
  }
  return frame(motors, (command.homing ? kHoming : 0) | (command.green ? kGreen : 0) |
                           (command.blue ? kBlue : 0) | (command.red ? kRed : 0));
}

std::optional<Command> decode_command(const Packet& packet) noexcept {
  const auto content = open(packet, 15);
  if (!content) return std::nullopt;
  return Command{content->numbers, (content->bits & kHoming) != 0, (content->bits & kGreen) != 0,
                 (content->bits & kBlue) != 0, (content->bits & kRed) != 0};
}

Packet encode(const Reply& reply) noexcept {
  return frame(reply.counts, (reply.buttons & 15U) | ((reply.homed & 7U) << 4));
}

std::optional<Reply> decode_reply(const Packet& packet) noexcept {
  const auto content = open(packet, 127);
  if (!content) return std::nullopt;
  return Reply{content->numbers, static_cast<std::uint8_t>(content->bits & 15U),
               static_cast<std::uint8_t>(content->bits >> 4)};
}

std::optional<Packet> PacketStream::take(std::uint8_t byte) noexcept {
  // '<' is used for framing only: inside a packet it shows that the packet was truncated.
  if (byte == kBegin) {
    if (size_ > 0) ++dropped_;
    size_ = 0;
  } else if (size_ == 0) {
    return std::nullopt;  // not part of a packet
  }
  packet_[size_++] = byte;
  if (size_ < packet_.size()) return std::nullopt;
  size_ = 0;
  if (byte != kEnd) {
    ++dropped_;
    return std::nullopt;
  }
  return packet_;
}

std::string clean_serial(std::span<const std::uint8_t> text) {
  std::string clean;
  bool any = false;
  for (const std::uint8_t byte : text.first(std::min(text.size(), kMaxSerial))) {
    if (byte == 0) break;
    const bool plain = (byte >= '0' && byte <= '9') || (byte >= 'A' && byte <= 'Z') ||
                       (byte >= 'a' && byte <= 'z') || byte == '.' || byte == '_' || byte == '-';
    any = any || byte != ' ';
    clean += plain ? static_cast<char>(byte) : '_';
  }
  return any ? clean : "";
}

}  // namespace palpate::runner::devices::falcon
