#include "runner/station/servo_timing.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <memory>
#include <stdexcept>
#include <thread>
#include <utility>

#include "data/files/utc.h"
#include "runner/safety/guarded_device.h"
#include "runner/safety/shared_memory.h"
#include "runner/servo/servo_thread.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/primitives.h"

namespace palpate::runner::station {
namespace {

constexpr double kRadius = 0.03;             // m
constexpr double kLength = 0.12;             // m, of the stylus
constexpr double kSpeed = 0.1;               // m/s, of the tip
constexpr double kHomeRest = 0.02;           // s of rest that the servo requires
constexpr double kMaxLateFit = 2e-4;         // share of ticks late by a period: one in 5 s at 1 kHz
constexpr double kMaxLateWithLosses = 2e-3;  // the same; more can be felt
constexpr int kTrippingRun = 5;              // missed ticks in a row that switch forces off

constexpr double kUncounted = 0.2;  // s, at the start of a device's measurement

std::int64_t thread_time_ns() noexcept {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return time.tv_sec * 1'000'000'000LL + time.tv_nsec;
}

using Go = safety::SharedMemory<std::atomic<bool>>;

/// Rests outside the sphere until forces are on, then follows a path on it, 1.5 mm deep, while
/// turning.
class ScriptedStylus final : public servo::Device {
 public:
  ScriptedStylus(double rate, const std::atomic<bool>& go) : rate_(rate), go_(go) {
    capabilities_.name = "led";
    capabilities_.sensed_freedom = capabilities_.actuated_freedom = 5;
    capabilities_.max_force = 8.5;
    capabilities_.max_rate = rate;
  }
  const servo::DeviceCapabilities& capabilities() const override { return capabilities_; }
  servo::DeviceReading read() noexcept override {
    if (!go_.load(std::memory_order_relaxed)) return at({0, 0, 0.1}, 0);
    const double t = ++tick_ / rate_;
    const double angle = t * kSpeed / kRadius;
    const double depth = 0.0015 * std::min(1.0, t / 0.1);
    const Vec3 out(std::sin(angle) * std::cos(0.3 * angle), std::sin(0.3 * angle) * std::sin(angle),
                   std::cos(angle));
    return at((kRadius - depth) * out, angle);
  }
  void write(const Vec3&, const Vec3&) noexcept override {}

 private:
  servo::DeviceReading at(const Vec3& tip, double angle) const noexcept {
    // The axis swings between the surface normal and the tangent.
    const Vec3 out = tip / std::sqrt(tip.x * tip.x + tip.y * tip.y + tip.z * tip.z);
    const double lean = 1.2 * std::sin(0.7 * angle) * std::sin(0.7 * angle);
    const Vec3 side(-out.y, out.x, 0);
    Vec3 axis = std::cos(lean) * out + std::sin(lean) * side;
    axis /= std::sqrt(axis.x * axis.x + axis.y * axis.y + axis.z * axis.z);
    return {{tip, tip + kLength * axis}, 0, false};
  }

