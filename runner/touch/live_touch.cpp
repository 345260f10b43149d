#include "runner/touch/live_touch.h"

#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <iostream>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <utility>

#include "data/base/text.h"
#include "data/files/file_permissions.h"
#include "runner/display/explore_window.h"
#include "runner/display/timeline.h"
#include "runner/output/outputs.h"
#include "runner/output/progress_line.h"
#include "runner/safety/fault_signals.h"
#include "runner/serve/served_scene.h"
#include "runner/servo/sample.h"
#include "runner/session/device_check.h"
#include "runner/station/opening.h"
#include "runner/touch/forces.h"
#include "runner/touch/scene_notes.h"
#include "runner/usage_error.h"

namespace palpate::runner::touch {
namespace {

constexpr double kSoftInterval =
    0.015;  // s; a minute of every tick's surfaces would fill the memory

namespace fs = std::filesystem;

/// Keeps pictures as scene-1.png and so on, the first number that is free; clips likewise.
std::string keep_in(const std::string& folder, const std::string& bytes, const char* kind) {
  try {
    const std::string fault = data::resolve_trusted_links(folder).fault;
    if (!fault.empty()) throw std::runtime_error(folder + ": " + fault);
    fs::create_directories(folder);
    for (int number = 1;; ++number) {
      const fs::path path = fs::path(folder) / ("scene-" + std::to_string(number) + kind);
      if (fs::exists(path)) continue;
      output::write_whole(path.string(), bytes);
      return "kept as " + path.string();
    }
  } catch (const std::exception& fault) {
    return fault.what();
  }
}

display::ExploreSettings window_settings(const protocols::SceneSpec& spec,
                                         const rendering::Renderer& renderer,
                                         const HandsOnSettings& settings) {
  display::SceneDrawing drawing(spec.objects, tool_of(spec.tool));
  SceneBuilder builder;
  const rendering::Scene scene = touch::build_scene(builder, settings.scene_path, spec, renderer);
  for (const std::string& note : touch::scene_notes(spec, scene, builder))
    std::cerr << printable(settings.scene_path) << ": " << note << '\n';
  drawing.add_compiled(scene);
  display::ExploreSettings out{
      .title = fs::path(settings.scene_path).filename().string(),
      .objects = spec.objects,
      .drawing = std::move(drawing),
      .looks = {.sides = renderer.side_contact(), .labels = settings.labels}};
  if (!settings.pictures.empty())
    out.keep_picture = [folder = settings.pictures](const std::string& bytes, const char* kind) {
      return keep_in(folder, bytes, kind);
    };
  return out;
}

/// Signals that end the program command zero force while this lives.
class WatchedForces {
 public:
  WatchedForces(safety::FaultSignals& signals, servo::ServoThread& servo) : signals_(signals) {
    signals_.watch(&servo);
  }
  WatchedForces(const WatchedForces&) = delete;
  WatchedForces& operator=(const WatchedForces&) = delete;
  ~WatchedForces() {
    signals_.watch(static_cast<servo::ServoThread*>(nullptr));
    signals_.watch(static_cast<safety::GuardedDevice*>(nullptr));
  }

