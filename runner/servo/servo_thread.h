#pragma once
// The servo loop of a live session: a real-time thread that waits only for the clock and the
// device. Scenes are passed in by exchange of pointers. Every sample is passed out through a ring
// of fixed size, the newest also through a triple buffer. No locks.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "runner/servo/bell.h"
#include "runner/servo/heard_tick.h"
#include "runner/servo/patience.h"
#include "runner/servo/realtime.h"
#include "runner/servo/ring.h"
#include "runner/servo/sample.h"
#include "runner/servo/servo.h"
#include "runner/servo/servo_health.h"
#include "runner/servo/shared_value.h"
#include "runner/servo/soft_threads.h"
#include "runner/servo/touched_places.h"
#include "runner/servo/triple_buffer.h"

namespace palpate::runner::servo {

struct ServoSettings {
  double rate = 1000;  ///< Hz
  ForceLimits limits;
  WorkspaceMap workspace;
  bool passivity_controller = false;
  RealtimeSettings realtime;
  std::size_t ring = 16384;     ///< samples that can wait for the session; more are lost
  bool touched_places = false;  ///< also publish contact places of every tick
  HeardTicks* heard = nullptr;  ///< every tick with forces for the ear; outlives the thread
};

/// Call prepare, next and stop in one thread, the session's; latest in one thread, which may be
/// another.
class ServoThread final : public TickSource {
 public:
  /// Starts ticking, without forces until prepare. Only the thread may use the device and the
  /// clock, which must outlive it. \throws std::system_error if no thread can be created
  ServoThread(Device& device, Clock& clock, const ServoSettings& settings);
  /// Commands zero force, then ends the thread.
  ~ServoThread() override;
  ServoThread(const ServoThread&) = delete;
  ServoThread& operator=(const ServoThread&) = delete;

  void prepare(const rendering::Scene& scene, const rendering::Renderer& renderer,
               const HomeZone& home) override;
  /// Changes the materials of the scene of prepare() to those of this one by a ramp (FeelRamp),
  /// while it is touched or stopped. \return false: more than materials differ, or something moves
  /// in it: prepare it instead
  bool change_feel(const rendering::Scene& to);
  /// Every sample since prepare, in order. If the ring overflowed, the first sample after the gap
  /// has kSamplesLost. If the thread is silent for too long (Patience), returns its last sample
  /// with kStalled and kTripped.
  const Sample& next() noexcept override;
  ServoQuality stop() noexcept override;
  /// After stop(): resumes the scene, moving objects included, once the stylus is back within
  /// kBackWithin of where it was; until then there is no force.
  /// \param ticks  number of ticks, each with almost no force, after which it stops again; 0: no
  /// end
  void resume(std::uint32_t ticks = 0) noexcept;
  static constexpr double kBackWithin = 0.005;  ///< m, of tip and tail
  /// Distance of tip or tail from where they were while resume() waits for them, m; else 0. From
  /// any thread.
  double away() const noexcept { return away_.load(); }
  /// The next sample; null: there is none yet. For the session's thread.
  const Sample* next_now() noexcept;
  std::span<const rendering::BodyPose> bodies() const noexcept override {
    return {popped_bodies_.data(), popped_.bodies};
  }
  /// Pulls an object of the scene until the next call. For one thread, any.
  void pull(const rendering::BodyPull& by) noexcept { pull_.write(by); }

  /// Contact places of the next tick with contact, in order, with ServoSettings::touched_places.
  /// Some are lost if the session does not keep up. For the session's thread.
  bool touched(TouchedPlaces& places) noexcept { return places_.pop(places); }

