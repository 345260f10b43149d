#include "runner/session/sample_stream.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <vector>

#include "runner/servo/realtime.h"
#include "runner/servo/ring.h"
#include "runner/session/lsl_library.h"

namespace palpate::runner::session {

// The types of SampleStream::Sender's members must not be in an anonymous namespace.
namespace lsl {

/// The values of one tick: tip, tail (m), force (N), torque (N m), device1, device2 (N), depth (m),
/// contacts; a stored sample has the same values under the same names.
struct SampleRow {
  std::int64_t time_ns = 0;  ///< session clock
  std::array<double, 20> values{};
};

}  // namespace lsl

namespace {

constexpr std::chrono::milliseconds kChunk(20);
constexpr double kRingSeconds = 4;  // a longer stall means worse trouble
constexpr double kSecondsPerNs = 1e-9;

/// A channel of the stream, as in its description.
struct StreamChannel {
  const char *label, *unit, *type;
};

constexpr std::array<StreamChannel, 20> kChannels = {{
    {"tip_x", "m", "Position"},    {"tip_y", "m", "Position"},    {"tip_z", "m", "Position"},
    {"tail_x", "m", "Position"},   {"tail_y", "m", "Position"},   {"tail_z", "m", "Position"},
    {"force_x", "N", "Force"},     {"force_y", "N", "Force"},     {"force_z", "N", "Force"},
    {"torque_x", "N m", "Torque"}, {"torque_y", "N m", "Torque"}, {"torque_z", "N m", "Torque"},
    {"device1_x", "N", "Force"},   {"device1_y", "N", "Force"},   {"device1_z", "N", "Force"},
    {"device2_x", "N", "Force"},   {"device2_y", "N", "Force"},   {"device2_z", "N", "Force"},
    {"depth", "m", "Depth"},       {"contacts", "1", "Count"},
}};

lsl::SampleRow stream_row(const servo::Sample& sample) noexcept {
  lsl::SampleRow row{sample.time_ns, {}};
  std::size_t at = 0;
  for (const Vec3& vector : {sample.probe.tip, sample.probe.tail, sample.rendering.force,
                             sample.rendering.torque, sample.device1, sample.device2}) {
    for (int i = 0; i < 3; ++i) row.values[at++] = vector[i];
  }
  row.values[at++] = sample.rendering.deepest.depth;
  row.values[at] = servo::recorded_contacts(sample.rendering.contacts);
  return row;
}

std::string stream_name(const std::string& where) {
  if (where == "lsl") return "palpate-samples";
  if (where.starts_with("lsl:") && where.size() > 4) return where.substr(4);
  throw std::invalid_argument("no stream to '" + where + "'; expected lsl or lsl:NAME");
}

}  // namespace

namespace lsl {

class SampleOutlet {
 public:
  SampleOutlet(const std::string& name, double rate) : library_("stream to lsl") {
    void* (*create_info)(const char*, const char*, std::int32_t, double, int, const char*) =
        nullptr;
    void* (*create_outlet)(void*, std::int32_t, std::int32_t) = nullptr;
    library_.find(create_info, "lsl_create_streaminfo");
    library_.find(create_outlet, "lsl_create_outlet");
    library_.find(push_, "lsl_push_chunk_dtn");
    library_.find(clock_, "lsl_local_clock");
    library_.find(destroy_outlet_, "lsl_destroy_outlet");
    library_.find(destroy_info_, "lsl_destroy_streaminfo");
    constexpr int kDouble = 2;  // cft_double64
    info_ = create_info(name.c_str(), "Haptics", static_cast<std::int32_t>(kChannels.size()), rate,
                        kDouble, ("palpate-" + name).c_str());
    if (info_ == nullptr) library_.fail("liblsl gave no stream");
    describe();
    constexpr std::int32_t kBuffered = 360;  // s, for a disconnected receiver
    const auto chunk = static_cast<std::int32_t>(
        std::lround(rate * std::chrono::duration<double>(kChunk).count()));
    outlet_ = create_outlet(info_, std::max(chunk, 1), kBuffered);
    if (outlet_ == nullptr) {
      destroy_info_(info_);
      library_.fail("liblsl gave no stream");
    }
  }
  SampleOutlet(const SampleOutlet&) = delete;
  SampleOutlet& operator=(const SampleOutlet&) = delete;
  ~SampleOutlet() {
    destroy_outlet_(outlet_);
    destroy_info_(info_);
  }

