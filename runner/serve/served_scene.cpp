#include "runner/serve/served_scene.h"

#include <algorithm>
#include <utility>

#include "protocols/fault_list.h"
#include "protocols/json_document.h"
#include "runner/safety/fault_signals.h"
#include "runner/scene_builder.h"
#include "runner/session/device_check.h"
#include "stimuli/polygon_soup.h"

namespace palpate::runner::serve {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

// Forces begin wherever the stylus is: an object around it gives none until the stylus has left it.
constexpr servo::HomeZone kFromHere{.radius = 0, .rest = 0};
constexpr std::int64_t kStartPatience = 2'000'000'000;  // ns, for the first tick with forces
constexpr int kLeft = 20;  // ticks without contact, longer than chatter at an edge

const rendering::Renderer& named_renderer(const std::string& name) {
  return renderer_for(name == "ray" ? protocols::RendererKind::ray
                                    : protocols::RendererKind::point);
}

/// \throws MessageRefused with every reason why the device cannot render it
void hold_against(const servo::DeviceCapabilities& device, const protocols::Protocol& protocol) {
  std::vector<Refusal> why;
  for (std::size_t i = 0; i < protocol.stimuli.size(); ++i) {
    const session::ShowableMaterial can =
        session::showable(protocol.stimuli[i].object.material, device, protocol.servo_rate,
                          session::felt_gain(protocol), protocol.passivity_controller);
    if (can.fraction < 1)
      why.push_back({"too-stiff", can.reason, protocols::child_pointer("/objects", i)});
  }
  if (why.empty()) {
    for (const std::string& reason :
         session::incompatibilities(protocol, StimulusLibrary(protocol), device))
      why.push_back({"cannot-be-shown", reason, ""});
  }
  if (!why.empty()) throw MessageRefused(std::move(why));
}

}  // namespace

protocols::Protocol protocol_of(const protocols::SceneSpec& spec,
                                const rendering::Renderer& renderer) {
  protocols::Protocol out;
  out.name = "scene";
  out.renderers = {renderer.side_contact() ? protocols::RendererKind::ray
                                           : protocols::RendererKind::point};
  out.orientation = protocols::OrientationKind::fixed;
  out.tool = spec.tool;
  out.reach = spec.reach;
  for (std::size_t i = 0; i < spec.objects.size(); ++i)
    out.stimuli.push_back({"object-" + std::to_string(i), spec.objects[i]});
  return out;
}

ServedScene::ServedScene(servo::Device& device, safety::GuardedDevice* guard, servo::Clock& clock,
                         Settings settings)
    : device_(device.capabilities()),
      guard_(guard),
      clock_(clock),
      settings_(std::move(settings)),
      patience_(servo::has_motors(device_)),
      servo_(device, clock, settings_.servo),
      forces_(servo_, guard, clock) {
  if (settings_.scene.empty()) return;
  // A device with three degrees of freedom needs the point renderer.
  const bool ray = device_.sensed_freedom >= 5;
  const protocols::SceneSpec spec = read(settings_.scene, named_renderer(ray ? "ray" : "point"));
  protocols::FaultList none(settings_.scene_path);  // it was read without faults just now
  keep(protocols::read_json(settings_.scene, none), spec);
}

ServedScene::~ServedScene() { emergency_zero(); }

void ServedScene::emergency_zero() noexcept { forces_.off(); }

bool ServedScene::emergency(std::uint64_t client) {
  const bool first = emergencies_.raise(client);  // before zero force is seen, with its reason
  forces_.off();
  return first;
}

MessageRefused ServedScene::forces_off() const {
  if (emergencies_.any()) return {emergencies_.why().code, emergencies_.why().words};
  return {"forces-off", "forces are off (" + held_by_->words + "): clear first"};
}

json ServedScene::state() const {
  const std::lock_guard lock(mutex_);
  return {{"scene", scene_}};
}

std::string ServedScene::picture() const {
  const std::lock_guard lock(mutex_);
  return picture_;
}

void ServedScene::keep(json scene, const protocols::SceneSpec& spec) {
  std::string picture = settings_.picture(spec.objects);
  const std::lock_guard lock(mutex_);
  scene_.swap(scene);
  picture_.swap(picture);
}

