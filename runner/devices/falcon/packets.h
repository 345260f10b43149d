#pragma once
// The 16-byte packets of the Falcon's normal mode, both ways: '<', three signed 16-bit numbers of
// four nibbles each (least significant first), a byte of bits, an unknown byte, '>'. No checksum.
// Pure functions over bytes: malformed input only increases a count.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace palpate::runner::devices::falcon {

using Packet = std::array<std::uint8_t, 16>;

/// Host to device. LED colours as in libnifalcon's code.
struct Command {
  std::array<int, 3> motors{};  ///< -4095 to 4095; clamped
  bool homing = true;           ///< must be set in every packet to start and keep homing
  bool green = false, blue = false, red = false;
};

/// Device to host.
struct Reply {
  std::array<int, 3> counts{};  ///< of the encoders, -32768 to 32767
  std::uint8_t buttons = 0;     ///< bit 0 far right, 1 front, 2 centre, 3 far left
  std::uint8_t homed = 0;       ///< a bit for each axis; 7: all have passed their index

  bool all_homed() const { return homed == 7; }
};

Packet encode(const Command& command) noexcept;
std::optional<Command> decode_command(const Packet& packet) noexcept;
Packet encode(const Reply& reply) noexcept;
std::optional<Reply> decode_reply(const Packet& packet) noexcept;

/// Finds packets in a byte stream that may split, join, truncate or garble them.
class PacketStream {
 public:
  /// Takes one byte; returns the packet that this byte completes, if any.
  std::optional<Packet> take(std::uint8_t byte) noexcept;
  /// Packets begun and discarded.
  std::uint64_t dropped() const noexcept { return dropped_; }
  void count_bad() noexcept { ++dropped_; }
  /// Discards an incomplete packet.
  void reset() noexcept {
    if (size_ > 0) ++dropped_;
    size_ = 0;
  }

 private:
  Packet packet_{};
  std::size_t size_ = 0;
  std::uint64_t dropped_ = 0;
};

inline constexpr std::size_t kMaxSerial = 32;  ///< characters

/// A serial number comes from the device, so it is untrusted text that is printed, stored and
/// compared with files. Keeps letters, digits, '.', '_' and '-', replaces others by '_', truncates
/// to kMaxSerial.
/// \return "": only blanks and zeros
std::string clean_serial(std::span<const std::uint8_t> text);

}  // namespace palpate::runner::devices::falcon
