// Cost of the pump of Haply's driver beside a bare loop: round trips of one message at a time to an
// emulated service, and the delay from a pose to its force of the driver at 1 kHz, in alternating
// runs, on an idle machine and with every processor busy.
//
// Usage: pump_latency [SECONDS=5]

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "runner/devices/haply/inverse3.h"
#include "runner/servo/realtime.h"
#include "tests/runner/devices/haply/emulated_service.h"

namespace palpate::runner {
namespace {

constexpr std::int64_t kTick_ns = 1'000'000, kExchange_ns = 250'000;  // the servo's, the pump's
constexpr std::int64_t kWarmUp_ns = 200'000'000;

/// Calls act(now, counts) every period. In a thread with the rights of a servo.
template <class Act>
void at_period(std::int64_t period, double seconds, const Act& act) {
  std::thread([&] {
    servo::request_realtime({});
    servo::RealClock clock;
    const std::int64_t began = clock.now_ns();
    const std::int64_t end = began + kWarmUp_ns + static_cast<std::int64_t>(seconds * 1e9);
    for (std::int64_t due = began; due < end;) {
      act(clock.now_ns() - began > kWarmUp_ns);
      due = std::max(due + period, clock.now_ns() - period);
      clock.wait_until(due);
    }
  }).join();
}

void print(const char* load, const char* what, std::vector<std::int64_t> ns) {
  std::sort(ns.begin(), ns.end());
  const auto at = [&ns](double share) {
    return static_cast<double>(
               ns[static_cast<std::size_t>(share * static_cast<double>(ns.size() - 1))]) /
           1000;
  };
  std::printf("%-6s %-44s %9.1f %9.1f %9.1f %9.1f\n", load, what, at(0.5), at(0.99), at(0.999),
              at(1));
}

void bare_loop(const std::string& service, const char* load, double seconds) {
  const auto link = devices::haply::connect(service);
  std::string_view message;
  link->receive(message, std::chrono::seconds(2));
  servo::RealClock clock;
  std::vector<std::int64_t> trips;
  at_period(kExchange_ns, seconds, [&](bool counts) {
    const std::int64_t began = clock.now_ns();
    link->send(devices::haply::command("049D", Vec3(0), devices::haply::Dialect::vector, false));
    while (!link->receive(message, std::chrono::seconds(2))) {
    }
    devices::haply::parse_state(message, "049D", "G1");
    if (counts) trips.push_back(clock.now_ns() - began);
  });
  print(load, "bare loop: round trip", std::move(trips));
}

void driver(const std::string& service, const char* load, double seconds) {
  servo::DeviceConfig config;
  config.service = service;
  devices::haply::Inverse3Device device(config);
  servo::RealClock clock;
  std::vector<std::int64_t> ages, waits, calls;
  std::int64_t wrote = 0;
  at_period(kTick_ns, seconds, [&](bool counts) {
    const std::int64_t began = clock.now_ns();
    device.read();
    const std::int64_t used = clock.now_ns();
    const servo::DeviceTimes times = device.times();
    if (counts) ages.push_back(used - times.pose_ns);
    if (counts && wrote > 0) waits.push_back(std::max(times.force_ns, wrote) - wrote);
    wrote = clock.now_ns();
    device.write(Vec3(0), Vec3(0));
    if (counts) calls.push_back(used - began + clock.now_ns() - wrote);
  });
  print(load, "driver: age of the pose at its use", std::move(ages));
  print(load, "driver: from a command until it is sent", std::move(waits));
  print(load, "driver: reading and writing, in the tick", std::move(calls));
}

int run(double seconds) {
  devices::testing::EmulatedService service;
  std::printf("%-6s %-44s %9s %9s %9s %9s\n", "load", "us", "median", "p99", "p99.9", "max");
  for (const bool busy : {false, true}) {
    std::atomic<bool> quit{false};
    std::vector<std::thread> work;
    for (unsigned i = 0; busy && i < std::thread::hardware_concurrency(); ++i)
      work.emplace_back([&quit] {
        while (!quit.load(std::memory_order_relaxed)) {
        }
      });
    for (int pair = 0; pair < 2; ++pair) {
      bare_loop(service.address(), busy ? "busy" : "idle", seconds);
      driver(service.address(), busy ? "busy" : "idle", seconds);
    }
    quit.store(true);
    for (std::thread& one : work) one.join();
  }
  return 0;
}

}  // namespace
}  // namespace palpate::runner

int main(int count, char** arguments) {
  return palpate::runner::run(count > 1 ? std::atof(arguments[1]) : 5);
}
