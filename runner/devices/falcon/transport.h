#pragma once
// The driver's interface to a Falcon's serial line: USB in usb.h, a fake with a virtual clock in
// tests.

#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>

namespace palpate::runner::devices::falcon {

/// The line cannot be used; what() gives the reason and the remedy.
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
inline constexpr std::uint8_t kEvent = 6;    ///< character that makes the chip send; 0: none
inline constexpr std::uint8_t kLatency = 9;  ///< ms
}  // namespace request

inline constexpr std::uint16_t kDtrLow = 0x0100, kDtrHigh = 0x0101, kRtsLow = 0x0200;
inline constexpr std::uint16_t kBaudMonitor = 0x4138;  ///< 9600
inline constexpr std::uint16_t kBaudBoot = 0x0015;     ///< 142 857
inline constexpr std::uint16_t kBaudNormal = 0x0002;   ///< 1.5 M

/// '>' ends every reply. As event character it makes the chip send at once, without waiting for its
/// latency timer. libnifalcon does not use it, so its replies are up to a tick late.
inline constexpr std::uint16_t kEventReplyEnd = 0x0100 | 0x3E, kEventNone = 0;

class Transport {
 public:
  virtual ~Transport() = default;

  /// Identifies the device: its serial number, else the USB port.
  virtual const std::string& serial() const = 0;
  /// Sends a control request and waits for its completion. \throws TransportError.
  virtual void control(std::uint8_t request, std::uint16_t value) = 0;
  /// Closes and opens the same device again. \throws TransportError.
  virtual void reopen() = 0;

  // The functions below may be called in a servo tick: they do not throw and wait at most
  // `wait_ns`.

  /// Queues at most 64 bytes; false: the device is gone or too many transfers are pending.
  virtual bool send(std::span<const std::uint8_t> bytes) noexcept = 0;
  /// Reads the bytes that have arrived, without the chip's status bytes; waits up to `wait_ns` for
  /// the first. \return 0: none
  virtual std::size_t receive(std::span<std::uint8_t> bytes, std::int64_t wait_ns) noexcept = 0;
  /// Waits up to `wait_ns` until all queued bytes have left the computer; false: they have not.
  virtual bool drain(std::int64_t wait_ns) noexcept = 0;
  /// Unplugged or failed; only reopen() helps.
  virtual bool gone() const noexcept = 0;
  /// Monotonic clock.
  virtual std::int64_t now_ns() noexcept = 0;
};

}  // namespace palpate::runner::devices::falcon