void ServedScene::tell(const std::string& name, std::int64_t t_ns, const ordered_json& more) {
  output_->tell(event(name, t_ns, more));
}

/// \throws MessageRefused
protocols::SceneSpec ServedScene::read(const std::string& text,
                                       const rendering::Renderer& renderer) const {
  try {
    protocols::SceneSpec spec = protocols::parse_scene_text(text, settings_.scene_path);
    protocols::Protocol protocol = protocol_of(spec, renderer);
    protocol.servo_rate = settings_.servo.rate;
    hold_against(device_, protocol);
    return spec;
  } catch (const protocols::InputError& error) {
    std::vector<Refusal> why;
    for (const protocols::Fault& fault : error.faults())
      why.push_back({"bad-scene", fault.expected, fault.location});
    throw MessageRefused(std::move(why));
  } catch (const stimuli::MeshError& error) {
    std::vector<Refusal> why;
    for (const std::string& fault : error.faults()) why.push_back({"bad-scene", fault, ""});
    throw MessageRefused(std::move(why));
  }
}

void ServedScene::load(json scene) {
  if (trial_) throw MessageRefused("running", "a scene is running: stop it first");
  // The servo's reach is fixed when it starts.
  if (scene.contains("reach") || scene_.contains("reach"))
    throw MessageRefused("cannot-be-shown", "a reach is possible with --scene only", "/reach");
  const bool ray = device_.sensed_freedom >= 5;
  const std::string text = scene.dump();
  const protocols::SceneSpec spec = read(text, named_renderer(ray ? "ray" : "point"));
  keep(std::move(scene), spec);
  tell("loaded", clock_.now_ns(), {{"objects", spec.objects.size()}});
}

void ServedScene::show(const protocols::SceneSpec& spec, const rendering::Renderer& renderer) {
  try {
    const rendering::Scene scene = SceneBuilder().build(
        spec.objects, renderer.side_contact(), tool_of(spec.tool), spec.gravity,
        spec.tool.radius > 0 ? spec.tool.radius : protocols::kSoftRadius);
    if (trial_ && servo_.change_feel(scene)) return;
    servo_.prepare(scene, renderer, kFromHere);
  } catch (const stimuli::MeshError& error) {
    throw MessageRefused("bad-scene", error.what());
  }
  patience_.begin();
}

void ServedScene::start(std::uint64_t client, const Message& message) {
  if (trial_) throw MessageRefused("running", "a scene is running: stop it first");
  if (scene_.is_null()) throw MessageRefused("no-scene", "load a scene first");
  if (held_by_ || emergencies_.any()) throw forces_off();
  if (!message.wanted.stimulus.empty() || message.wanted.level || message.orientation ||
      !message.intervals.empty())
    throw MessageRefused("bad-message",
                         "stimulus, level, orientation and intervals are for --protocol only");
  const rendering::Renderer& renderer =
      named_renderer(message.wanted.renderer.empty() ? "ray" : message.wanted.renderer);
  const protocols::SceneSpec spec = read(scene_.dump(), renderer);
  shown_.store(true);
  try {
    show(spec, renderer);
  } catch (...) {
    shown_.store(false);
    throw;
  }
  renderer_ = &renderer;
  trial_ = Trial{
      .asked_ns = clock_.now_ns(), .client = client, .id = message.id, .number = message.trial};
}

/// A material changes gradually under the hand. Anything else restarts the scene with the value:
/// its forces rise by the ramp, once the stylus is outside.
void ServedScene::set(std::uint64_t client, const Message& message) {
  if (scene_.is_null()) throw MessageRefused("no-scene", "load a scene first");
  if (trial_ && !trial_->holds) throw MessageRefused("running", "the scene is about to begin");
  json changed = scene_;
  try {
    // A member that the scene omits has its default and may be set.
    const json::json_pointer path(message.path);
    const json::json_pointer in = path.parent_pointer();
    if (!changed.contains(in) || (changed[in].is_array() && !changed.contains(path)))
      throw MessageRefused("bad-message", "no such object in the scene", "/path");
    changed[path] = message.value;
  } catch (const json::exception&) {
    throw MessageRefused("bad-message", "no such place in the scene", "/path");
  }
  const std::string text = changed.dump();
  const bool ray = trial_ ? renderer_->side_contact() : device_.sensed_freedom >= 5;
  const protocols::SceneSpec spec = read(text, named_renderer(ray ? "ray" : "point"));
  if (trial_) show(spec, *renderer_);
  keep(std::move(changed), spec);
  tell("set", clock_.now_ns(), {{"path", message.path}, {"value", message.value}});
  output_->reply(client, accepted(message.id));
}

