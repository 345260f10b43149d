#include "runner/bench/chain_timing.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <thread>
#include <utility>

#include "data/files/utc.h"
#include "runner/safety/guarded_device.h"
#include "runner/safety/shared_memory.h"
#include "runner/servo/device_times.h"
#include "runner/servo/realtime.h"

namespace palpate::runner {
namespace {

constexpr double kWarmUp = 0.2;  // s, not counted

/// Written by the guard process, read by this one.
struct SharedTimes {
  std::atomic<std::int64_t> pose_ns{0}, force_ns{0};
  std::atomic<bool> known{false};  ///< the device keeps its times
};

/// In the guard process: shares the device's times with the runner.
class TimedDevice final : public Device {
 public:
  TimedDevice(std::unique_ptr<Device> device, SharedTimes& shared)
      : device_(std::move(device)),
        times_(dynamic_cast<const KeepsTimes*>(device_.get())),
        shared_(shared) {
    shared_.known.store(times_ != nullptr);
  }
  const DeviceCapabilities& capabilities() const override { return device_->capabilities(); }
  DeviceReading read() noexcept override {
    DeviceReading reading = device_->read();
    if (times_ != nullptr) {
      const DeviceTimes times = times_->times();
      shared_.pose_ns.store(times.pose_ns);
      shared_.force_ns.store(times.force_ns);
    }
    return reading;
  }
  void write(const Vec3& device1, const Vec3& device2) noexcept override {
    device_->write(device1, device2);
  }
  void reopen() override { device_->reopen(); }

 private:
  std::unique_ptr<Device> device_;
  const KeepsTimes* times_;
  SharedTimes& shared_;
};

Percentiles percentiles(std::vector<std::int64_t> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const auto at = [&values](double share) {
    const auto rank = std::ceil(share * static_cast<double>(values.size()));
    return values[static_cast<std::size_t>(std::max(rank, 1.0)) - 1];
  };
  return {at(0.5), at(0.99), at(0.999), values.back()};
}

/// Of each counted tick, ns.
struct ChainTicks {
  std::vector<std::int64_t> readings, ages, waits, delays;
};

/// Reads and writes the device at its rate, with the rights of a servo thread.
void run_chain(GuardedDevice& device, const SharedTimes& shared, double rate, double seconds,
               ChainTicks& ticks, ChainTiming& out) {
  request_realtime({});
  RealClock clock;
  const auto period = static_cast<std::int64_t>(1e9 / rate);
  const auto warm_up = static_cast<std::uint64_t>(kWarmUp * rate);
  const auto last = warm_up + static_cast<std::uint64_t>(seconds * rate);
  for (auto* const values : {&ticks.readings, &ticks.ages, &ticks.waits, &ticks.delays})
    values->reserve(last);
  std::int64_t due = clock.now_ns(), wrote_ns = 0, age = 0;
  for (std::uint64_t tick = 0; tick < last; ++tick) {
    due = std::max(due + period, clock.now_ns() - period);
    clock.wait_until(due);
    const std::int64_t began = clock.now_ns();
    const DeviceReading reading = device.read();
    const std::int64_t used = clock.now_ns();
    const bool counts = tick >= warm_up;
    if (counts) {
      ++out.ticks;
      ticks.readings.push_back(used - began);
      // The force of the tick before.
      if (wrote_ns > 0) {
        const bool sent = shared.force_ns.load() >= wrote_ns;
        if (!sent) ++out.unsent;
        ticks.waits.push_back((sent ? shared.force_ns.load() : used) - wrote_ns);
        ticks.delays.push_back(age + ticks.waits.back());
      }
    }
    if (reading.lost) {
      if (counts) ++out.lost;
      wrote_ns = 0;
    } else {
      if (counts && reading.trouble == DeviceTrouble::late) ++out.late;
      age = used - shared.pose_ns.load();
      if (counts) ticks.ages.push_back(age);
      wrote_ns = clock.now_ns();
    }
    device.write(Vec3(0), Vec3(0));
  }
}

}  // namespace

ChainTiming measure_chain(const DeviceKind& kind, const DeviceConfig& config, double seconds) {
  const SharedMemory<SharedTimes> memory;
  SharedTimes& shared = *memory;
  GuardSettings settings;
  settings.rate = config.rate;
  GuardedDevice device(
      [&kind, &config, &shared]() -> std::unique_ptr<Device> {
        return std::make_unique<TimedDevice>(kind.open(config), shared);
      },
      settings);
  if (!shared.known.load())
    throw std::runtime_error(
        std::string(kind.name) +
        " does not report when it senses and pushes: its chain cannot be measured");
  ChainTiming out;
  ChainTicks ticks;
  // A thread of its own: the caller keeps its ordinary priority.
  std::thread([&] { run_chain(device, shared, config.rate, seconds, ticks, out); }).join();
  if (ticks.ages.empty())
    throw std::runtime_error(std::string(kind.name) +
                             " gave no pose: " + advice(device.read().trouble));
  out.device = kind.name;
  out.serial = device.capabilities().serial;
  out.rate = config.rate;
  out.reading = percentiles(std::move(ticks.readings));
  out.age = percentiles(std::move(ticks.ages));
  out.wait = percentiles(std::move(ticks.waits));
  out.delay = percentiles(std::move(ticks.delays));
  out.made_utc = data::format_utc(std::chrono::system_clock::now().time_since_epoch() /
                                  std::chrono::nanoseconds(1));
  return out;
}

}  // namespace palpate::runner