  double rate_;
  const std::atomic<bool>& go_;
  int tick_ = 0;
  servo::DeviceCapabilities capabilities_;
};

/// Wraps a device and records the servo thread's CPU time before and after its transfers.
class MeteredDevice final : public servo::Device {
 public:
  /// \param go  whether ticks are recorded; \param ticks  largest number of recorded ticks
  MeteredDevice(servo::Device& device, const std::atomic<bool>& go, std::size_t ticks)
      : device_(device), go_(go) {
    compute_.reserve(ticks);
    tick_.reserve(ticks);
    asking_.reserve(ticks);
  }
  const servo::DeviceCapabilities& capabilities() const override { return device_.capabilities(); }
  servo::DeviceReading read() noexcept override {
    const std::int64_t began = thread_time_ns();
    if (recording_ && tick_.size() < tick_.capacity())
      tick_.push_back(began - written_ + last_compute_);
    servo::DeviceReading reading = device_.read();
    read_ = thread_time_ns();
    return reading;
  }
  void write(const Vec3& device1, const Vec3& device2) noexcept override {
    last_compute_ = thread_time_ns() - read_;
    recording_ = go_.load(std::memory_order_relaxed);
    if (recording_ && compute_.size() < compute_.capacity()) {
      compute_.push_back(last_compute_);
    }
    device_.write(device1, device2);
    const std::int64_t asked = thread_time_ns();
    written_ = thread_time_ns();
    if (asking_.size() < asking_.capacity()) asking_.push_back(written_ - asked);
  }
  /// CPU time of one query of the CPU clock.
  const std::vector<std::int64_t>& asking() const { return asking_; }
  const std::vector<std::int64_t>& compute() const { return compute_; }
  /// CPU time from one command to the next, without the device's transfers.
  const std::vector<std::int64_t>& whole() const { return tick_; }

 private:
  servo::Device& device_;
  const std::atomic<bool>& go_;
  bool recording_ = false;
  std::int64_t read_ = 0, written_ = 0, last_compute_ = 0;
  std::vector<std::int64_t> compute_, tick_, asking_;
};

std::int64_t quantile(const std::vector<std::int64_t>& sorted, double p) {
  if (sorted.empty()) return 0;
  const double rank = std::ceil(p * static_cast<double>(sorted.size()));
  return sorted[static_cast<std::size_t>(std::clamp(rank, 1.0, static_cast<double>(sorted.size())) -
                                         1)];
}

std::vector<std::int64_t> sorted(std::vector<std::int64_t> values) {
  std::sort(values.begin(), values.end());
  return values;
}

/// One long trial; records every tick with forces on.
void run_trial(servo::ServoThread& servo, double rate, std::size_t wanted,
               const std::function<bool()>& wait, std::atomic<bool>& go, ServoTiming& out,
               std::vector<std::int64_t>& compute, std::vector<std::int64_t>& warm_up) {
  const rendering::Scene scene(
      {{std::make_shared<const stimuli::ConvexMesh>(stimuli::icosphere(kRadius, 3)), Pose{},
        stimuli::Material{}, 0, nullptr}});
  const auto period_ns = static_cast<std::int64_t>(1e9 / rate);
  servo.prepare(scene, rendering::ray_renderer(), {2 * kRadius, kHomeRest, 0.005});
  auto shown = std::chrono::steady_clock::now();
  int run = 0;
  bool tripped = false;
  while (out.lateness.size() < wanted) {
    const servo::Sample& sample = servo.next();
    if (sample.faults & servo::servo_fault::kStalled) break;
    const bool trips = (sample.faults & servo::servo_fault::kTripped) != 0;
    if (trips && !tripped) {
      ++out.trips;
      servo.clear_fault();
    }
    tripped = trips;
    if (sample.phase != servo::Phase::feeling) continue;
    go.store(true, std::memory_order_relaxed);
    out.lateness.push_back(sample.lateness_ns);
    compute.push_back(sample.compute_ns);
    warm_up.push_back(sample.warm_up_ns);
    const auto missed = sample.lateness_ns / period_ns;
    out.missed_ticks += static_cast<std::uint64_t>(missed);
    run = missed > 0 ? run + static_cast<int>(missed) : 0;
    out.worst_run = std::max(out.worst_run, run);
    out.old_readings += (sample.faults & servo::servo_fault::kOldReading) != 0 ? 1 : 0;
    const auto now = std::chrono::steady_clock::now();
    if (!wait || now - shown < std::chrono::milliseconds(200)) continue;
    shown = now;
    if (wait()) break;
  }
}

/// Written by the guard process, read by this one.
struct SharedTimes {
  std::atomic<std::int64_t> pose_ns{0}, force_ns{0};
};

/// In the guard process: shares the device's times with the runner.
class TimedDevice final : public servo::Device {
 public:
  TimedDevice(std::unique_ptr<servo::Device> device, SharedTimes& shared)
      : device_(std::move(device)), shared_(shared) {}
  const servo::DeviceCapabilities& capabilities() const override { return device_->capabilities(); }
  servo::DeviceReading read() noexcept override {
    servo::DeviceReading reading = device_->read();
    const servo::DeviceTimes times = device_->times();
    shared_.pose_ns.store(times.pose_ns);
    shared_.force_ns.store(times.force_ns);
    return reading;
  }
  void write(const Vec3& device1, const Vec3& device2) noexcept override {
    device_->write(device1, device2);
  }
  void reopen() override { device_->reopen(); }