ordered_json ServedScene::end_trial() {
  const servo::ServoQuality quality = servo_.stop();
  shown_.store(false);
  attend();
  const Trial trial = *std::exchange(trial_, {});
  ordered_json out;
  if (trial.number) out["trial"] = *trial.number;
  const auto since_zero = [&](std::int64_t t_ns) {
    return static_cast<double>(t_ns - trial.zero_ns) * 1e-9;
  };
  out["zero_t_ns"] = trial.zero_ns;
  out["first_contact_s"] = trial.first_contact_ns > 0
                               ? ordered_json(since_zero(trial.first_contact_ns))
                               : ordered_json();
  out["ticks"] = quality.ticks;
  out["missed_ticks"] = quality.missed_ticks;
  out["max_force_n"] = quality.max_force;
  out["faults"] = safety::fault_words(quality.faults);
  return out;
}

void ServedScene::mark(session::Marker::Kind kind, std::int64_t t_ns, const std::string& response,
                       int code) {
  if (settings_.markers == nullptr) return;
  marker_.kind = kind;
  marker_.time_ns = t_ns;
  marker_.response = response;
  marker_.code = code;
  settings_.markers->send(marker_);
}

void ServedScene::drop_pending(const std::string& code, const std::string& why) {
  servo_.stop();
  shown_.store(false);
  const Trial trial = *std::exchange(trial_, {});
  output_->reply(trial.client, refused(trial.id, {{code, why, ""}}));
}

void ServedScene::clear(std::uint64_t client, const Message& message) {
  const std::set<std::uint64_t> lifted = emergencies_.lift(client);
  if (trial_) end_trial();
  const std::string trouble = forces_.allow(stop_, message.times_off);
  if (!trouble.empty()) {
    emergencies_.restore(lifted);
    throw MessageRefused(emergencies_.any() ? emergencies_.why().code : "forces-off", trouble);
  }
  held_by_.reset();
  silent_.store(false);
  tell("cleared", clock_.now_ns());
  output_->reply(client, accepted(message.id));
}

void ServedScene::obey(std::uint64_t client, const Message& message) {
  try {
    switch (message.type) {
      case MessageType::load:
        load(message.scene);
        return output_->reply(client, accepted(message.id));
      case MessageType::start:
        return start(client, message);
      case MessageType::set:
        return set(client, message);
      case MessageType::answer: {
        if (!trial_ || !trial_->holds)
          throw MessageRefused("nothing-felt", "no scene is running: start first");
        const std::int64_t now = clock_.now_ns();
        const std::int64_t at = answer_time(message, now);
        if (at < trial_->zero_ns || at > now)
          throw MessageRefused("bad-message",
                               "expected a time of this trial, CLOCK_MONOTONIC in ns", "/t_ns");
        ordered_json out = end_trial();
        out["response"] = message.text;
        out["t_ns"] = at;
        out["stamped"] = stamped_by(message);
        out["response_time_s"] =
            static_cast<double>(at - out["zero_t_ns"].get<std::int64_t>()) * 1e-9;
        tell("answered", at, out);
        mark(session::Marker::Kind::response, at, message.text);
        return output_->reply(client, accepted(message.id, out));
      }
      case MessageType::stop: {
        if (trial_ && !trial_->holds) drop_pending("stopped", "stopped before forces were on");
        if (trial_) mark(session::Marker::Kind::cut_off, clock_.now_ns());
        ordered_json out = trial_ ? end_trial() : ordered_json::object();
        tell("stopped", clock_.now_ns(), {{"reason", message.text}});
        return output_->reply(client, accepted(message.id, out));
      }
      case MessageType::mark:
      case MessageType::note: {
        const std::int64_t now = clock_.now_ns();
        const bool is_mark = message.type == MessageType::mark;
        const ordered_json out = remark(message);
        tell(is_mark ? "mark" : "note", now, out);
        if (is_mark) mark(session::Marker::Kind::mark, now, "", message.code);
        return output_->reply(client, accepted(message.id, {{"t_ns", now}}));
      }
      case MessageType::clear:
        return clear(client, message);
      default:
        throw MessageRefused("bad-message", "not possible without --protocol");
    }
  } catch (const MessageRefused& error) {
    output_->reply(client, refused(message.id, error.why()));
  }
}

