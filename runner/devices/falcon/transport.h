#pragma once
// The serial line to a Falcon, as its driver sees it: USB in falcon_usb.h, a fake with a virtual
// clock in the tests.

#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>

namespace palpate::runner::falcon {

/// The line cannot be used; what() says why and what would help.
class TransportError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Control requests of the USB-serial chip (bRequest); no data, index 0.
namespace request {
inline constexpr std::uint8_t kPurge = 0;    ///< 1 and 2: the two FIFOs
inline constexpr std::uint8_t kModem = 1;    ///< DTR and RTS
inline constexpr std::uint8_t kFlow = 2;     ///< 0: off
inline constexpr std::uint8_t kBaud = 3;     ///< divisor of 3 MHz
inline constexpr std::uint8_t kFormat = 4;   ///< 8: eight bits, no parity, one stop bit
inline constexpr std::uint8_t kEvent = 6;    ///< a character that is sent on at once; 0: none
inline constexpr std::uint8_t kLatency = 9;  ///< ms
}  // namespace request

inline constexpr std::uint16_t kDtrLow = 0x0100, kDtrHigh = 0x0101, kRtsLow = 0x0200;
inline constexpr std::uint16_t kBaudMonitor = 0x4138;  ///< 9600
inline constexpr std::uint16_t kBaudBoot = 0x0015;     ///< 142 857
inline constexpr std::uint16_t kBaudNormal = 0x0002;   ///< 1.5 M

/// '>' ends every reply: nothing waits for the latency timer, whose beat is not that of the servo.
/// libnifalcon does without, and has replies late by up to a tick.
inline constexpr std::uint16_t kEventReplyEnd = 0x0100 | 0x3E, kEventNone = 0;

class Transport {
 public:
  virtual ~Transport() = default;

  /// Names the device for good: its serial number, else where it is plugged in.
  virtual const std::string& serial() const = 0;
  /// A control request. Waits for it. \throws TransportError.
  virtual void control(std::uint8_t request, std::uint16_t value) = 0;
  /// Closes and opens the same device again. \throws TransportError.
  virtual void reopen() = 0;

  // The rest is what a tick may call: it never throws, and waits only when told to.

  /// Queues at most 64 bytes; false when the device is gone or too much is under way.
  virtual bool send(std::span<const std::uint8_t> bytes) noexcept = 0;
  /// What has come in since, without the chip's status bytes; waits up to `wait_ns` for the first
  /// byte. 0: nothing came.
  virtual std::size_t receive(std::span<std::uint8_t> bytes, std::int64_t wait_ns) noexcept = 0;
  /// Waits until all that was queued has left the computer, at most so long; false: it has not.
  virtual bool drain(std::int64_t wait_ns) noexcept = 0;
  /// Unplugged or failed; only reopen() helps.
  virtual bool gone() const noexcept = 0;
  /// Monotonic.
  virtual std::int64_t now_ns() noexcept = 0;
};

}  // namespace palpate::runner::falcon
