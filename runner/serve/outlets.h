#pragma once
// Data exchanged by the session's thread of `palpate serve` and the network's: ticks and messages
// out, commands in.

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "runner/serve/messages.h"
#include "runner/servo/ring.h"
#include "runner/servo/sample.h"
#include "stimuli/shapes.h"

namespace palpate::runner::serve {

/// A tick in a stream.
struct StreamSample {
  std::int64_t time_ns = 0, lateness_ns = 0;
  std::uint32_t tick = 0, faults = 0;
  int object = -1;
  Vec3 tip, tail;    ///< m, virtual stylus
  Vec3 force;        ///< N, commanded to the hand, after the limits
  Vec3 rendered;     ///< N, before the limits
  Vec3 contact;      ///< m, deepest contact; zero in free space
  double depth = 0;  ///< m
};

/// Passes ticks from the session's thread to the network's. If that is late, ticks are lost.
class TickStream {
 public:
  void push(const servo::Sample& sample) noexcept {
    const bool contact = sample.rendering.contacts > 0;
    const StreamSample out{.time_ns = sample.time_ns,
                           .lateness_ns = sample.lateness_ns,
                           .tick = sample.tick,
                           .faults = sample.faults,
                           .object = sample.rendering.object,
                           .tip = sample.probe.tip,
                           .tail = sample.probe.tail,
                           .force = sample.device1 + sample.device2,
                           .rendered = sample.rendering.force,
                           .contact = contact ? sample.rendering.deepest.point : Vec3(0),
                           .depth = sample.rendering.deepest.depth};
    if (!ring_.push(out)) lost_.fetch_add(1);
  }
  /// The next tick, in order; false: there is none.
  bool next(StreamSample& out) noexcept { return ring_.pop(out); }
  /// Number of ticks lost because the queue was full. From any thread.
  std::uint64_t lost() const noexcept { return lost_.load(); }

 private:
  servo::Ring<StreamSample> ring_{4096};
  std::atomic<std::uint64_t> lost_{0};
};

/// Receives answers and events.
class ServeOutput {
 public:
  virtual ~ServeOutput() = default;
  /// Replies to the client that asked. From any thread; never waits.
  virtual void reply(std::uint64_t client, std::string text) = 0;
  /// Sends to all clients. From any thread; never waits.
  virtual void tell(std::string text) = 0;
};

/// Draws the surfaces of objects in the world frame, as members of an answer to `picture`.
using PictureOf = std::function<std::string(const std::vector<stimuli::ObjectSpec>&)>;

/// A command of the controller, for the session's thread; or a `clear` of whoever asked for zero
/// force.
struct ServeCommand {
  std::uint64_t client = 0;
  bool left = false;  ///< the controller has left; there is no message
  Message message;
  bool controls = true;  ///< it comes from the controller
};

}  // namespace palpate::runner::serve
