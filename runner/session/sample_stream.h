#pragma once
// The servo's samples, sent live to other recorders as a regular stream of Lab Streaming Layer.
// Nothing waits for it: samples that it cannot take are counted and dropped.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "runner/servo/sample.h"
#include "runner/servo/tick_source.h"

namespace palpate::runner::session {

/// A channel of the stream, as in its description.
struct StreamChannel {
  const char *label, *unit, *type;
};

/// The values of one tick: tip, tail (m), force (N), torque (N m), device1, device2 (N), depth (m),
/// contacts; a stored sample has the same values under the same names.
struct StreamRow {
  std::int64_t time_ns = 0;  ///< session clock
  std::array<double, 20> values{};
};
StreamRow stream_row(const servo::Sample& sample) noexcept;
/// The channels of StreamRow::values, in their order.
std::span<const StreamChannel> stream_channels() noexcept;

class SampleStream {
 public:
  /// \param name  "lsl" or "lsl:NAME". \param rate  Hz, of the servo
  /// \throws std::invalid_argument for another text; std::runtime_error where liblsl is missing
  SampleStream(const std::string& name, double rate);
  /// Sends the remaining samples.
  ~SampleStream();
  SampleStream(const SampleStream&) = delete;
  SampleStream& operator=(const SampleStream&) = delete;

  /// Call from one thread. Returns at once.
  void push(const servo::Sample& sample) noexcept;
  /// The number of samples that found no room or that liblsl did not take.
  std::uint64_t dropped() const noexcept;

 private:
  class Sender;
  std::unique_ptr<Sender> sender_;
};

/// A servo whose samples also go into a stream when the session takes them: the servo's thread does
/// no work for it.
class StreamedServo final : public servo::TickSource {
 public:
  StreamedServo(servo::TickSource& servo, SampleStream& stream) : servo_(servo), stream_(stream) {}

  void prepare(const rendering::Scene& scene, const rendering::Renderer& renderer,
               const servo::HomeZone& home) override {
    servo_.prepare(scene, renderer, home);
  }
  const servo::Sample& next() noexcept override {
    const servo::Sample& sample = servo_.next();
    stream_.push(sample);
    return sample;
  }
  std::span<const rendering::BodyPose> bodies() const noexcept override { return servo_.bodies(); }
  servo::ServoQuality stop() noexcept override { return servo_.stop(); }

 private:
  servo::TickSource& servo_;
  SampleStream& stream_;
};

}  // namespace palpate::runner::session