 private:
  std::unique_ptr<servo::Device> device_;
  SharedTimes& shared_;
};

devices::Percentiles percentiles(std::vector<std::int64_t> values) {
  values = sorted(std::move(values));
  return {quantile(values, 0.5), quantile(values, 0.99), quantile(values, 0.999),
          quantile(values, 1)};
}

/// Of each counted tick, ns.
struct ChainTicks {
  std::vector<std::int64_t> readings, ages, waits, delays;
};

/// Reads and writes the device at its rate, with the rights of a servo thread.
void run_chain(safety::GuardedDevice& device, const SharedTimes& shared, double rate,
               double seconds, ChainTicks& ticks, devices::ChainTiming& out) {
  servo::request_realtime({});
  servo::RealClock clock;
  const auto period = static_cast<std::int64_t>(1e9 / rate);
  const auto warm_up = static_cast<std::uint64_t>(kUncounted * rate);
  const auto last = warm_up + static_cast<std::uint64_t>(seconds * rate);
  for (auto* const values : {&ticks.readings, &ticks.ages, &ticks.waits, &ticks.delays})
    values->reserve(last);
  std::int64_t due = clock.now_ns(), wrote_ns = 0, age = 0;
  for (std::uint64_t tick = 0; tick < last; ++tick) {
    due = std::max(due + period, clock.now_ns() - period);
    clock.wait_until(due);
    const std::int64_t began = clock.now_ns();
    const servo::DeviceReading reading = device.read();
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
      if (counts && reading.trouble == servo::DeviceTrouble::late) ++out.late;
      age = used - shared.pose_ns.load();
      if (counts) ticks.ages.push_back(age);
      wrote_ns = clock.now_ns();
    }
    device.write(Vec3(0), Vec3(0));
  }
}

}  // namespace