  /// The newest sample, also between trials; false: none is newer than the last one read.
  bool latest(Sample& sample) noexcept { return latest_.read(sample); }
  /// Commands zero force within the tick and until clear_fault(). From any thread or signal
  /// handler.
  void emergency_zero() noexcept { servo_.emergency_zero(); }
  /// Ramps down to zero force, which stays until clear_fault(). From any thread.
  void fade_out() noexcept { servo_.fade_out(); }
  void clear_fault() noexcept { servo_.clear_fault(); }
  void clear_trip() noexcept { servo_.clear_trip(); }
  /// Ends the session's waits in next() and stop() early, and those of its owner: rung when forces
  /// begin, when a scene has stopped, and by whoever has news for the session.
  Bell& bell() noexcept { return bell_; }
  /// True once the device was commanded zero force after emergency_zero(). Signal safe.
  bool forces_are_off() const noexcept { return off_.load(); }

  /// Whether the caller is the servo's thread. Signal safe.
  bool in_this_thread() const noexcept { return thread_id_.load() == current_thread(); }

  const RealtimeRights& rights() const { return rights_; }
  /// The threads that step soft objects in the scene of prepare(), valid until the next prepare().
  /// For the session's thread.
  SoftThreads* soft_threads() noexcept { return scenes_.empty() ? nullptr : &scenes_.back()->soft; }
  /// Statistics of all ticks since the thread began, between trials too. From any thread.
  const ServoHealth& health() const { return health_; }

 private:
  static int current_thread() noexcept;
  void run() noexcept;
  void take_requests() noexcept;
  void begin_ramp(FeelRamp* ramp) noexcept;
  void resume_when_back(const rendering::LineProbe& probe) noexcept;
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

  /// A scene with the threads that step its soft objects. The servo's state refers to them.
  struct ShownScene {
    ShownScene(const rendering::Scene& what, const rendering::Renderer& how, const HomeZone& where,
               const RealtimeSettings& realtime, std::size_t ticks)
        : trial(what, how, where, ticks), soft(trial.scene, realtime), changed(what.materials()) {
      if (!soft.empty()) soft.attach(trial.state);
      for (std::uint32_t part = 0; part < what.materials(); ++part)
        feel.push_back(what.feel_of(part));
    }
    TrialScene trial;
    SoftThreads soft;
    std::vector<rendering::Feel> feel;  ///< asked for last, by part; the servo's may be on the way
    std::vector<bool> changed;          ///< by part
    std::deque<FeelRamp> ramps;         ///< the last of them, until the servo has taken the next
  };
  std::vector<std::unique_ptr<ShownScene>>
      scenes_;  ///< owned by the session's thread; freed once the servo no longer uses them
  std::atomic<TrialScene*> incoming_{nullptr};
  std::atomic<FeelRamp*> incoming_ramp_{nullptr};
  std::atomic<std::uint64_t> ramp_taken_{0};  ///< number of the newest in use
  std::uint64_t newest_ramp_ = 0;             ///< used by the session's thread
  std::atomic<std::uint32_t> stops_asked_{0}, stops_done_{0};
  std::atomic<std::uint64_t> resume_{0};  ///< ticks + 1; 0: no request
  std::atomic<double> away_{0};
  ServoQuality quality_;    ///< written before stops_done_ changes
  bool scene_set_ = false;  ///< used by the session's thread: a scene is shown, or may be

  Ring<Sample> ring_;
  TripleBuffer<Sample> latest_;
  Ring<TouchedPlaces> places_;
  bool tells_places_;
  HeardTicks* const heard_;  ///< null: nobody listens
  TripleBuffer<rendering::BodyPull> pull_;
  // Used by the servo only:
  TrialScene* current_ = nullptr;                ///< shown, or stopped and kept for resume()
  std::optional<rendering::LineProbe> felt_at_;  ///< m, the stylus in its last tick
  bool waits_ = false;                           ///< waits for the stylus to resume
  std::uint32_t steps_left_ = 0;                 ///< 0: no limit
  bool gap_ = false;           ///< samples were lost since the last one in the ring
  bool lost_samples_ = false;  ///< in this trial
  std::atomic<bool> off_{true}, quit_{false};
  std::atomic<int> thread_id_{0};
  Bell bell_;
  Sample popped_;
  std::vector<rendering::BodyPose> popped_bodies_;  ///< used by the session's thread, with popped_
  std::jthread thread_;
};

}  // namespace palpate::runner::servo
