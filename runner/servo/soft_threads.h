#pragma once
// The steps of soft objects, each object's in a thread of its own beside the servo's.

#include <semaphore.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <thread>
#include <vector>

#include "rendering/bodies/soft/soft_scene.h"
#include "runner/servo/realtime.h"
#include "runner/servo/triple_buffer.h"

namespace palpate::runner {

/// Where the surface of a soft object was at its last step, to be drawn.
struct SoftSnapshot {
  std::vector<Vec3> now;  ///< m, of the nodes of the surface; empty: it has not been stepped
  std::uint64_t steps = 0;
};

/// One object's thread. The servo asks for a step and takes it, one at a time, by an exchange of
/// buffers: it never waits, and the thread touches nothing of the servo's in between. The thread's
/// own priority is below the servo's.
class SoftThread final : public rendering::SoftStepper {
 public:
  /// \param realtime  the servo's. \throws std::system_error where no thread can be had
  SoftThread(std::shared_ptr<const rendering::SoftObject> object, const RealtimeSettings& realtime);
  ~SoftThread() override;  ///< after the step in hand. The servo must have left it
  SoftThread(const SoftThread&) = delete;
  SoftThread& operator=(const SoftThread&) = delete;

  // By the servo:
  void ask(std::span<const rendering::NodeForce> forces) noexcept override;
  bool ready() const noexcept override {
    return phase_.load(std::memory_order_acquire) == Phase::made;
  }
  bool take(rendering::SoftView& view) noexcept override;

  /// By one other thread. False where there is nothing new.
  bool latest(SoftSnapshot& snapshot) noexcept { return drawn_.read(snapshot); }
  int object() const { return object_->object; }  ///< index in the scene
  /// From any thread: steps wait, as those of a thread that has no processor. For tests.
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
  // Whose turn it is owns these: the servo's when idle or made, the thread's when asked.
  std::vector<rendering::NodeForce> forces_;
  rendering::SoftView view_;
  bool good_ = true;
  // The thread's own:
  rendering::SoftState body_;
  SoftSnapshot snapshot_;
  TripleBuffer<SoftSnapshot> drawn_;
  std::jthread thread_;  ///< last: ends first
};

/// Those of a scene; none where nothing is soft.
class SoftThreads {
 public:
  SoftThreads(const rendering::Scene& scene, const RealtimeSettings& realtime);
  /// Has the state's steps made here from now on. Right after initial_state().
  void attach(rendering::RenderState& state);

  bool empty() const { return threads_.empty(); }
  /// In the order of soft_objects().
  SoftThread& operator[](std::size_t i) { return *threads_[i]; }
  std::size_t size() const { return threads_.size(); }

 private:
  std::vector<std::unique_ptr<SoftThread>> threads_;
};

}  // namespace palpate::runner
