#include "runner/devices/haply/inverse3.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "data/base/json_text.h"
#include "data/base/text.h"
#include "runner/servo/realtime.h"

namespace palpate::runner::devices::haply {
namespace {

using Json = nlohmann::json;

constexpr std::array<const char*, 3> kGrips = {"verse_grip", "wireless_verse_grip",
                                               "custom_verse_grip"};

const Json* member(const Json& of, const char* name) {
  if (!of.is_object()) return nullptr;
  const auto found = of.find(name);
  return found != of.end() ? &*found : nullptr;
}

std::string text(const Json& of, const char* name, const std::string& otherwise = "") {
  const Json* const found = member(of, name);
  return found != nullptr && found->is_string() ? found->get<std::string>() : otherwise;
}

Json parsed(std::string_view text, const char* what) {
  Json out = json_or_discarded(text);
  if (!out.is_object())
    throw std::runtime_error(std::string("expected ") + what +
                             " as a JSON object from the service");
  return out;
}

/// The data of an HTTP reply, wrapped or not.
Json data_of(std::string_view reply, const char* what) {
  Json all = parsed(reply, what);
  const auto ok = all.find("ok");
  if (ok == all.end()) return all;
  if (*ok != true) throw std::runtime_error(std::string("the service does not report ") + what);
  const auto data = all.find("data");
  return data != all.end() ? *data : Json::object();
}

double number(const Json& of, const char* name) {
  const Json* const found = member(of, name);
  return found != nullptr && found->is_number() ? found->get<double>() : std::nan("");
}

bool flag(const Json& of, const char* name, bool otherwise) {
  const Json* const found = member(of, name);
  if (found == nullptr) return otherwise;
  if (found->is_boolean()) return found->get<bool>();
  return found->is_number() ? found->get<double>() != 0 : otherwise;
}

std::optional<Vec3> vector(const Json& of, const char* name) {
  const Json* const found = member(of, name);
  if (found == nullptr) return std::nullopt;
  return Vec3(number(*found, "x"), number(*found, "y"), number(*found, "z"));
}

/// \param take  called for each object of the array with a device_id
template <class Take>
void each(const Json& message, const char* array, Take take) {
  const Json* const all = member(message, array);
  if (all == nullptr || !all->is_array()) return;
  for (const Json& one : *all)
    if (!text(one, "device_id").empty()) take(one);
}

constexpr double kTurned = 1e-3, kScaled = 1e-3, kShifted = 1e-4;  // rad/2, of 1, m; rounding
constexpr double kDamped = 1e-3;                                   // N s/m; rounding

/// Whether a number that is left out, as those of an identity are, or given differs from
/// `identity`.
bool differs(const Json& of, const char* name, double identity, double tolerance) {
  const Json* const found = member(of, name);
  return found != nullptr &&
         !(found->is_number() && std::abs(found->get<double>() - identity) <= tolerance);
}

/// How a mount or transform changes positions: "turned", "scaled", "moved"; empty: not at all.
/// \param shifts  whether a position other than zero counts
std::string change_of(const Json& transform, bool shifts) {
  const auto any = [&transform](const char* part, double identity, double tolerance) {
    const Json* const found = member(transform, part);
    if (found == nullptr) return false;
    for (const char* axis : {"x", "y", "z"})
      if (differs(*found, axis, identity, tolerance)) return true;
    return false;
  };
  // A half turn has w = 0, which is left out or told; an identity has x = y = z = 0 and w = 1 or
  // -1.
  const Json* const rotation = member(transform, "rotation");
  if (any("rotation", 0, kTurned) || (rotation != nullptr && differs(*rotation, "w", 1, kTurned) &&
                                      differs(*rotation, "w", -1, kTurned)))
    return "turned";
  if (any("scale", 1, kScaled)) return "scaled";
  if (shifts && any("position", 0, kShifted)) return "moved";
  return "";
}

/// The settings that change an arm's positions (workspace, basis, mount) or what the hand feels of
/// forces (damping, N s/m); empty: nothing.
std::string change_of_arm(const Json& arm) {
  if (const Json* const state = member(arm, "state")) {
    if (const Json* const workspace = member(*state, "transform")) {
      const std::string change = change_of(*workspace, true);
      if (!change.empty()) return "its workspace is " + change + " (\"transform\")";
    }
  }
  const Json* const config = member(arm, "config");
  if (config == nullptr) return "";
  if (const Json* const basis = member(*config, "basis")) {
    const std::string order = text(*basis, "permutation", "XYZ");
    if (order != "XYZ" && order != "+X+Y+Z") return "its axes are permuted (basis " + order + ")";
  }
  if (const Json* const mount = member(*config, "mount")) {
    // The preset places the origin by it.
    const std::string change = change_of(*mount, false);
    if (!change.empty()) return "its mount is " + change;
  }
  if (const Json* const filters = member(*config, "filters")) {
    const Json* const damping = member(*filters, "damping");
    if (damping != nullptr && differs(*damping, "scalar", 0, kDamped))
      return "its motion is damped (\"filters\")";
  }
  return "";
}

/// Why the arm's weight is not compensated as it should; empty: it is, or is not told.
std::string trouble_of_gravity(const Json& config) {
  const Json* const gravity = member(config, "gravity_compensation");
  if (gravity == nullptr) return "";
  if (!flag(*gravity, "enabled", true)) return "off";
  return differs(*gravity, "scaling_factor", 1, kScaled) ? "scaled" : "";
}

std::uint8_t buttons_of(const Json& state) {
  unsigned out = flag(state, "button", false) ? 1U : 0U;
  if (const Json* const named = member(state, "buttons")) {
    unsigned bit = 0;
    for (const char* name : {"a", "b", "c"}) out |= (flag(*named, name, false) ? 1U : 0U) << bit++;
  }
  return static_cast<std::uint8_t>(out);
}

constexpr std::int64_t kExchange_ns = 250'000;
constexpr std::int64_t kSilent_ns = 25'000'000;      // without a state: the device counts as silent
constexpr std::int64_t kStale_ns = 500'000'000;      // the same state although forces change
constexpr std::int64_t kUnheeded_ns = 200'000'000;   // a sent force that is not reported
constexpr double kHeeded = 0.1, kFelt = 0.3;         // share of the force; least force checked, N
constexpr double kFarthest = 0.5;                    // m; no model reaches so far
constexpr double kMaxSpeed = 5, kJump = 1e-3;        // m/s and m
constexpr auto kPatience = std::chrono::seconds(2);  // for the list of devices
constexpr auto kWait = std::chrono::milliseconds(5);  // for a reply, before a look at quit_
constexpr int kWaitsUntilZero = 3;                    // without a reply the force becomes zero
constexpr std::int64_t kFullState_ns = 100'000'000;   // between two looks at the configuration
constexpr int kFullStates = 20;                       // asked for before a preset counts as ignored
constexpr int kMostUnanswered = 20;                   // zeros sent to such a service

// A reseller's numbers; the reach is the limit in the maker's tutorials.
constexpr double kMaxForce = 4, kMaxStiffness = 1000, kReach = 0.1, kResolution = 1e-5;

std::string service_of(const servo::DeviceConfig& config) {
  return config.service.empty() ? kService : config.service;
}

std::string advice_for(const std::string& service, const std::string& why) {
  return "Haply's Inverse Service at " + service + " cannot be used: " + why +
         "; is it running? (--service HOST:PORT names another)";
}

/// The first message of a new connection.
Inventory inventory_of(Link& link) {
  std::string_view message;
  if (!link.receive(message, kPatience)) throw LinkError("it sent no list of devices");
  return parse_inventory(message);
}

/// The arm's configuration in a message of the service; none: the message has nothing of it.
std::optional<Listed> asked(Link& link, const std::string& message, const std::string& arm) {
  link.send(message);
  std::string_view reply;
  if (!link.receive(reply, kPatience)) throw LinkError("it does not answer");
  const Json all = parsed(reply, "a state");
  bool told = false;
  each(all, "inverse3", [&](const Json& one) {
    told = told || (text(one, "device_id") == arm && member(one, "config") != nullptr);
  });
  if (!told) return std::nullopt;
  for (Listed& one : parse_inventory(reply).arms)
    if (one.id == arm) return std::move(one);
  return std::nullopt;
}

/// Sets the preset in the form of the service's version, else in the other, and reads it back.
/// Nothing is commanded meanwhile. \throws std::runtime_error naming what is not as it must be
Listed configure(Link& link, const std::string& arm, const ServiceVersion& version,
                 Dialect dialect) {
  const bool documented = version.major > 3 || version.minor >= 5;
  std::optional<Listed> told;
  for (const bool first : {true, false}) {
    const PresetForm form = documented == first ? PresetForm::object : PresetForm::name;
    std::string message = configuration(arm, form);
    for (int i = 0; i < kFullStates; ++i) {
      if (std::optional<Listed> now = asked(link, message, arm)) told = std::move(now);
      // An older service may report no preset: then send both forms, and look at the rest.
      if (told && told->preset == kPreset) return *told;
      message = command(arm, Vec3(0), dialect, true);
      servo::RealClock clock;
      clock.wait_until(clock.now_ns() + 5'000'000);
    }
  }
  if (!told)
    throw std::runtime_error("it does not tell the configuration of the Inverse3 '" +
                             printable(arm) + "', so its axes and its origin are unknown");
  if (told->preset.empty() && !documented) return *told;
  throw std::runtime_error("the Inverse3 '" + printable(arm) + "' does not take the preset '" +
                           kPreset + "' and stays in '" +
                           (told->preset.empty() ? "not told" : printable(told->preset)) +
                           "', so its origin is not in the middle of its reach: set that preset "
                           "in the maker's program");
}

servo::DeviceCapabilities capabilities_of(bool grip) {
  servo::DeviceCapabilities can;
  can.name = "inverse3";
  can.sensed_freedom = grip ? 5 : 3;
  can.actuated_freedom = 3;
  can.max_force = kMaxForce;
  can.max_stiffness = kMaxStiffness;
  can.max_rate = 1000;
  can.workspace_radius = kReach;
  can.resolution = kResolution;
  return can;
}

}  // namespace

ServiceVersion parse_version(std::string_view reply) {
  ServiceVersion out;
  out.text = text(data_of(reply, "its version"), "project_version");
  const char* at = out.text.data();
  const char* const end = at + out.text.size();
  const auto major = std::from_chars(at, end, out.major);
  if (major.ec == std::errc{} && major.ptr != end && *major.ptr == '.')
    std::from_chars(major.ptr + 1, end, out.minor);
  if (out.major < 3 || (out.major == 3 && out.minor < 1))
    throw std::runtime_error("the Inverse Service is version '" + out.text +
                             "'; palpate needs 3.1 or newer");
  return out;
}

Dialect dialect_of(const ServiceVersion& version) {
  return version.major > 3 || version.minor >= 5 ? Dialect::vector : Dialect::values;
}

std::optional<double> parse_force_scale(std::string_view reply) {
  try {
    const Json data = data_of(reply, "the scale of forces");
    for (const char* name : {"force_scale", "scale", "value"}) {
      const double scale = number(data, name);
      if (std::isfinite(scale)) return scale;
    }
  } catch (const std::runtime_error&) {  // older services lack this page
  }
  return std::nullopt;
}

Inventory parse_inventory(std::string_view message) {
  const Json all = parsed(message, "a list of devices");
  if (member(all, "inverse3") == nullptr)
    throw std::runtime_error("expected a list of devices with \"inverse3\" from the service");
  Inventory out;
  each(all, "inverse3", [&out](const Json& arm) {
    Listed one;
    one.id = text(arm, "device_id");
    if (const Json* const config = member(arm, "config")) {
      one.preset = text(*config, "preset");
      one.gravity = trouble_of_gravity(*config);
      if (const Json* const filters = member(*config, "filters"))
        one.filters = filters->dump(-1, ' ', true, Json::error_handler_t::replace);
    }
    one.changed = change_of_arm(arm);
    if (const Json* const status = member(arm, "status")) {
      one.in_use = flag(*status, "in_use", false);
      one.calibrated = flag(*status, "calibrated", true);
    }
    out.arms.push_back(std::move(one));
  });
  for (const char* kind : kGrips) {
    each(all, kind, [&out](const Json& grip) {
      out.grips.emplace_back();
      out.grips.back().id = text(grip, "device_id");
    });
  }
  return out;
}

State parse_state(std::string_view message, const std::string& arm, const std::string& grip) {
  const Json all = parsed(message, "a state");
  State out;
  each(all, "inverse3", [&](const Json& one) {
    const Json* const state = member(one, "state");
    if (text(one, "device_id") != arm || state == nullptr) return;
    const std::optional<Vec3> position = vector(*state, "cursor_position");
    if (!position) return;
    out.has_arm = true;
    out.position = *position;
    out.force = vector(*state, "current_cursor_force").value_or(Vec3(std::nan("")));
    const Json* const config = member(one, "config");
    const std::string preset = config != nullptr ? text(*config, "preset", kPreset) : kPreset;
    out.changed = preset != kPreset || !change_of_arm(one).empty();
    if (const Json* const status = member(one, "status")) {
      out.calibrated = flag(*status, "calibrated", true);
      out.powered = flag(*status, "power_supply", true);
    }
  });
  if (grip.empty()) return out;
  for (const char* kind : kGrips) {
    each(all, kind, [&](const Json& one) {
      const Json* const state = member(one, "state");
      if (text(one, "device_id") != grip || state == nullptr) return;
      const Json* const status = member(one, "status");
      if (status != nullptr && !flag(*status, "awake", true)) return;
      const Json* const q = member(*state, "orientation");
      if (q == nullptr) return;
      const glm::dquat turn(number(*q, "w"), number(*q, "x"), number(*q, "y"), number(*q, "z"));
      if (!(std::abs(glm::length(turn) - 1) < 0.05)) return;  // also if it is not finite
      out.has_grip = true;
      out.axis = glm::normalize(turn * Vec3(0, -1, 0));  // it points along its own +y
      out.buttons = buttons_of(*state);
    });
  }
  return out;
}

std::string command(const std::string& arm, const Vec3& force, Dialect dialect, bool full) {
  std::array<char, 512> out{};
  // The id comes from the service's list; escape it for JSON.
  const std::string id = Json(arm).dump(-1, ' ', true, Json::error_handler_t::replace);
  const char* const key = dialect == Dialect::vector ? "vector" : "values";
  const int size = std::snprintf(
      out.data(), out.size(),
      R"({%s"inverse3":[{"device_id":%s,"commands":{"set_cursor_force":{"%s":{"x":%.6g,"y":%.6g,"z":%.6g}}}}]})",
      full ? R"("session":{"force_render_full_state":{}},)" : "", id.c_str(), key, force.x, force.y,
      force.z);
  if (size < 0 || static_cast<std::size_t>(size) >= out.size())
    throw std::runtime_error("the device's name is too long for a command");
  return {out.data(), static_cast<std::size_t>(size)};
}

std::string configuration(const std::string& arm, PresetForm form) {
  const Json preset = form == PresetForm::object ? Json{{"preset", kPreset}} : Json(kPreset);
  const Json session = {{"configure", {{"profile", {{"name", "palpate"}}}}},
                        {"force_render_full_state", Json::object()}};
  const Json one = {{"device_id", arm}, {"configure", {{"preset", preset}}}};
  return Json{{"session", session}, {"inverse3", Json::array({one})}}.dump(
      -1, ' ', true, Json::error_handler_t::replace);
}

Pump::Pump(std::unique_ptr<Link> link, const Settings& settings)
    : link_(std::move(link)), settings_(settings), thread_([this] { run(); }) {}

Pump::~Pump() {
  quit_.store(true);
  thread_.join();
}

void Pump::push(const Vec3& force) noexcept {
  wanted_.write({force.x, force.y, force.z, servo::RealClock().now_ns()});
}

const Pump::Newest& Pump::newest() noexcept {
  newest_.read(seen_);
  return seen_;
}

void Pump::run() noexcept {
  servo::request_realtime({84, false, -1, false});  // below the guard, which reads it
  servo::RealClock clock;
  std::int64_t due = clock.now_ns();
  try {
    while (!quit_.load()) {
      exchange();
      due = std::max(due + kExchange_ns, clock.now_ns() - kExchange_ns);
      clock.wait_until(due);
    }
    wanted_.write({});
    exchange(true);
  } catch (const LinkError&) {
    give_up(servo::DeviceTrouble::service_gone);
  } catch (const std::exception&) {  // of a message: the connection may still carry a command
    give_up(servo::DeviceTrouble::unreadable);
    try {
      send(Vec3(0));
    } catch (const LinkError&) {  // closed below
    }
  }
  link_.reset();  // a service that has lost its client idles the arm
}

void Pump::give_up(servo::DeviceTrouble trouble) noexcept {
  last_.trouble = trouble;
  last_.time_ns = servo::RealClock().now_ns();
  newest_.write(last_);
}

void Pump::send(const Vec3& force, bool full) {
  link_->send(command(settings_.arm, force, settings_.dialect, full));
}

std::optional<Pump::Reply> Pump::receive() {
  std::string_view message;
  int commands = 1;  // without a reply
  for (int waits = 1; !link_->receive(message, kWait); ++waits) {
    if (quit_.load()) return std::nullopt;
    if (waits < kWaitsUntilZero || commands > kMostUnanswered) continue;
    // A service that does not answer may still obey, and must not hold the last force.
    send(Vec3(0));
    ++commands;
  }
  Reply newest;
  do {
    newest = {parse_state(message, settings_.arm, settings_.grip),
              std::hash<std::string_view>()(message)};
    // Then the replies to the zeros, unless they are lost.
  } while (--commands > 0 && link_->receive(message, kWait));
  return newest;
}

void Pump::exchange(bool last) {
  servo::RealClock clock;
  Wanted wanted;
  while (!wanted_.read(wanted)) {
  }
  const std::int64_t asked_ns = clock.now_ns(), age = asked_ns - wanted.time_ns;
  Vec3 force(wanted.x, wanted.y, wanted.z);
  if (static_cast<double>(age) * 1e-9 > settings_.silence || !finite(force)) force = Vec3(0);
  // Another program may change the configuration at any time, by HTTP.
  const bool full = !last && asked_ns - asked_full_ns_ > kFullState_ns;
  if (full) asked_full_ns_ = asked_ns;
  send(force, full);
  if (wanted.time_ns != sent_wanted_ns_) {
    sent_wanted_ns_ = wanted.time_ns;
    force_ns_.store(clock.now_ns());
  }
  const std::optional<Reply> reply = receive();
  if (!reply) return;
  const servo::DeviceTrouble before = last_.trouble;
  last_ = {reply->state, asked_ns, clock.now_ns(), before};
  if (!reply->state.has_arm) {
    last_.trouble = servo::DeviceTrouble::unplugged;
  } else if (before == servo::DeviceTrouble::unplugged) {
    last_.trouble = servo::DeviceTrouble::none;
  }
  if (reply->state.changed) last_.trouble = servo::DeviceTrouble::in_use;
  watch(force, full ? last_message_ : reply->hash);  // a full state always differs from the others
  newest_.write(last_);
}

void Pump::watch(const Vec3& sent, std::size_t hash) noexcept {
  sent_changed_ = sent_changed_ || sent != sent_;
  sent_ = sent;
  if (hash != last_message_ || changed_ns_ == 0) {
    changed_ns_ = last_.time_ns;
    sent_changed_ = false;
  }
  last_message_ = hash;
  // If hand and force do not change, neither need the state.
  if (sent_changed_ && last_.time_ns - changed_ns_ > kStale_ns)
    last_.trouble = servo::DeviceTrouble::silent;
  const double size = glm::length(sent);
  const bool heeded = !finite(last_.state.force) || size < kFelt ||
                      glm::length(last_.state.force) >= kHeeded * size;
  if (heeded) {
    unanswered_ns_ = 0;
  } else if (unanswered_ns_ == 0) {
    unanswered_ns_ = last_.time_ns;
  } else if (last_.time_ns - unanswered_ns_ > kUnheeded_ns) {
    misunderstood_.store(true);
    last_.trouble = servo::DeviceTrouble::stopped_by_device;
  }
}

Inverse3Device::Inverse3Device(const servo::DeviceConfig& config, bool grip)
    : config_(config), may_have_grip_(grip), period_ns_(1e9 / config.rate) {
  open();
}

void Inverse3Device::open() {
  const std::string service = service_of(config_);
  try {
    const ServiceVersion version = parse_version(get(service, "/version"));
    const std::optional<double> scale =
        parse_force_scale(get(service, "/settings/devices/force_scale"));
    if (scale && *scale != 1)
      throw std::runtime_error("it scales forces by " + std::to_string(*scale) +
                               ": set its force_scale to 1, so that forces are newtons");
    std::unique_ptr<Link> link = connect(service);
    const Inventory found = inventory_of(*link);
    const std::string wanted = config_.serials.empty() ? "" : config_.serials[0];
    std::string ids;
    const Listed* arm = nullptr;
    for (const Listed& one : found.arms) {
      ids += (ids.empty() ? "" : ", ") + printable(one.id);
      if (arm == nullptr && (wanted.empty() || one.id == wanted)) arm = &one;
    }
    if (arm == nullptr)
      throw std::runtime_error(wanted.empty()
                                   ? "it lists no Inverse3: check cable and power supply"
                                   : "it lists no Inverse3 '" + wanted +
                                         "'; there are: " + (ids.empty() ? "none" : ids));
    if (arm->in_use)
      throw std::runtime_error("another program commands the Inverse3 '" + arm->id +
                               "', and the forces of both would add up: end that program");
    Pump::Settings settings;
    settings.arm = arm->id;
    has_grip_ = may_have_grip_ && !found.grips.empty();
    if (has_grip_) settings.grip = found.grips[0].id;
    const bool vector = (dialect_of(version) == Dialect::vector) != other_dialect_;
    settings.dialect = vector ? Dialect::vector : Dialect::values;
    settings.silence = std::max(0.005, 5 / config_.rate);
    const Listed now = configure(*link, arm->id, version, settings.dialect);
    if (!now.changed.empty())
      throw std::runtime_error("another program's settings change the Inverse3 '" +
                               printable(arm->id) + "': " + now.changed +
                               "; end that program and reset them in the maker's program");
    if (!now.gravity.empty())
      throw std::runtime_error("the gravity compensation of the Inverse3 '" + printable(arm->id) +
                               "' is " + now.gravity +
                               ", so the hand would carry the arm: switch it on, with factor 1");
    capabilities_ = capabilities_of(has_grip_);
    capabilities_.serial = arm->id;
    capabilities_.calibration = "maker's: Inverse3 " + arm->id + ", Inverse Service " +
                                version.text + ", preset " +
                                (now.preset.empty() ? "not told" : now.preset) + ", filters " +
                                (now.filters.empty() ? "not told" : now.filters);
    pump_ = std::make_unique<Pump>(std::move(link), settings);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(advice_for(service, error.what()));
  }
  asked_ns_ = 0;
  // Wait for a first state.
  servo::RealClock clock;
  const std::int64_t give_up = clock.now_ns() + 2'000'000'000;
  while (pump_->newest().time_ns == 0 && clock.now_ns() < give_up)
    clock.wait_until(clock.now_ns() + 1'000'000);
}

void Inverse3Device::reopen() {
  if (pump_ && pump_->misunderstood()) other_dialect_ = !other_dialect_;
  pump_.reset();
  if (!capabilities_.serial.empty()) config_.serials = {capabilities_.serial};
  open();
}

bool Inverse3Device::plausible(const Pump::Newest& newest) noexcept {
  const Vec3& at = newest.state.position;
  // Measure from before the last state to after this one: a busy machine may stop the thread
  // anywhere.
  const double elapsed = asked_ns_ > 0 ? static_cast<double>(newest.time_ns - asked_ns_) * 1e-9 : 1;
  const double moved = glm::length(at - tip_);
  if (!finite(at) || glm::length(at) > kFarthest || !finite(newest.state.axis)) {
    asked_ns_ = 0;  // do not compare the next reading with it
    return false;
  }
  tip_ = at;
  tail_ = has_grip_ ? at + config_.stylus_length * newest.state.axis : at;
  asked_ns_ = newest.asked_ns;
  return elapsed >= 1 || moved <= kMaxSpeed * elapsed + kJump;
}

servo::DeviceReading Inverse3Device::read() noexcept {
  if (!pump_) {
    lost_ = true;
    return {{tip_, tail_}, 0, true, servo::DeviceTrouble::service_gone};
  }
  const Pump::Newest newest = pump_->newest();
  pose_ns_ = newest.asked_ns;
  const std::int64_t age = servo::RealClock().now_ns() - newest.time_ns;
  servo::DeviceTrouble trouble = newest.trouble;
  if (trouble == servo::DeviceTrouble::none && (newest.time_ns == 0 || age > kSilent_ns))
    trouble = servo::DeviceTrouble::silent;
  if (trouble == servo::DeviceTrouble::none && !newest.state.powered)
    trouble = servo::DeviceTrouble::silent;
  if (trouble == servo::DeviceTrouble::none && !newest.state.calibrated)
    trouble = servo::DeviceTrouble::not_calibrated;
  if (trouble == servo::DeviceTrouble::none && has_grip_ && !newest.state.has_grip)
    trouble = servo::DeviceTrouble::silent;
  if (trouble == servo::DeviceTrouble::none && !plausible(newest))
    trouble = servo::DeviceTrouble::implausible;
  lost_ = trouble != servo::DeviceTrouble::none;
  if (!lost_ && static_cast<double>(age) > 2 * period_ns_) trouble = servo::DeviceTrouble::late;
  return {{tip_, tail_}, newest.state.buttons, lost_, trouble};
}

void Inverse3Device::write(const Vec3& device1, const Vec3& device2) noexcept {
  if (!pump_) return;
  const Vec3 force = device1 + device2;
  pump_->push(lost_ || !finite(force) ? Vec3(0) : force);
}

void check(const servo::DeviceConfig& config) {
  if (config.serials.size() > 1)
    throw std::invalid_argument("inverse3 is one device; " + std::to_string(config.serials.size()) +
                                " serial numbers are given");
}

servo::DeviceCapabilities nominal(const servo::DeviceConfig& /*config*/) {
  servo::DeviceCapabilities can = capabilities_of(true);
  can.max_force = 0;
  return can;
}

std::vector<servo::ConnectedDevice> connected(const servo::DeviceConfig& config) {
  const std::string service = service_of(config);
  try {
    parse_version(get(service, "/version"));
    const std::unique_ptr<Link> link = connect(service);
    std::vector<servo::ConnectedDevice> out;
    for (const Listed& arm : inventory_of(*link).arms)
      out.push_back({arm.id, arm.in_use ? "another program commands it: end that program" : ""});
    return out;
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(advice_for(service, error.what()));
  }
}

std::unique_ptr<servo::Device> open(const servo::DeviceConfig& config) {
  return std::make_unique<Inverse3Device>(config);
}

std::unique_ptr<servo::Device> open_point(const servo::DeviceConfig& config) {
  return std::make_unique<Inverse3Device>(config, false);
}

}  // namespace palpate::runner::devices::haply
