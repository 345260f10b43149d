#include "tests/runner/devices/haply/emulated_service.h"

#include <sys/socket.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <list>
#include <nlohmann/json.hpp>

namespace palpate::runner::devices::testing {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using Json = nlohmann::ordered_json;
using tcp = asio::ip::tcp;

struct EmulatedService::Sockets {
  asio::io_context io;
  tcp::acceptor acceptor{io};
  std::mutex mutex;
  std::list<std::shared_ptr<tcp::socket>> open;
  std::list<std::thread> threads;
};

namespace {

constexpr double kBase_y = 0.208;  // m, from the base of the arm to the middle of its reach

bool starts(const std::string& preset, const char* how) { return preset.rfind(how, 0) == 0; }
bool ends(const std::string& preset) { return preset.find("_centered") != std::string::npos; }

Json vector(const std::array<double, 3>& v) { return {{"x", v[0]}, {"y", v[1]}, {"z", v[2]}}; }

/// Numbers of an identity are left out of a state.
Json transform_of(const EmulatedArm& arm) {
  Json out = Json::object();
  if (arm.workspace_y != 0) out["position"] = vector({0, arm.workspace_y, 0});
  if (arm.workspace_scale != 1)
    out["scale"] = vector({arm.workspace_scale, arm.workspace_scale, arm.workspace_scale});
  return out;
}

Json config_of(const EmulatedArm& arm) {
  const bool turned = starts(arm.preset, "led");
  Json mount = {{"position", vector({0, ends(arm.preset) ? -kBase_y : 0, 0})},
                {"rotation", {{"w", turned ? 0 : 1}, {"x", 0}, {"y", 0}, {"z", turned ? 1 : 0}}},
                {"scale", vector({arm.mount_scale, arm.mount_scale, arm.mount_scale})}};
  Json out = {
      {"type", "inverse3"},
      {"gravity_compensation", {{"enabled", arm.gravity}, {"scaling_factor", 1.0}}},
      {"basis", {{"permutation", arm.basis}}},
      {"mount", mount},
      {"filters", {{"force_gate", {{"gain", 0.3}}}, {"damping", {{"scalar", arm.damping}}}}}};
  if (arm.tells_preset) out["preset"] = arm.preset;
  return out;
}

/// The position that a client reads for a place of the hand in the world.
std::array<double, 3> cursor_of(const EmulatedArm& arm, std::array<double, 3> at) {
  if (!ends(arm.preset)) at[1] += kBase_y;
  if (starts(arm.preset, "led")) at[0] = -at[0], at[1] = -at[1];
  for (double& part : at) part *= arm.workspace_scale * arm.mount_scale;
  at[1] += arm.workspace_y;
  return at;
}

/// A preset in one of its forms; another form is ignored.
void configure(EmulatedArm& arm, const Json& wanted) {
  using Takes = EmulatedArm::Takes;
  const bool object = wanted.is_object() && wanted.contains("preset");
  if (object && (arm.takes == Takes::object || arm.takes == Takes::both))
    arm.preset = wanted["preset"];
  if (wanted.is_string() && (arm.takes == Takes::name || arm.takes == Takes::both))
    arm.preset = wanted;
}

}  // namespace

EmulatedService::EmulatedService(int port) : sockets_(std::make_unique<Sockets>()) {
  arms_[1].id = "04A1";
  arms_[1].present = arms_[1].has_grip = false;
  const tcp::endpoint place(asio::ip::make_address("127.0.0.1"), static_cast<unsigned short>(port));
  sockets_->acceptor.open(place.protocol());
  sockets_->acceptor.set_option(tcp::acceptor::reuse_address(true));
  sockets_->acceptor.bind(place);
  sockets_->acceptor.listen();
  acceptor_ = std::thread([this] { accept(); });
}

EmulatedService::~EmulatedService() {
  quit_.store(true);
  turn(false);
  shutdown(sockets_->acceptor.native_handle(), SHUT_RDWR);
  acceptor_.join();
  for (std::thread& one : sockets_->threads) one.join();
}

std::string EmulatedService::address() const {
  return "127.0.0.1:" + std::to_string(sockets_->acceptor.local_endpoint().port());
}

void EmulatedService::turn(bool on) {
  on_.store(on);
  if (on) return;
  const std::scoped_lock lock(sockets_->mutex);
  for (const auto& socket : sockets_->open) shutdown(socket->native_handle(), SHUT_RDWR);
  const std::scoped_lock arms(mutex_);
  for (EmulatedArm& arm : arms_) arm.force = {0, 0, 0};  // idle without its service
}

void EmulatedService::accept() {
  while (!quit_.load()) {
    boost::system::error_code error;
    auto socket = std::make_shared<tcp::socket>(sockets_->io);
    sockets_->acceptor.accept(*socket, error);
    if (error || quit_.load()) return;
    if (!on_.load()) continue;  // closed at once
    // Else a second reply in a row waits up to 40 ms for the receipt of the first.
    socket->set_option(tcp::no_delay(true), error);
    const std::scoped_lock lock(sockets_->mutex);
    sockets_->open.push_back(socket);
    sockets_->threads.emplace_back([this, socket] {
      std::array<bool, 2> commanded{};
      try {
        beast::flat_buffer buffer;
        http::request<http::string_body> request;
        http::read(*socket, buffer, request);
        if (!beast::websocket::is_upgrade(request)) {
          http::response<http::string_body> reply{http::status::ok, 11};
          const std::string target(request.target());
          const EmulatedArm arm = this->arm();
          if (target == "/version") {
            reply.body() = Json{{"ok", true}, {"data", {{"project_version", arm.version}}}}.dump();
          } else if (target == "/settings/devices/force_scale") {
            reply.body() = Json{{"force_scale", arm.force_scale}}.dump();
          } else {
            reply.result(http::status::not_found);
            reply.body() = R"({"ok":false,"error":"no such page"})";
          }
          reply.prepare_payload();
          http::write(*socket, reply);
          socket->shutdown(tcp::socket::shutdown_both);
          return;
        }
        beast::websocket::stream<tcp::socket&> stream(*socket);
        stream.accept(request);
        stream.text(true);
        stream.write(asio::buffer(inventory()));
        for (;;) {
          beast::flat_buffer message;
          stream.read(message);
          const std::string text = beast::buffers_to_string(message.data());
          const double delay = arm().delay;
          if (delay > 0) std::this_thread::sleep_for(std::chrono::duration<double>(delay));
          bool mute = false;
          const std::string reply = answer(text, mute, commanded);
          if (!mute) stream.write(asio::buffer(reply));
        }
      } catch (const std::exception&) {  // the client has disconnected: its arms are idle
        const std::scoped_lock arms(mutex_);
        for (std::size_t i = 0; i < arms_.size(); ++i)
          if (commanded[i]) arms_[i].force = {0, 0, 0};
      }
    });
  }
}

std::string EmulatedService::inventory() {
  const std::scoped_lock lock(mutex_);
  Json all = {{"session_id", 7}, {"inverse3", Json::array()}, {"verse_grip", Json::array()}};
  for (const EmulatedArm& arm : arms_) {
    if (!arm.present) continue;
    all["inverse3"].push_back(
        {{"device_id", arm.id},
         {"config", config_of(arm)},
         {"state", {{"transform", transform_of(arm)}}},
         {"status", {{"calibrated", arm.calibrated}, {"in_use", arm.in_use}}}});
  }
  if (arms_[0].has_grip)
    all["verse_grip"].push_back({{"device_id", "G1"}, {"state", Json::object()}});
  return all.dump();
}

std::string EmulatedService::answer(const std::string& message, bool& mute,
                                    std::array<bool, 2>& commanded) {
  const std::scoped_lock lock(mutex_);
  const Json in = Json::parse(message);
  const bool full = in.contains("session") && in["session"].contains("force_render_full_state");
  Json out = {{"inverse3", Json::array()}, {"verse_grip", Json::array()}};
  for (std::size_t i = 0; i < arms_.size(); ++i) {
    EmulatedArm& arm = arms_[i];
    // Ignore unknown keys; a command counts once, and only this client's.
    std::array<double, 3> force{0, 0, 0};
    for (const Json& one : in.value("inverse3", Json::array())) {
      if (one.value("device_id", "") != arm.id) continue;
      if (one.contains("configure")) configure(arm, one["configure"].value("preset", Json()));
      if (!one.contains("commands")) continue;
      commanded[i] = true;
      ++arm.commands;
      const Json& wanted = one["commands"].value("set_cursor_force", Json::object());
      const char* const key = arm.vector ? "vector" : "values";
      if (wanted.contains(key) && arm.calibrated && arm.powered && arm.present) {
        const Json& v = wanted[key];
        force = {v["x"].get<double>(), v["y"].get<double>(), v["z"].get<double>()};
      }
    }
    if (commanded[i] && !arm.frozen) arm.force = force;
    if (!arm.present) continue;
    std::array<double, 3> at = arm.hand;
    for (std::size_t k = 0; k < 3; ++k)
      if (arm.hand_stiffness > 0) at[k] += arm.force[k] / arm.hand_stiffness;
    out["inverse3"].push_back(
        {{"device_id", arm.id},
         {"state",
          {{"cursor_position", vector(cursor_of(arm, at))},
           {"transform", transform_of(arm)},
           {"cursor_velocity", vector({0, 0, 0})},
           {"current_cursor_force", vector(arm.force)}}},
         {"status", {{"calibrated", arm.calibrated}, {"power_supply", arm.powered}}}});
    arm.full_states += full ? 1 : 0;
    if (full) out["inverse3"].back()["config"] = config_of(arm);
  }
  const EmulatedArm& first = arms_[0];
  mute = first.mute;
  if (!first.instead.empty()) return first.instead;
  if (first.has_grip) {
    const auto& q = first.grip;
    out["verse_grip"].push_back(
        {{"device_id", "G1"},
         {"state",
          {{"button", first.button},
           {"hall", 1},
           {"orientation", {{"w", q[0]}, {"x", q[1]}, {"y", q[2]}, {"z", q[3]}}}}},
         {"status", {{"awake", first.awake}}}});
  }
  return out.dump();
}

}  // namespace palpate::runner::devices::testing
