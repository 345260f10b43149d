#pragma once
// Threads that step soft objects, one for each object, beside the servo's.

#include <semaphore.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <thread>
#include <vector>

#include "rendering/bodies/soft/soft_object.h"
#include "rendering/scene.h"
#include "runner/servo/realtime.h"
#include "runner/servo/triple_buffer.h"

namespace palpate::runner::servo {

/// The surface of a soft object at its last step, for drawing.
struct SoftSnapshot {
  std::vector<Vec3> now;  ///< m, of the nodes of the surface; empty: it has not been stepped
  std::uint64_t steps = 0;
};

/// The thread of one object. The servo asks for a step and takes its result, one at a time, by
/// exchange of buffers. It never waits, and the thread does not touch the servo's data in between.
/// The thread's priority is below the servo's.
class SoftThread final : public rendering::SoftStepper {
 public:
  /// \param realtime  the servo's. \throws std::system_error if no thread can be created
  SoftThread(std::shared_ptr<const rendering::SoftObject> object, const RealtimeSettings& realtime);
  ~SoftThread() override;  ///< waits for the current step. The servo must no longer use it
  SoftThread(const SoftThread&) = delete;
  SoftThread& operator=(const SoftThread&) = delete;

  // Called by the servo:
  void ask(std::span<const rendering::NodeForce> forces) noexcept override;
  bool ready() const noexcept override {
    return phase_.load(std::memory_order_acquire) == Phase::made;
  }
  bool take(rendering::SoftView& view) noexcept override;

  /// For one other thread. False: nothing is new.
  bool latest(SoftSnapshot& snapshot) noexcept { return drawn_.read(snapshot); }
  int object() const { return object_->object; }  ///< index in the scene
  /// Holds all steps, as if the thread had no processor. From any thread; for tests.
  void stall(bool stalled) noexcept { stalled_.store(stalled); }

 private:
  enum class Phase : std::uint8_t { idle, asked, made };
  void run() noexcept;

  const std::shared_ptr<const rendering::SoftObject> object_;
  const RealtimeSettings realtime_;
  sem_t asked_{};
  std::atomic<Phase> phase_{Phase::idle};
  static_assert(std::atomic<Phase>::is_always_lock_free);
  std::atomic<bool> quit_{false}, stalled_{false};
  // Owned by the servo in phases idle and made, by the thread in phase asked.
  std::vector<rendering::NodeForce> forces_;
  rendering::SoftView view_;
  bool good_ = true;
  // The thread's own:
  rendering::SoftState body_;
  SoftSnapshot snapshot_;
  TripleBuffer<SoftSnapshot> drawn_;
  std::jthread thread_;  ///< last: ends first
};

/// The threads of a scene; empty if it has no soft objects.
class SoftThreads {
 public:
  SoftThreads(const rendering::Scene& scene, const RealtimeSettings& realtime);
  /// Makes the state's steps run here from now on. Call it right after initial_state().
  void attach(rendering::RenderState& state);

  bool empty() const { return threads_.empty(); }
  /// In the order of soft_objects().
  SoftThread& operator[](std::size_t i) { return *threads_[i]; }
  std::size_t size() const { return threads_.size(); }

 private:
  std::vector<std::unique_ptr<SoftThread>> threads_;
};

}  // namespace palpate::runner::servo