 private:
  safety::FaultSignals& signals_;
};

int explore_live(const protocols::SceneSpec& spec, const rendering::Renderer& renderer,
                 const HandsOnSettings& settings) {
  protocols::Protocol protocol = serve::protocol_of(spec, renderer);
  protocol.material_limit = protocols::MaterialLimit::limit;
  const station::RunSettings& run = settings.run;
  const devices::DeviceKind& kind = station::find_device_kind(run.device);
  display::ExploreSettings window = window_settings(spec, renderer, settings);
  auto sinks = station::open_markers(run);
  safety::FaultSignals signals;
  const station::OpenDevice open = station::open_device(kind, run, protocol);
  signals.watch(open.guard);
  session::Markers markers(std::move(sinks), protocols::usual_event_codes(), run.sync);
  const auto stream = station::open_stream(run, protocol.servo_rate);
  const servo::DeviceCapabilities& device = open.device->capabilities();
  if (open.guard != nullptr) station::check_fitness(open, run, protocol, StimulusLibrary(protocol));
  servo::RealClock clock;
  servo::ServoSettings servo;
  servo.rate = protocol.servo_rate;
  servo.workspace = workspace_of(protocol);
  window.mouse = dynamic_cast<devices::MouseStylus*>(open.device.get());
  window.workspace = servo.workspace;
  window.end_requested = [&signals] { return signals.end_requested() != 0; };
  const auto limit = [&](std::vector<stimuli::ObjectSpec>& objects) {
    protocols::Protocol limited = protocol;
    for (std::size_t i = 0; i < objects.size(); ++i) limited.stimuli[i].object = objects[i];
    for (const session::LimitedMaterial& what : session::limit_materials(limited, device))
      std::fprintf(stderr, "%s\n", printable(what.text).c_str());
    for (std::size_t i = 0; i < objects.size(); ++i) objects[i] = limited.stimuli[i].object;
  };
  LiveTouch touch(*open.device, clock,
                  {.scene_path = settings.scene_path,
                   .spec = spec,
                   .renderer = &renderer,
                   .servo = servo,
                   .limit = limit,
                   .emergency =
                       [guard = open.guard] {
                         if (guard != nullptr) guard->emergency_zero();
                       },
                   .markers = &markers,
                   .stream = stream.get()});
  const WatchedForces watched(signals, touch.servo());
  display::explore_in_window(std::move(window), touch);
  const servo::ServoHealth& health = touch.servo().health();
  std::cout << health.ticks() << " ticks, " << health.missed_ticks() << " missed, "
            << health.lost_samples() << " not shown\n";
  station::print_dropped(markers, stream.get());
  return 0;
}

constexpr auto kIdle = std::chrono::milliseconds(5);
constexpr std::int64_t kSoftEvery = 15'000'000;  // ns, between two surfaces that are kept

servo::ServoSettings with_places(servo::ServoSettings settings) {
  settings.touched_places = true;
  return settings;
}
// Forces begin at any place of the stylus: an object that encloses it exerts none until left.
constexpr servo::HomeZone kAnywhere{.radius = 0, .rest = 0};

}  // namespace

display::SceneMoment moment_of(const touch::TimedPose& pose, const protocols::SceneSpec& spec,
                               const rendering::Scene& scene, const rendering::Rendering& rendering,
                               const rendering::RenderState& state) {
  display::SceneMoment out{.sample = {},
                           .contacts = display::contact_places(scene, state, rendering)};
  out.sample.time_ns = std::llround(pose.t * 1e9);
  out.sample.probe = touch::virtual_stylus(spec, pose.probe);
  out.sample.rendering = rendering;
  out.sample.faults = rendering.faults;
  out.sample.device1 = rendering.device1;
  out.sample.device2 = rendering.device2;
  if (spec.reach) out.held = pose.probe;
  out.poses = display::object_poses(spec.objects, state);
  out.soft = display::soft_surfaces(scene, state);
  return out;
}

RecordedTouch::RecordedTouch(std::string scene_path, protocols::SceneSpec spec,
                             const rendering::Renderer& renderer,
                             std::vector<touch::TimedPose> poses)
    : scene_path_(std::move(scene_path)),
      spec_(std::move(spec)),
      renderer_(renderer),
      poses_(std::move(poses)) {
  touch();
}

void RecordedTouch::touch() {
  SceneBuilder builder;
  const rendering::Scene scene = touch::build_scene(builder, scene_path_, spec_, renderer_);
  const std::size_t stride =
      (poses_.size() + display::Timeline::kMost - 2) / (display::Timeline::kMost - 1);
  std::size_t row = 0;
  std::uint32_t faults = 0;
  double soft_time = -1;  // of the surfaces that were kept last: fewer than there are ticks
  std::vector<std::shared_ptr<const display::SoftSurfaceNow>> soft;
  moments_.clear();
  touch::render_along(
      scene, spec_, renderer_, poses_,
      [&](const touch::TimedPose& pose, const rendering::Rendering& rendering,
          const rendering::RenderState& state) {
        faults |= rendering.faults;  // of rows that are not kept as well
        if (row++ % stride != 0) return;
        moments_.push_back(moment_of(pose, spec_, scene, rendering, state));
        moments_.back().sample.faults = std::exchange(faults, 0);
        if (pose.t >= soft_time && pose.t < soft_time + kSoftInterval && soft_time >= 0) {
          moments_.back().soft = soft;
        } else {
          soft = moments_.back().soft;
          soft_time = pose.t;
        }
      });
}

void RecordedTouch::take(std::vector<display::SceneMoment>& out) {
  out.insert(out.end(), std::make_move_iterator(moments_.begin()),
             std::make_move_iterator(moments_.end()));
  moments_.clear();
}

void RecordedTouch::show(const std::vector<stimuli::ObjectSpec>& objects) {
  const std::vector<stimuli::ObjectSpec> before = std::exchange(spec_.objects, objects);
  trouble_.clear();
  try {
    touch();
  } catch (const std::exception& fault) {
    trouble_ = fault.what();
    spec_.objects = before;
    touch();
  }
}

int explore_hands_on(const protocols::SceneSpec& spec, const rendering::Renderer& renderer,
                     const HandsOnSettings& settings) {
  if (settings.trajectory.empty()) return explore_live(spec, renderer, settings);
  RecordedTouch touch(settings.scene_path, spec, renderer,
                      touch::read_trajectory(settings.trajectory));
  display::ExploreSettings window = window_settings(spec, renderer, settings);
  window.end_requested = [&stop = output::catch_stop_signals()] { return stop.load(); };
  display::explore_in_window(std::move(window), touch);
  return 0;
}

LiveTouch::LiveTouch(servo::Device& device, servo::Clock& clock, Settings settings)
    : settings_(std::move(settings)),
      shown_(settings_.spec.objects),
      patience_(servo::has_motors(device.capabilities())),
      servo_(device, clock, with_places(settings_.servo)) {
  prepare(shown_);  // reports faults of the scene before there is a window
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
  SceneBuilder builder;
  begun_ = touched_once_ = false;
  marker_.renderer = settings_.renderer->side_contact() ? "ray" : "point";
  servo_.prepare(
      touch::build_scene(builder, settings_.scene_path, with_objects(objects), *settings_.renderer),
      *settings_.renderer, kAnywhere);
}

std::int64_t LiveTouch::period_ns() const {
  return static_cast<std::int64_t>(1e9 / settings_.servo.rate);
}

void LiveTouch::keep(const servo::Sample& sample, std::span<const rendering::BodyPose> bodies) {
  if (sample.time_ns == last_ns_) return;  // the servo has stopped and repeats its last sample
  last_ns_ = sample.time_ns;
  patience_.begin();
  inform_recorders(sample);
  display::SceneMoment moment{.sample = sample, .contacts = {}};
  if (stepping_) {  // the hand got almost no force: show the full one
    moment.sample.device1 = sample.rendering.device1;
    moment.sample.device2 = sample.rendering.device2;
    moment.sample.faults &= ~servo::servo_fault::kForceLimited;
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
  moment.poses = display::object_poses(shown_, bodies);
  const std::lock_guard lock(mutex_);
  if (fresh_.size() == display::Timeline::kMost)  // a stalled display gets only the last minute
    fresh_.erase(fresh_.begin(), fresh_.begin() + static_cast<std::ptrdiff_t>(fresh_.size() / 4));
  fresh_.push_back(std::move(moment));
  recorded_.fetch_add(1);
}

void LiveTouch::inform_recorders(const servo::Sample& sample) {
  if (settings_.stream != nullptr) settings_.stream->push(sample);
  if (settings_.markers == nullptr || sample.phase != servo::Phase::feeling) return;
  const auto send = [&](session::Marker::Kind kind) {
    marker_.kind = kind;
    marker_.time_ns = sample.time_ns;
    settings_.markers->send(marker_);
  };
  if (!begun_) {
    ++marker_.trial;
    send(session::Marker::Kind::trial_start);
  }
  begun_ = true;
  if (touched_once_ || sample.rendering.contacts == 0) return;
  touched_once_ = true;
  send(session::Marker::Kind::first_contact);
}

/// Where forces are off or limited, what was rendered is not what the hand got: one place then,
/// with that.
void LiveTouch::add_contacts(display::SceneMoment& moment) {
  const servo::Sample& sample = moment.sample;  // with the servo's time still
  constexpr std::uint32_t kNotAsRendered =
      servo::servo_fault::kForceLimited | servo::servo_fault::kTripped;
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
  servo::SoftThreads* const threads = servo_.soft_threads();
  if (threads == nullptr || threads->empty()) {
    soft_.clear();
    return;
  }
  if (now_ns < soft_ns_ + kSoftEvery && soft_.size() == threads->size()) return;
  soft_ns_ = now_ns;
  soft_.resize(threads->size());
  servo::SoftSnapshot snapshot;
  for (std::size_t i = 0; i < threads->size(); ++i) {
    if (!(*threads)[i].latest(snapshot)) continue;
    soft_[i] = std::make_shared<const display::SoftSurfaceNow>(display::SoftSurfaceNow{
        (*threads)[i].object(), {snapshot.now.begin(), snapshot.now.end()}});
  }
}

void LiveTouch::report_trouble(const std::string& trouble) {
  const std::lock_guard lock(mutex_);
  trouble_ = trouble;
}

void LiveTouch::keep_what_is_there() {
  while (const servo::Sample* const sample = servo_.next_now()) keep(*sample, servo_.bodies());
}

void LiveTouch::stop_or_continue(std::optional<std::vector<stimuli::ObjectSpec>> wanted) {
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
      SceneBuilder builder;
      const bool restarts = !servo_.change_feel(touch::build_scene(
          builder, settings_.scene_path, with_objects(shown_), *settings_.renderer));
      anew_ = held && restarts;
      if (restarts && !held) {
        prepare(shown_);
        stepping_ = false;
      }
    } catch (const std::exception& fault) {
      shown_ = before;
      report_trouble(fault.what());
    }
  }
  const int steps = held ? steps_.exchange(0) : 0;
  if (held && steps <= 0) return;
  if (running_) return;
  if (stepping_) {  // no ticks follow the current ones
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
    stop_or_continue(std::move(wanted));
    keep_what_is_there();
    if (servo_.away() > 0) patience_.begin();
    if (running_ && patience_.is_over()) {
      servo_.emergency_zero();  // in case it returns
      report_trouble("the servo gives no more samples: forces are off");
    }
    std::this_thread::sleep_for(kIdle);
  }
}

void LiveTouch::take(std::vector<display::SceneMoment>& out) {
  std::vector<display::SceneMoment> taken;
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

}  // namespace palpate::runner::touch
