#include "runner/servo/servo_thread.h"

#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <future>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>
#include <utility>

namespace palpate::runner::servo {
namespace {

// Only one thread writes, so a load and a store suffice, without a locked increment.
template <class T>
void increase(std::atomic<T>& value, T by) noexcept {
  value.store(value.load(std::memory_order_relaxed) + by, std::memory_order_relaxed);
}

}  // namespace

int TimeHistogram::bin(std::int64_t ns) noexcept {
  if (ns < kSteps) return static_cast<int>(std::max<std::int64_t>(ns, 0));
  // The leading bit gives the doubling, the next three the step in it.
  const int shift = static_cast<int>(std::bit_width(static_cast<std::uint64_t>(ns))) - 4;
  return std::min(kBins - 1, shift * kSteps + static_cast<int>(ns >> shift));
}

std::int64_t TimeHistogram::upper_edge(int bin) noexcept {
  if (bin < 2 * kSteps) return bin;
  const int shift = bin / kSteps - 1;
  return (static_cast<std::int64_t>(bin - shift * kSteps + 1) << shift) - 1;
}

void TimeHistogram::add(std::int64_t ns) noexcept {
  increase<std::uint64_t>(bins_[static_cast<std::size_t>(bin(ns))], 1);
  increase<std::uint64_t>(count_, 1);
  if (ns > longest()) longest_.store(ns, std::memory_order_relaxed);
}

std::int64_t TimeHistogram::quantile(double p) const noexcept {
  const double wanted = p * static_cast<double>(count());
  double so_far = 0;
  for (int i = 0; i < kBins; ++i) {
    so_far +=
        static_cast<double>(bins_[static_cast<std::size_t>(i)].load(std::memory_order_relaxed));
    if (so_far > 0 && so_far >= wanted) return std::min(upper_edge(i), longest());
  }
  return longest();
}

double TimeHistogram::fraction_above(std::int64_t ns) const noexcept {
  std::uint64_t above = 0;
  for (int i = bin(ns) + 1; i < kBins; ++i)
    above += bins_[static_cast<std::size_t>(i)].load(std::memory_order_relaxed);
  return count() > 0 ? static_cast<double>(above) / static_cast<double>(count()) : 0;
}

std::vector<std::pair<std::int64_t, std::uint64_t>> TimeHistogram::steps() const {
  std::vector<std::pair<std::int64_t, std::uint64_t>> out;
  for (int i = 0; i < kBins; ++i) {
    const std::uint64_t in_step =
        bins_[static_cast<std::size_t>(i)].load(std::memory_order_relaxed);
    if (in_step > 0) out.emplace_back(upper_edge(i), in_step);
  }
  return out;
}

void ServoHealth::add(const Sample& sample, std::int64_t period_ns) noexcept {
  lateness_.add(sample.lateness_ns);
  compute_.add(sample.compute_ns);
  if (counted_.ticks++ == 0) first_due_ns_ = sample.time_ns - sample.lateness_ns;
  // A clock that stands still or steps back makes a tick early: none was missed.
  counted_.missed_ticks +=
      static_cast<std::uint64_t>(std::max<std::int64_t>(sample.lateness_ns, 0) / period_ns);
  counted_.elapsed_ns = sample.time_ns - first_due_ns_;
  time_kept_.write(counted_);
  faults_.store(faults() | sample.faults, std::memory_order_relaxed);
  if (sample.period_ns > longest_period_ns())
    longest_period_.store(sample.period_ns, std::memory_order_relaxed);
}

TimeKept ServoHealth::time_kept() const noexcept {
  TimeKept kept;
  while (!time_kept_.read(kept)) {
  }
  return kept;
}

void ServoHealth::add_lost_sample() noexcept {
  increase<std::uint64_t>(lost_, 1);
  faults_.store(faults() | servo_fault::kSamplesLost, std::memory_order_relaxed);
}

std::string to_json_text(const ServoHealth& health, double rate) {
  const auto times = [](const TimeHistogram& histogram) {
    return nlohmann::ordered_json{{"median", histogram.quantile(0.5)},
                                  {"p99", histogram.quantile(0.99)},
                                  {"p99.9", histogram.quantile(0.999)},
                                  {"max", histogram.longest()},
                                  {"up_to_and_count", histogram.steps()}};
  };
  const auto period_ns = static_cast<std::int64_t>(1e9 / rate);
  const TimeKept kept = health.time_kept();
  const nlohmann::ordered_json json{
      {"servo",
       {{"rate_hz", rate},
        {"ticks", kept.ticks},
        {"missed_ticks", kept.missed_ticks},
        {"elapsed_ns", kept.elapsed_ns},
        {"late_by_a_period_share", health.lateness().fraction_above(period_ns)},
        {"lost_samples", health.lost_samples()},
        {"faults", health.faults()},
        {"longest_period_ns", health.longest_period_ns()},
        {"lateness_ns", times(health.lateness())},
        {"compute_ns", times(health.compute())}}}};
  return json.dump();
}

namespace {

constexpr int kBelowTheServo = 10;  // difference in priority

RealtimeSettings of_body(RealtimeSettings servo) {
  if (servo.priority > 0) servo.priority = std::max(1, servo.priority - kBelowTheServo);
  servo.lock_memory = false;  // the servo has requested it for the whole program
  servo.core = -1;            // leave the servo's processor to the servo
  servo.awake = false;
  return servo;
}

}  // namespace

SoftThread::SoftThread(std::shared_ptr<const rendering::SoftObject> object,
                       const RealtimeSettings& realtime)
    : object_(std::move(object)),
      realtime_(of_body(realtime)),
      view_(rendering::initial_state(*object_).view),
      body_(object_->body->rest()) {
  forces_.reserve(2 * object_->body->surface_nodes().size());
  snapshot_.now = view_.x;
  drawn_.fill(snapshot_);
  drawn_.write(snapshot_);
  sem_init(&asked_, 0, 0);
  thread_ = std::jthread([this] {
    request_realtime(realtime_);
    run();
  });
}

SoftThread::~SoftThread() {
  quit_.store(true);
  sem_post(&asked_);
  thread_.join();
  sem_destroy(&asked_);
}

void SoftThread::ask(std::span<const rendering::NodeForce> forces) noexcept {
  forces_.assign(forces.begin(), forces.end());  // capacity suffices for the largest number
  phase_.store(Phase::asked, std::memory_order_release);
  sem_post(&asked_);
}

bool SoftThread::take(rendering::SoftView& view) noexcept {
  std::swap(view, view_);
  const bool good = good_;
  phase_.store(Phase::idle, std::memory_order_relaxed);  // the servo's turn
  return good;
}

void SoftThread::run() noexcept {
  while (!quit_.load()) {
    while (sem_wait(&asked_) != 0) {  // interrupted by a signal
    }
    while (stalled_.load() && !quit_.load())
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    if (phase_.load(std::memory_order_acquire) != Phase::asked) continue;
    good_ = step_and_look(*object_, body_, forces_, view_);
    snapshot_.now.assign(view_.x.begin(), view_.x.end());
    snapshot_.steps = body_.steps;
    phase_.store(Phase::made, std::memory_order_release);
    drawn_.write(snapshot_);
  }
}

SoftThreads::SoftThreads(const rendering::Scene& scene, const RealtimeSettings& realtime) {
  for (const auto& object : rendering::soft_objects(scene))
    threads_.push_back(std::make_unique<SoftThread>(object, realtime));
}

void SoftThreads::attach(rendering::RenderState& state) {
  std::vector<rendering::SoftStepper*> steppers;
  steppers.reserve(threads_.size());
  for (const auto& thread : threads_) steppers.push_back(thread.get());
  rendering::step_elsewhere(state, steppers);
}

namespace {

using std::chrono::steady_clock;

constexpr std::int64_t kNap_ns = 4'000'000;  // the session waits while no sample is new
constexpr auto kShortNap = std::chrono::microseconds(250);  // the same, once it has news
constexpr std::size_t kPlaces = 4096;                       // ticks
constexpr auto kPatience = std::chrono::seconds(1);
constexpr auto kPatienceWithoutMotors = std::chrono::seconds(10);
constexpr auto kLongestWait =
    std::chrono::milliseconds(50);  // between calls; after more the program stood still

}  // namespace

void Patience::begin() noexcept {
  heard_ = asked_ = steady_clock::now();
  waited_ = {};
}

bool Patience::is_over() noexcept {
  const Time now = steady_clock::now();
  if (has_motors_) return now - heard_ >= kPatience;
  waited_ += std::min<std::chrono::nanoseconds>(now - asked_, kLongestWait);
  asked_ = now;
  return waited_ >= kPatienceWithoutMotors;
}

ServoThread::ServoThread(Device& device, Clock& clock, const ServoSettings& settings)
    : realtime_(settings.realtime),
      has_motors_(has_motors(device.capabilities())),
      servo_(device, clock, settings.rate, settings.limits, settings.workspace),
      awake_(settings.realtime.awake),
      ring_(settings.ring),
      places_(settings.touched_places ? kPlaces : 1),
      tells_places_(settings.touched_places) {
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
    if (sample.phase == Phase::feeling) felt_at_ = sample.probe;
    if (steps_left_ > 0) count_step();
    if (waits_) go_on_when_back(sample.probe);
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
void ServoThread::go_on_when_back(const rendering::LineProbe& probe) noexcept {
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
