#include "runner/servo/servo_thread.h"

#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <future>
#include <glm/geometric.hpp>
#include <utility>

namespace palpate::runner::servo {
namespace {

constexpr std::int64_t kNap_ns = 4'000'000;  // the session waits while no sample is new
constexpr auto kShortNap = std::chrono::microseconds(250);  // the same, once it has news
constexpr std::size_t kPlaces = 4096;                       // ticks

}  // namespace

ServoThread::ServoThread(Device& device, Clock& clock, const ServoSettings& settings)
    : realtime_(settings.realtime),
      has_motors_(has_motors(device.capabilities())),
      servo_(device, clock, settings.rate, settings.limits, settings.workspace),
      awake_(settings.realtime.awake),
      ring_(settings.ring),
      places_(settings.touched_places ? kPlaces : 1),
      tells_places_(settings.touched_places),
      heard_(settings.heard) {
  servo_.keep_warm();
  if (settings.passivity_controller) servo_.control_passivity();
  std::promise<RealtimeRights> granted;
  thread_ = std::jthread([this, &granted] {
    granted.set_value(request_realtime(realtime_));
    run();
  });
  rights_ = granted.get_future().get();
  rights_.awake = awake_.granted();
}

ServoThread::~ServoThread() {
  quit_ = true;
  thread_.join();
}

int ServoThread::current_thread() noexcept { return static_cast<int>(syscall(SYS_gettid)); }

void ServoThread::run() noexcept {
  thread_id_ = current_thread();
  servo_.start();
  while (!quit_.load(std::memory_order_relaxed)) {
    take_requests();
    const Sample& sample = servo_.tick();
    if (tells_places_) publish_places(sample);  // first, so that a reader of the sample finds them
    publish(sample);
    if (heard_ != nullptr && sample.phase == Phase::feeling) heard_->push(heard_tick(sample));
    if (sample.phase == Phase::feeling) felt_at_ = sample.probe;
    if (steps_left_ > 0) count_step();
    if (waits_) resume_when_back(sample.probe);
  }
  servo_.stop();
}

void ServoThread::begin_ramp(FeelRamp* ramp) noexcept {
  if (ramp == nullptr || current_ == nullptr) return;
  current_->ramp = ramp;
  ramp->begin(current_->scene);
  ramp_taken_.store(ramp->number(), std::memory_order_release);
}

void ServoThread::take_requests() noexcept {
  // First, so that the scene that it belongs to has been taken when it begins.
  FeelRamp* const ramp = incoming_ramp_.load(std::memory_order_relaxed) != nullptr
                             ? incoming_ramp_.exchange(nullptr, std::memory_order_acquire)
                             : nullptr;
  if (incoming_.load(std::memory_order_relaxed) != nullptr) {
    current_ = incoming_.exchange(nullptr, std::memory_order_acquire);
    servo_.begin(*current_);
    gap_ = lost_samples_ = waits_ = false;
    felt_at_.reset();
    steps_left_ = 0;
  }
  begin_ramp(ramp);
  rendering::BodyPull pull;
  if (servo_.shown() != nullptr && pull_.read(pull)) servo_.pull(pull);
  const std::uint64_t resumed = resume_.load(std::memory_order_relaxed);
  if (resumed != 0 && current_ != nullptr) {
    resume_.store(0, std::memory_order_relaxed);
    steps_left_ = static_cast<std::uint32_t>(resumed - 1);
    waits_ = true;
  }
  const std::uint32_t asked = stops_asked_.load(std::memory_order_acquire);
  if (asked != stops_done_.load(std::memory_order_relaxed)) {
    quality_ = servo_.stop();
    waits_ = false;
    steps_left_ = 0;
    away_.store(0);
    if (lost_samples_) quality_.faults |= servo_fault::kSamplesLost;
    begin_ramp(incoming_ramp_.exchange(nullptr));  // after a stop none is on its way
    stops_done_.store(asked, std::memory_order_release);
  }
}

/// The stylus may have been moved while the scene was stopped: it must not pass through objects in
/// one tick.
void ServoThread::resume_when_back(const rendering::LineProbe& probe) noexcept {
  const double away = felt_at_ ? std::max(glm::distance(probe.tip, felt_at_->tip),
                                          glm::distance(probe.tail, felt_at_->tail))
                               : 0;
  if (!(away <= kBackWithin)) {
    away_.store(std::isfinite(away) ? away : 1);
    return;
  }
  away_.store(0);
  waits_ = false;
  servo_.begin(*current_);
}

/// Each step restarts the ramp of the forces: a hand must not feel states that are not shown as
/// they happen.
void ServoThread::count_step() noexcept {
  if (servo_.shown() == nullptr) return;  // it waits for the stylus
  const bool last = --steps_left_ == 0;
  servo_.stop();
  if (!last) servo_.begin(*current_);
}

/// Passes a sample to the session; false: the ring is full.
bool ServoThread::hand_over(const Sample& sample) noexcept {
  if (sample.bodies > 0) {
    Ring<rendering::BodyPose>& poses = *servo_.poses();
    if (ring_.room() == 0 || poses.room() < sample.bodies) return false;
    for (const rendering::BodyPose& pose : servo_.bodies()) poses.push(pose);
  }
  return ring_.push(sample);
}

void ServoThread::publish(const Sample& sample) noexcept {
  off_.store((sample.faults & servo_fault::kTripped) != 0 || sample.phase != Phase::feeling);
  health_.add(sample, servo_.period_ns());
  latest_.write(sample);
  if (sample.phase == Phase::idle) return;
  if (!gap_) {
    gap_ = !hand_over(sample);
  } else {
    Sample after_gap = sample;
    after_gap.faults |= servo_fault::kSamplesLost;
    gap_ = !hand_over(after_gap);
  }
  if (!gap_) return;
  lost_samples_ = true;
  health_.add_lost_sample();
}

void ServoThread::publish_places(const Sample& sample) noexcept {
  const TrialScene* const shown = servo_.shown();
  if (shown == nullptr || sample.rendering.contacts == 0) return;
  TouchedPlaces touched;
  touched.time_ns = sample.time_ns;
  touched.count = find_contact_places(shown->scene, shown->state, sample.rendering, touched.places);
  places_.push(touched);
}

void ServoThread::prepare(const rendering::Scene& scene, const rendering::Renderer& renderer,
                          const HomeZone& home) {
  auto shown = std::make_unique<ShownScene>(scene, renderer, home, realtime_, ring_.capacity());
  scene_set_ |= ramp_taken_.load() != newest_ramp_;
  if (scene_set_) stop();
  if (!scene_set_) scenes_.clear();
  while (ring_.pop(popped_)) {
  }
  popped_ = {};
  popped_bodies_.resize(shown->trial.state.motion.bodies().size());
  scenes_.push_back(std::move(shown));
  scene_set_ = true;
  incoming_.store(&scenes_.back()->trial, std::memory_order_release);
}

bool ServoThread::change_feel(const rendering::Scene& to) {
  if (scenes_.empty()) return false;
  ShownScene& shown = *scenes_.back();
  if (!shown.soft.empty() || !rendering::soft_objects(to).empty() ||
      !shown.trial.scene.differs_in_feel_only(to))
    return false;
  std::vector<FeelRamp::Change> changes;
  for (std::uint32_t part = 0; part < to.materials(); ++part) {
    const rendering::Feel feel = to.feel_of(part);
    shown.changed[part] = shown.changed[part] || feel != shown.feel[part];
    if (shown.changed[part]) changes.push_back({part, feel, {}});
    shown.feel[part] = feel;
  }
  std::deque<FeelRamp>& ramps = shown.ramps;
  while (!ramps.empty() && ramps.front().number() < ramp_taken_.load(std::memory_order_acquire))
    ramps.pop_front();
  ramps.emplace_back(++newest_ramp_, std::move(changes));
  incoming_ramp_.store(&ramps.back(), std::memory_order_release);
  return true;
}

const Sample& ServoThread::next() noexcept {
  Patience patience(has_motors_);
  bool news = false;
  while (next_now() == nullptr) {
    if (patience.is_over()) {
      popped_.faults |= servo_fault::kStalled | servo_fault::kTripped;
      return popped_;
    }
    if (news)
      std::this_thread::sleep_for(kShortNap);
    else
      news = bell_.wait(kNap_ns);
  }
  return popped_;
}

const Sample* ServoThread::next_now() noexcept {
  if (!ring_.pop(popped_)) return nullptr;
  for (std::size_t i = 0; i < popped_.bodies; ++i)
    scenes_.back()->trial.poses->pop(popped_bodies_[i]);
  return &popped_;
}

void ServoThread::resume(std::uint32_t ticks) noexcept {
  scene_set_ = true;
  resume_.store(std::uint64_t{ticks} + 1, std::memory_order_release);
}

ServoQuality ServoThread::stop() noexcept {
  const std::uint32_t asked = stops_asked_.load(std::memory_order_relaxed) + 1;
  stops_asked_.store(asked, std::memory_order_release);
  Patience patience(has_motors_);
  while (stops_done_.load(std::memory_order_acquire) != asked) {
    if (patience.is_over()) {
      emergency_zero();  // in case the thread recovers
      ServoQuality stalled;
      stalled.faults = servo_fault::kStalled | servo_fault::kTripped;
      return stalled;
    }
    // The servo must not call the system to wake anybody, and a stop takes a tick or two.
    std::this_thread::sleep_for(kShortNap);
  }
  scene_set_ = false;
  return quality_;
}

}  // namespace palpate::runner::servo
