#pragma once
// The servo's samples, sent live to other recorders as a regular stream of Lab Streaming Layer.
// Nothing waits for it: samples that it cannot take are counted and dropped.

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "runner/servo/sample.h"
#include "runner/servo/tick_source.h"

namespace palpate::runner::session {

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
