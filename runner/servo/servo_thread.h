#pragma once
// The servo loop of a live session: a real-time thread of its own that waits for nothing but the
// clock and the device. Scenes go in by an exchange of pointers, every sample comes out through a
// ring of fixed size, the newest through a triple buffer. No locks.

#include <atomic>
#include <chrono>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "runner/servo/realtime.h"
#include "runner/servo/ring.h"
#include "runner/servo/servo.h"
#include "runner/servo/servo_health.h"
#include "runner/servo/soft_threads.h"
#include "runner/servo/touched_places.h"
#include "runner/servo/triple_buffer.h"

namespace palpate::runner {

struct ServoSettings {
  double rate = 1000;  ///< Hz
  ForceLimits limits;
  WorkspaceMap workspace;
  bool passivity_controller = false;
  RealtimeSettings realtime;
  std::size_t ring = 16384;     ///< samples that wait for the session before some are lost
  bool touched_places = false;  ///< where every tick touches is told, too
};

/// Until a servo that gives nothing counts as stalled: one second where it drives motors. Without
/// motors nobody waits for zero force, so it is ten, and a time in which the whole program stood
/// still does not count.
class Patience {
 public:
  explicit Patience(bool has_motors) noexcept : has_motors_(has_motors) { begin(); }
  /// Something has come.
  void begin() noexcept;
  /// Ask every few milliseconds.
  bool is_over() noexcept;

 private:
  using Time = std::chrono::steady_clock::time_point;
  bool has_motors_;
  Time heard_, asked_;
  std::chrono::nanoseconds waited_{0};  ///< while the program ran
};

/// prepare, next and stop belong to one thread, the session's; latest to one, which may be another.
class ServoThread final : public TickSource {
 public:
  /// Ticks from now on, without forces until prepare. The device and the clock are the thread's
  /// alone and must outlive it. \throws std::system_error where no thread can be had
  ServoThread(Device& device, Clock& clock, const ServoSettings& settings);
  /// Zero force, then the end of the thread.
  ~ServoThread() override;
  ServoThread(const ServoThread&) = delete;
  ServoThread& operator=(const ServoThread&) = delete;

  void prepare(const rendering::Scene& scene, const rendering::Renderer& renderer,
               const HomeZone& home) override;
  /// Every sample since prepare, in order. Where the ring overflowed, the first one after the gap
  /// says so (kSamplesLost); where the thread gives nothing for too long (Patience), what comes
  /// back is its last sample with kStalled and kTripped.
  const Sample& next() noexcept override;
  ServoQuality stop() noexcept override;
  /// After stop(): the scene goes on from where it was stopped, what moves in it as well, as soon
  /// as the stylus is back where it was then, within kBackWithin; until then there is no force.
  /// \param ticks  so many, each with next to no force, then it stops again; 0: without end
  void resume(std::uint32_t ticks = 0) noexcept;
  static constexpr double kBackWithin = 0.005;  ///< m, of tip and tail
  /// m, that tip or tail are away from where they were, while resume() waits for them; else 0. From
  /// any thread.
  double away() const noexcept { return away_.load(); }
  /// The next sample; null where there is none yet. By the session's thread.
  const Sample* next_now() noexcept;
  std::span<const rendering::BodyPose> bodies() const noexcept override {
    return {popped_bodies_.data(), popped_.bodies};
  }
  /// Somebody draws an object of the scene, until it is told otherwise. By one thread, any.
  void pull(const rendering::BodyPull& by) noexcept { pull_.write(by); }

  /// Where the tool touched, with ServoSettings::touched_places: of the ticks with contact alone,
  /// in order; some are lost where the session does not keep up. By the session's thread.
  bool touched(TouchedPlaces& places) noexcept { return places_.pop(places); }

  /// The newest sample, also between trials; false where there is none that is newer than the last.
  bool latest(Sample& sample) noexcept { return latest_.read(sample); }
  /// Zero force within the tick and until clear_fault(). From any thread or signal handler.
  void emergency_zero() noexcept { servo_.emergency_zero(); }
  /// Zero force by the ramp and until clear_fault(). From any thread.
  void fade_out() noexcept { servo_.fade_out(); }
  void clear_fault() noexcept { servo_.clear_fault(); }
  void clear_trip() noexcept { servo_.clear_trip(); }
  /// True once zero force was commanded to the device after emergency_zero(). Signal safe.
  bool forces_are_off() const noexcept { return off_.load(); }

  /// Whether the caller is the servo's thread. Signal safe.
  bool in_this_thread() const noexcept { return thread_id_.load() == current_thread(); }

  const RealtimeRights& rights() const { return rights_; }
  /// The threads that step what is soft in the scene of prepare(), valid until the next one. By the
  /// session's thread.
  SoftThreads* soft_threads() noexcept { return scenes_.empty() ? nullptr : &scenes_.back()->soft; }
  /// Every tick since the thread began, trials or not. From any thread.
  const ServoHealth& health() const { return health_; }

 private:
  static int current_thread() noexcept;
  void run() noexcept;
  void take_requests() noexcept;
  void go_on_when_back(const rendering::LineProbe& probe) noexcept;
  void count_step() noexcept;
  void publish(const Sample& sample) noexcept;
  void publish_places(const Sample& sample) noexcept;
  bool hand_over(const Sample& sample) noexcept;

  const RealtimeSettings realtime_;
  const bool has_motors_;
  Servo servo_;
  const AwakeProcessors awake_;
  RealtimeRights rights_;
  ServoHealth health_;

  /// A scene with the threads that step what is soft in it, which the servo's state refers to.
  struct ShownScene {
    ShownScene(const rendering::Scene& what, const rendering::Renderer& how, const HomeZone& where,
               const RealtimeSettings& realtime, std::size_t ticks)
        : trial(what, how, where, ticks), soft(trial.scene, realtime) {
      if (!soft.empty()) soft.attach(trial.state);
    }
    TrialScene trial;
    SoftThreads soft;
  };
  std::vector<std::unique_ptr<ShownScene>>
      scenes_;  ///< the session thread's; freed once the servo has left them
  std::atomic<TrialScene*> incoming_{nullptr};
  std::atomic<std::uint32_t> stops_asked_{0}, stops_done_{0};
  std::atomic<std::uint64_t> resume_{0};  ///< ticks + 1; 0: not asked
  std::atomic<double> away_{0};
  ServoQuality quality_;    ///< written before stops_done_ moves
  bool scene_set_ = false;  ///< the session thread's: a scene is shown, or may be

  Ring<Sample> ring_;
  TripleBuffer<Sample> latest_;
  Ring<TouchedPlaces> places_;
  bool tells_places_;
  TripleBuffer<rendering::BodyPull> pull_;
  // The servo's own:
  TrialScene* current_ = nullptr;                ///< shown, or stopped and kept for resume()
  std::optional<rendering::LineProbe> felt_at_;  ///< m, the stylus in its last tick
  bool waits_ = false;                           ///< to go on
  std::uint32_t steps_left_ = 0;                 ///< 0: without end
  bool gap_ = false;           ///< samples were lost since the last one in the ring
  bool lost_samples_ = false;  ///< in this trial
  std::atomic<bool> off_{true}, quit_{false};
  std::atomic<int> thread_id_{0};
  Sample popped_;
  std::vector<rendering::BodyPose> popped_bodies_;  ///< the session thread's, with popped_
  std::jthread thread_;
};

}  // namespace palpate::runner