void ServedScene::controller_left() {
  if (!trial_) return;
  if (trial_->holds) {
    mark(session::Marker::Kind::cut_off, clock_.now_ns());
    end_trial();
  } else {
    drop_pending("stopped", "stopped before forces were on");
  }
  tell("stopped", clock_.now_ns(), {{"reason", "the controller has left"}});
}

/// The reason, from the first tick without forces.
WhyOff ServedScene::reason_of(const servo::Sample& sample) {
  if (emergencies_.any()) return emergencies_.why();
  if (silent_.exchange(false)) return {"client-silent", "the client was silent"};
  return why_off(sample.faults, sample.trouble);
}

void ServedScene::take_first(const servo::Sample& sample) {
  if (sample.faults & servo::servo_fault::kTripped) {
    held_by_ = reason_of(sample);
    const MessageRefused why = forces_off();
    return drop_pending(why.why().front().code, why.why().front().message);
  }
  if (sample.phase != servo::Phase::feeling) {
    if (clock_.now_ns() - trial_->asked_ns > kStartPatience)
      drop_pending("not-started", "forces did not begin: the servo gives no ticks with forces");
    return;
  }
  trial_->holds = true;
  trial_->zero_ns = sample.time_ns;
  ordered_json out = {{"t_ns", sample.time_ns}};
  if (trial_->number) out["trial"] = *trial_->number;
  output_->reply(trial_->client, accepted(trial_->id, out));
  out.erase("t_ns");
  tell("started", sample.time_ns, out);
  marker_.trial = static_cast<int>(trial_->number.value_or(marker_.trial + 1));
  marker_.renderer = renderer_->side_contact() ? "ray" : "point";
  mark(session::Marker::Kind::trial_start, sample.time_ns);
}

void ServedScene::take(const servo::Sample& sample) {
  last_ns_ = sample.time_ns;
  if (trial_ && !trial_->holds) take_first(sample);
  if (!trial_ || sample.phase != servo::Phase::feeling) return;
  if ((sample.faults & servo::servo_fault::kTripped) != 0 && !trial_->forces_off_sent) {
    trial_->forces_off_sent = true;
    shown_.store(false);
    held_by_ = reason_of(sample);
    mark(session::Marker::Kind::cut_off, sample.time_ns);
    tell("forces_off", sample.time_ns, {{"code", held_by_->code}, {"reason", held_by_->words}});
  }
  if (sample.rendering.contacts > 0) {
    trial_->without_contact = 0;
    trial_->in_contact = true;
    if (trial_->first_contact_ns == 0) {
      trial_->first_contact_ns = sample.time_ns;
      tell("first_contact", sample.time_ns, {{"object", sample.rendering.object}});
      mark(session::Marker::Kind::first_contact, sample.time_ns);
    }
  } else if (trial_->in_contact && ++trial_->without_contact == kLeft) {
    trial_->in_contact = false;
    tell("left", sample.time_ns);
  }
  ticks_.push(sample);
  if (settings_.stream != nullptr) settings_.stream->push(sample);
}

void ServedScene::attend() {
  while (const servo::Sample* const sample = servo_.next_now()) {
    if (sample->time_ns == last_ns_) continue;
    patience_.begin();
    take(*sample);
  }
  if (forces_.newest().trouble == servo::DeviceTrouble::guard_lost) {
    held_by_ = {"guard-lost", "the guard process has ended"};
    tell("fault", clock_.now_ns(), {{"code", held_by_->code}, {"reason", held_by_->words}});
    forces_.end_without_guard();
  }
  if (!trial_ || !patience_.is_over()) return;
  emergency_zero();
  held_by_ = {"stalled", "the servo gives no more samples"};
  tell("fault", clock_.now_ns(), {{"code", held_by_->code}, {"reason", held_by_->words}});
  patience_.begin();
}

}  // namespace palpate::runner::serve
