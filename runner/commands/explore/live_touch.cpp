#include "runner/commands/explore/live_touch.h"

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <iterator>
#include <memory>
#include <utility>

#include "runner/commands/render/forces.h"
#include "runner/display/timeline.h"
#include "runner/servo/sample.h"

namespace palpate::runner {
namespace {

constexpr auto kIdle = std::chrono::milliseconds(5);
constexpr std::int64_t kSoftEvery = 15'000'000;  // ns, between two surfaces that are kept

ServoSettings with_places(ServoSettings settings) {
  settings.touched_places = true;
  return settings;
}
// Forces begin wherever the stylus is: an object that it is inside of gives none until it was left.
constexpr HomeZone kAnywhere{.radius = 0, .rest = 0};

}  // namespace

LiveTouch::LiveTouch(Device& device, Clock& clock, Settings settings)
    : settings_(std::move(settings)),
      shown_(settings_.spec.objects),
      patience_(has_motors(device.capabilities())),
      servo_(device, clock, with_places(settings_.servo)) {
  prepare(shown_);  // faults of the scene are told before there is a window
  recorder_ = std::jthread([this](const std::stop_token& stop) { record(stop); });
}

LiveTouch::~LiveTouch() {
  emergency_zero();
  recorder_.request_stop();
}

protocols::SceneSpec LiveTouch::with_objects(
    const std::vector<stimuli::ObjectSpec>& objects) const {
  protocols::SceneSpec spec = settings_.spec;
  spec.objects = objects;
  if (settings_.limit) settings_.limit(spec.objects);
  return spec;
}

void LiveTouch::prepare(const std::vector<stimuli::ObjectSpec>& objects) {
  servo_.prepare(build_scene(settings_.scene_path, with_objects(objects), *settings_.renderer),
                 *settings_.renderer, kAnywhere);
}

std::int64_t LiveTouch::period_ns() const {
  return static_cast<std::int64_t>(1e9 / settings_.servo.rate);
}

void LiveTouch::keep(const Sample& sample, std::span<const rendering::BodyPose> bodies) {
  if (sample.time_ns == last_ns_) return;  // the servo has stopped: its last one again
  last_ns_ = sample.time_ns;
  patience_.begin();
  SceneMoment moment{.sample = sample, .contacts = {}};
  if (stepping_) {  // the hand got next to nothing: shown is what it would have got
    moment.sample.device1 = sample.rendering.device1;
    moment.sample.device2 = sample.rendering.device2;
    moment.sample.faults &= ~servo_fault::kForceLimited;
  }
  if (sample.rendering.contacts > 0) add_contacts(moment);
  // Pauses are no part of the scene's time.
  if (gap_) paused_ns_ = sample.time_ns - shown_ns_ - period_ns();
  gap_ = false;
  shown_ns_ = sample.time_ns - paused_ns_;
  moment.sample.time_ns = shown_ns_;
  update_soft(sample.time_ns);
  for (const auto& surface : soft_) {
    if (surface != nullptr) moment.soft.push_back(surface);
  }
  const WorkspaceMap& map = settings_.servo.workspace;
  if (map.reach) moment.held = unstretched(*map.reach, sample.probe);
  moment.poses = object_poses(shown_, bodies);
  const std::lock_guard lock(mutex_);
  if (fresh_.size() == Timeline::kMost)  // of a display that stalls: the last minute is enough
    fresh_.erase(fresh_.begin(), fresh_.begin() + static_cast<std::ptrdiff_t>(fresh_.size() / 4));
  fresh_.push_back(std::move(moment));
  recorded_.fetch_add(1);
}

/// Where forces are off or limited, what was rendered is not what the hand got: one place then,
/// with that.
void LiveTouch::add_contacts(SceneMoment& moment) {
  const Sample& sample = moment.sample;  // with the servo's time still
  constexpr std::uint32_t kNotAsRendered = servo_fault::kForceLimited | servo_fault::kTripped;
  while (touched_.time_ns < sample.time_ns && servo_.touched(touched_)) {
  }
  if (touched_.time_ns == sample.time_ns && (sample.faults & kNotAsRendered) == 0) {
    moment.contacts.assign(touched_.places.begin(),
                           touched_.places.begin() + static_cast<std::ptrdiff_t>(touched_.count));
  } else {
    moment.contacts.push_back({sample.rendering.deepest.point, sample.device1 + sample.device2});
  }
}

void LiveTouch::update_soft(std::int64_t now_ns) {
  SoftThreads* const threads = servo_.soft_threads();
  if (threads == nullptr || threads->empty()) {
    soft_.clear();
    return;
  }
  if (now_ns < soft_ns_ + kSoftEvery && soft_.size() == threads->size()) return;
  soft_ns_ = now_ns;
  soft_.resize(threads->size());
  SoftSnapshot snapshot;
  for (std::size_t i = 0; i < threads->size(); ++i) {
    if (!(*threads)[i].latest(snapshot)) continue;
    soft_[i] = std::make_shared<const SoftSurfaceNow>(
        SoftSurfaceNow{(*threads)[i].object(), {snapshot.now.begin(), snapshot.now.end()}});
  }
}

void LiveTouch::tell_trouble(const std::string& trouble) {
  const std::lock_guard lock(mutex_);
  trouble_ = trouble;
}

void LiveTouch::keep_what_is_there() {
  while (const Sample* const sample = servo_.next_now()) keep(*sample, servo_.bodies());
}

void LiveTouch::stop_or_go_on(std::optional<std::vector<stimuli::ObjectSpec>> wanted) {
  const bool held = held_.load();
  if (held && running_) {
    servo_.stop();
    keep_what_is_there();
    running_ = false;
    steps_.store(0);
  }
  if (wanted) {
    const std::vector<stimuli::ObjectSpec> before = std::exchange(shown_, std::move(*wanted));
    try {
      if (held) {
        static_cast<void>(
            build_scene(settings_.scene_path, with_objects(shown_), *settings_.renderer));
        anew_ = true;
      } else {
        prepare(shown_);
        anew_ = stepping_ = false;
      }
    } catch (const std::exception& fault) {
      shown_ = before;
      tell_trouble(fault.what());
    }
  }
  const int steps = held ? steps_.exchange(0) : 0;
  if (held && steps <= 0) return;
  if (running_) return;
  if (stepping_) {  // those that are under way are all there is to come
    servo_.stop();
    keep_what_is_there();
  }
  stepping_ = held;
  gap_ = true;
  running_ = !held;
  patience_.begin();
  if (anew_) {
    prepare(shown_);  // as was tried before
    anew_ = false;
    if (!held) return;
    servo_.stop();
  }
  servo_.resume(static_cast<std::uint32_t>(steps));
}

void LiveTouch::record(const std::stop_token& stop) {
  patience_.begin();
  while (!stop.stop_requested()) {
    std::optional<std::vector<stimuli::ObjectSpec>> wanted;
    {
      const std::lock_guard lock(mutex_);
      wanted.swap(wanted_);
    }
    stop_or_go_on(std::move(wanted));
    keep_what_is_there();
    if (servo_.away() > 0) patience_.begin();
    if (running_ && patience_.is_over()) {
      servo_.emergency_zero();  // should it ever come back
      tell_trouble("the servo gives no more samples: forces are off");
    }
    std::this_thread::sleep_for(kIdle);
  }
}

void LiveTouch::take(std::vector<SceneMoment>& out) {
  std::vector<SceneMoment> taken;
  {
    const std::lock_guard lock(mutex_);
    taken.swap(fresh_);
  }
  out.insert(out.end(), std::make_move_iterator(taken.begin()),
             std::make_move_iterator(taken.end()));
}

void LiveTouch::show(const std::vector<stimuli::ObjectSpec>& objects) {
  const std::lock_guard lock(mutex_);
  wanted_ = objects;
  trouble_.clear();
}

void LiveTouch::emergency_zero() noexcept {
  servo_.emergency_zero();
  if (settings_.emergency) settings_.emergency();
}

std::string LiveTouch::trouble() const {
  const std::lock_guard lock(mutex_);
  return trouble_;
}

}  // namespace palpate::runner
