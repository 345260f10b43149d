#include "runner/devices/self_test.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <glm/geometric.hpp>
#include <optional>

#include "runner/servo/realtime.h"

namespace palpate::runner::devices {
namespace {

/// Statistics over a second of readings.
struct Readings {
  int ticks = 0, lost = 0, late = 0, not_finite = 0;
  servo::DeviceTrouble trouble = servo::DeviceTrouble::none;
  double furthest = 0;       ///< m, of tip or tail from the centre
  double largest_step = 0;   ///< m, of the tip between two readings
  std::uint8_t buttons = 0;  ///< pressed at any time
};

Readings read_for_a_second(servo::Device& device, double rate) {
  servo::RealClock clock;
  Readings out;
  const auto period_ns = static_cast<std::int64_t>(1e9 / rate);
  std::optional<Vec3> last;
  std::int64_t due = clock.now_ns();
  for (; out.ticks < rate; ++out.ticks, due += period_ns) {
    clock.wait_until(due);
    const servo::DeviceReading reading = device.read();
    device.write(Vec3(0), Vec3(0));
    if (reading.trouble == servo::DeviceTrouble::late) ++out.late;
    if (reading.lost) {
      ++out.lost;
      out.trouble = reading.trouble;
      last.reset();
      continue;
    }
    const rendering::LineProbe& stylus = reading.stylus;
    if (!finite(stylus.tip) || !finite(stylus.tail)) {
      ++out.not_finite;
      continue;
    }
    if (last) out.largest_step = std::max(out.largest_step, glm::length(stylus.tip - *last));
    last = stylus.tip;
    out.furthest = std::max(out.furthest, glm::length(stylus.tip));
    out.buttons |= reading.buttons;
  }
  return out;
}

std::string text(const char* format, double a, double b) {
  char out[160];
  std::snprintf(out, sizeof out, format, a, b);
  return out;
}

}  // namespace

std::vector<SelfTestResult> self_test(servo::Device& device, double rate) {
  constexpr double kTopSpeed = 2;  // m/s, of a hand
  const servo::DeviceCapabilities& can = device.capabilities();
  const double at = std::min(rate, can.max_rate);
  const Readings r = read_for_a_second(device, at);
  std::vector<SelfTestResult> out;
  std::string lost = text("%.0f of %.0f readings were lost", r.lost, r.ticks);
  if (r.lost > 0 && r.trouble != servo::DeviceTrouble::none) {
    lost += ": ";
    lost += servo::advice(r.trouble);
  }
  out.push_back({"readings arrive", r.lost == 0, lost});
  out.push_back({"readings arrive in time", r.late <= at / 100,
                 text("%.0f of %.0f were late", r.late, r.ticks)});
  out.push_back({"positions are finite", r.not_finite == 0,
                 text("%.0f of %.0f were not", r.not_finite, r.ticks)});
  if (r.lost + r.not_finite < r.ticks) {
    out.push_back({"positions are within reach", r.furthest <= can.workspace_radius + 0.05,
                   text("up to %.1f mm from the centre; it reaches %.1f mm", r.furthest * 1e3,
                        can.workspace_radius * 1e3)});
    out.push_back({"positions do not jump", r.largest_step <= kTopSpeed / at + 4 * can.resolution,
                   text("largest step %.3f mm; a hand moves at most %.1f mm a reading",
                        r.largest_step * 1e3, kTopSpeed / at * 1e3)});
  }
  return out;
}

}  // namespace palpate::runner::devices