ServoTiming measure_servo(const TimingSettings& settings, const std::function<bool()>& wait) {
  const double rate = settings.rate;
  const auto wanted = static_cast<std::size_t>(std::llround(settings.seconds * rate));
  const Go go;
  go->store(false);
  ScriptedStylus own(rate, *go);
  std::unique_ptr<safety::GuardedDevice> guarded;
  if (settings.guarded) {
    safety::GuardSettings guard;
    guard.rate = rate;
    guard.priority = settings.realtime.priority > 0 ? settings.realtime.priority + 5 : 0;
    guarded = std::make_unique<safety::GuardedDevice>(
        [rate, &go] { return std::make_unique<ScriptedStylus>(rate, *go); }, guard);
  }
  MeteredDevice device(guarded ? static_cast<servo::Device&>(*guarded) : own, *go, wanted);
  servo::RealClock clock;
  servo::ServoSettings servo_settings;
  servo_settings.rate = rate;
  servo_settings.realtime = settings.realtime;
  ServoTiming out;
  out.rate = rate;
  out.lateness.reserve(wanted);
  std::vector<std::int64_t> by_clock, warm_up;
  by_clock.reserve(wanted);
  warm_up.reserve(wanted);
  {
    servo::ServoThread servo(device, clock, servo_settings);
    out.rights = servo.rights();
    run_trial(servo, rate, wanted, wait, *go, out, by_clock, warm_up);
  }
  std::sort(out.lateness.begin(), out.lateness.end());
  out.ticks = out.lateness.size();
  out.lateness_median = quantile(out.lateness, 0.5);
  out.lateness_p99 = quantile(out.lateness, 0.99);
  out.lateness_p999 = quantile(out.lateness, 0.999);
  out.lateness_max = quantile(out.lateness, 1);
  const auto period_ns = static_cast<std::int64_t>(1e9 / rate);
  const auto late =
      out.lateness.end() - std::upper_bound(out.lateness.begin(), out.lateness.end(), period_ns);
  if (out.ticks > 0) out.late_fraction = static_cast<double>(late) / static_cast<double>(out.ticks);
  const auto compute = sorted(device.compute()), whole = sorted(device.whole());
  out.asking_median = quantile(sorted(device.asking()), 0.5);
  by_clock = sorted(std::move(by_clock));
  warm_up = sorted(std::move(warm_up));
  out.warm_up_median = quantile(warm_up, 0.5);
  out.warm_up_p999 = quantile(warm_up, 0.999);
  out.warm_up_max = quantile(warm_up, 1);
  out.clock_median = quantile(by_clock, 0.5);
  out.clock_p999 = quantile(by_clock, 0.999);
  out.clock_max = quantile(by_clock, 1);
  out.compute_median = quantile(compute, 0.5);
  out.compute_p999 = quantile(compute, 0.999);
  out.compute_max = quantile(compute, 1);
  out.tick_median = quantile(whole, 0.5);
  out.tick_p999 = quantile(whole, 0.999);
  out.tick_max = quantile(whole, 1);
  return out;
}

ServoTiming::Verdict ServoTiming::verdict() const {
  if (ticks == 0 || trips > 0 || worst_run >= kTrippingRun || late_fraction > kMaxLateWithLosses)
    return Verdict::unfit;
  return late_fraction > kMaxLateFit ? Verdict::fit_with_losses : Verdict::fit;
}

std::string ServoTiming::sentence() const {
  if (ticks == 0) return "The servo gave no ticks: this machine is not fit for the experiment.";
  const char* const words[] = {"fit", "fit, with losses,", "not fit"};
  char text[400];
  std::snprintf(
      text, sizeof text,
      "This machine is %s for the experiment at %g Hz: of %llu ticks %llu were missed, at "
      "most %d in a row (%d in a row cut the forces off, which happened %llu times), and 99.9 %% "
      "began at most %.0f us late.",
      words[static_cast<int>(verdict())], rate, static_cast<unsigned long long>(ticks),
      static_cast<unsigned long long>(missed_ticks), worst_run, kTrippingRun,
      static_cast<unsigned long long>(trips), static_cast<double>(lateness_p999) / 1000);
  return text + (rights.missing.empty() ? "" : " " + rights.missing);
}

devices::ChainTiming measure_chain(const devices::DeviceKind& kind,
                                   const servo::DeviceConfig& config, double seconds) {
  const safety::SharedMemory<SharedTimes> memory;
  SharedTimes& shared = *memory;
  safety::GuardSettings settings;
  settings.rate = config.rate;
  safety::GuardedDevice device(
      [&kind, &config, &shared]() -> std::unique_ptr<servo::Device> {
        return std::make_unique<TimedDevice>(kind.open(config), shared);
      },
      settings);
  devices::ChainTiming out;
  ChainTicks ticks;
  // A thread of its own: the caller keeps its ordinary priority.
  std::thread([&] { run_chain(device, shared, config.rate, seconds, ticks, out); }).join();
  if (ticks.ages.empty())
    throw std::runtime_error(std::string(kind.name) +
                             " gave no pose: " + servo::advice(device.read().trouble));
  if (shared.pose_ns.load() == 0)
    throw std::runtime_error(std::string(kind.name) +
                             " does not report when it senses and pushes: its delay cannot be "
                             "measured");
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

}  // namespace palpate::runner::station
