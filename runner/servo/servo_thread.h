#pragma once
// The servo loop of a live session: a real-time thread of its own that waits for nothing but the
// clock and the device. Scenes go in by an exchange of pointers, every sample comes out through a
// ring of fixed size, the newest through a triple buffer. No locks.

#include <semaphore.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "rendering/bodies/soft/soft_scene.h"
#include "runner/servo/realtime.h"
#include "runner/servo/ring.h"
#include "runner/servo/sample.h"
#include "runner/servo/servo.h"
#include "runner/servo/shared_value.h"
#include "runner/servo/touched_places.h"
#include "runner/servo/triple_buffer.h"

namespace palpate::runner {

// Timing statistics of the servo loop over every tick: lateness, computing time, missed ticks.

/// Counts of times in steps of 1/8 of their size (12.5 % wide at most; exact below 16 ns), from 0
/// to hours. One thread adds, any may read meanwhile.
class TimeHistogram {
 public:
  void add(std::int64_t ns) noexcept;
  std::uint64_t count() const noexcept { return count_.load(std::memory_order_relaxed); }
  std::int64_t longest() const noexcept { return longest_.load(std::memory_order_relaxed); }
  /// The time that the fraction `p` of the counts does not exceed, as the upper edge of its step,
  /// ns.
  std::int64_t quantile(double p) const noexcept;
  /// Fraction of counts in steps that lie above `ns`.
  double fraction_above(std::int64_t ns) const noexcept;
  /// The steps that hold any, as upper edge (ns) and count, in order.
  std::vector<std::pair<std::int64_t, std::uint64_t>> steps() const;

 private:
  static constexpr int kSteps = 8;   ///< for each doubling
  static constexpr int kBins = 352;  ///< up to 2^45 ns
  static int bin(std::int64_t ns) noexcept;
  static std::int64_t upper_edge(int bin) noexcept;

  std::array<std::atomic<std::uint64_t>, kBins> bins_{};
  std::atomic<std::uint64_t> count_{0};
  std::atomic<std::int64_t> longest_{0};
};

/// Ticks against the clock: elapsed_ns / period = ticks - 1 + missed_ticks, whole numbers all.
struct TimeKept {
  std::uint64_t ticks = 0;
  std::uint64_t missed_ticks = 0;  ///< whole periods that passed without a tick
  /// By the clock, from the time when the first tick was due to the start of the last one.
  std::int64_t elapsed_ns = 0;
};

/// Of all ticks of a servo thread.
class ServoHealth {
 public:
  /// By the servo's thread.
  void add(const Sample& sample, std::int64_t period_ns) noexcept;
  void add_lost_sample() noexcept;

  /// All three of the same moment.
  TimeKept time_kept() const noexcept;
  std::uint64_t ticks() const noexcept { return lateness_.count(); }
  std::uint64_t missed_ticks() const noexcept { return time_kept().missed_ticks; }
  std::uint64_t lost_samples() const noexcept { return lost_.load(std::memory_order_relaxed); }
  std::uint32_t faults() const noexcept { return faults_.load(std::memory_order_relaxed); }
  std::int64_t longest_period_ns() const noexcept {
    return longest_period_.load(std::memory_order_relaxed);
  }
  const TimeHistogram& lateness() const { return lateness_; }
  const TimeHistogram& compute() const { return compute_; }

 private:
  TimeHistogram lateness_, compute_;
  TimeKept counted_;               ///< the servo's own
  std::int64_t first_due_ns_ = 0;  ///< likewise
  SharedValue<TimeKept> time_kept_;
  std::atomic<std::uint64_t> lost_{0};
  std::atomic<std::uint32_t> faults_{0};
  std::atomic<std::int64_t> longest_period_{0};
};

/// For a session's record, as JSON: counts, quantiles, and the histograms of every tick's lateness
/// and computing time.
std::string to_json_text(const ServoHealth& health, double rate);

// The steps of soft objects, each object's in a thread of its own beside the servo's.

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
