#pragma once
// The line to an emulated Falcon in this process, on a clock that tests advance.

#include <algorithm>
#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "runner/devices/falcon/transport.h"
#include "tests/runner/devices/falcon/emulator.h"

namespace palpate::runner::devices::falcon::testing {

class FakeTransport final : public Transport {
 public:
  explicit FakeTransport(Emulator& emulator, std::string serial = "FAKE0001")
      : emulator_(emulator), serial_(std::move(serial)) {}

  bool unplugged = false;
  int reopened = 0;

  const std::string& serial() const override { return serial_; }
  void control(std::uint8_t request, std::uint16_t value) override {
    if (unplugged) throw TransportError("unplugged");
    if (!emulator_.control_out(request, value)) throw TransportError("stalled");
  }
  void reopen() override {
    if (unplugged) throw TransportError("no Falcon " + serial_ + " is plugged in");
    ++reopened;
    gone_ = false;
    arrived_.clear();
  }
  bool send(std::span<const std::uint8_t> bytes) noexcept override {
    if (gone()) return false;
    emulator_.host_sends({bytes.begin(), bytes.end()}, now_);
    return true;
  }
  std::size_t receive(std::span<std::uint8_t> bytes, std::int64_t wait_ns) noexcept override {
    const std::int64_t end = now_ + wait_ns;
    collect();
    while (arrived_.empty() && now_ < end && !gone()) {
      now_ = std::min(end, now_ + 50'000);
      collect();
    }
    const std::size_t count = std::min(bytes.size(), arrived_.size());
    for (std::size_t i = 0; i < count; ++i) {
      bytes[i] = arrived_.front();
      arrived_.pop_front();
    }
    return count;
  }
  bool drain(std::int64_t /*wait_ns*/) noexcept override { return !gone(); }
  bool gone() const noexcept override { return gone_ || unplugged; }
  std::int64_t now_ns() noexcept override { return now_; }

  /// Lets time pass outside the driver.
  void wait(std::int64_t ns) { now_ += ns; }

 private:
  void collect() {
    gone_ = gone_ || unplugged;
    if (gone_) return;
    while (const auto packet = emulator_.in_packet(now_, 64)) {
      arrived_.insert(arrived_.end(), packet->begin() + 2, packet->end());
    }
  }

  Emulator& emulator_;
  std::string serial_;
  std::deque<std::uint8_t> arrived_;
  std::int64_t now_ = 1'000'000'000;
  bool gone_ = false;
};

}  // namespace palpate::runner::devices::falcon::testing