  /// False: the rows were not taken.
  bool push(const std::vector<double>& values, const std::vector<double>& times) noexcept {
    return push_(outlet_, values.data(), values.size(), times.data()) == 0;
  }
  /// s
  double now() const noexcept { return clock_(); }

 private:
  /// Describes the channels as XDF's specification requires: desc/channels/channel with label, unit
  /// and type.
  void describe() {
    void* (*description)(void*) = nullptr;
    void* (*append)(void*, const char*) = nullptr;
    void* (*append_value)(void*, const char*, const char*) = nullptr;
    library_.find(description, "lsl_get_desc");
    library_.find(append, "lsl_append_child");
    library_.find(append_value, "lsl_append_child_value");
    void* const channels = append(description(info_), "channels");
    for (const StreamChannel& one : kChannels) {
      void* const channel = append(channels, "channel");
      append_value(channel, "label", one.label);
      append_value(channel, "unit", one.unit);
      append_value(channel, "type", one.type);
    }
  }

  const LslLibrary library_;
  std::int32_t (*push_)(void*, const double*, unsigned long, const double*) = nullptr;
  double (*clock_)() = nullptr;
  void (*destroy_outlet_)(void*) = nullptr;
  void (*destroy_info_)(void*) = nullptr;
  void* info_ = nullptr;
  void* outlet_ = nullptr;
};

}  // namespace lsl

/// The ring and the thread that empties it.
class SampleStream::Sender {
 public:
  Sender(const std::string& name, double rate)
      : outlet_(name, rate),
        ring_(static_cast<std::size_t>(rate * kRingSeconds)),
        thread_([this] { work(); }) {}
  Sender(const Sender&) = delete;
  Sender& operator=(const Sender&) = delete;
  ~Sender() {
    {
      const std::lock_guard lock(mutex_);
      quit_ = true;
    }
    quits_.notify_one();
  }

  void push(const servo::Sample& sample) noexcept {
    if (!ring_.push(stream_row(sample))) ++dropped_;
  }
  std::uint64_t dropped() const noexcept { return dropped_.load(); }

 private:
  void work() noexcept {
    std::unique_lock lock(mutex_);
    bool last = false;
    while (!last) {
      last = quits_.wait_for(lock, kChunk, [this] { return quit_; });
      lock.unlock();
      send();
      lock.lock();
    }
  }

  /// s, liblsl's clock less the session's. Takes the quickest of several readings: a thread that
  /// loses the processor between the two clocks would measure a false difference.
  double seconds_ahead() noexcept {
    constexpr int kLooks = 5;
    std::int64_t quickest = std::numeric_limits<std::int64_t>::max();
    double ahead = 0;
    for (int i = 0; i < kLooks; ++i) {
      const std::int64_t before = clock_.now_ns();
      const double there = outlet_.now();
      const std::int64_t took = clock_.now_ns() - before;
      if (took >= quickest) continue;
      quickest = took;
      const std::int64_t middle = before + took / 2;
      ahead = there - static_cast<double>(middle) * kSecondsPerNs;
    }
    return ahead;
  }

  /// Sends all new rows, stamped with the ticks' own times, because liblsl's clock may differ from
  /// the session's.
  void send() noexcept {
    try {
      values_.clear();
      times_.clear();
      const double ahead = seconds_ahead();
      lsl::SampleRow row;
      while (times_.size() < ring_.capacity() && ring_.pop(row)) {
        values_.insert(values_.end(), row.values.begin(), row.values.end());
        times_.push_back(static_cast<double>(row.time_ns) * kSecondsPerNs + ahead);
      }
    } catch (...) {  // out of memory
      dropped_ += std::max<std::size_t>(times_.size(), 1);
      return;
    }
    if (!times_.empty() && !outlet_.push(values_, times_)) dropped_ += times_.size();
  }

  lsl::SampleOutlet outlet_;
  servo::RealClock clock_;
  servo::Ring<lsl::SampleRow> ring_;
  std::vector<double> values_, times_;  ///< the thread's own
  std::atomic<std::uint64_t> dropped_{0};
  std::mutex mutex_;
  std::condition_variable quits_;
  bool quit_ = false;
  std::jthread thread_;  ///< the last member: it uses the others
};

SampleStream::SampleStream(const std::string& name, double rate)
    : sender_(std::make_unique<Sender>(stream_name(name), rate)) {}

SampleStream::~SampleStream() = default;

void SampleStream::push(const servo::Sample& sample) noexcept { sender_->push(sample); }

std::uint64_t SampleStream::dropped() const noexcept { return sender_->dropped(); }

}  // namespace palpate::runner::session
