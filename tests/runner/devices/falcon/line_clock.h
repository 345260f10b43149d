#pragma once

#include "runner/servo/device.h"
#include "tests/runner/devices/falcon/fake_transport.h"

namespace palpate::runner::devices::falcon::testing {

/// The line's own time.
class LineClock final : public servo::Clock {
 public:
  explicit LineClock(FakeTransport& line) : line_(line) {}
  std::int64_t now_ns() noexcept override { return line_.now_ns(); }
  void wait_until(std::int64_t when_ns) noexcept override {
    if (when_ns > line_.now_ns()) line_.wait(when_ns - line_.now_ns());
  }

 private:
  FakeTransport& line_;
};

}  // namespace palpate::runner::devices::falcon::testing
