#include "runner/devices/haply/messages.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "data/base/json_text.h"

namespace palpate::runner::devices::haply {
namespace {

using Json = nlohmann::json;

constexpr std::array<const char*, 3> kGrips = {"verse_grip", "wireless_verse_grip",
                                               "custom_verse_grip"};

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

const Json* member(const Json& of, const char* name) {
  if (!of.is_object()) return nullptr;
  const auto found = of.find(name);
  return found != of.end() ? &*found : nullptr;
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

std::string text(const Json& of, const char* name, const std::string& otherwise = "") {
  const Json* const found = member(of, name);
  return found != nullptr && found->is_string() ? found->get<std::string>() : otherwise;
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

/// Whether a mount or transform moves positions: it has numbers other than 0 and 1.
bool moves(const Json& transform) {
  if (transform.is_structured()) {
    for (const Json& part : transform)
      if (moves(part)) return true;
    return false;
  }
  return transform.is_number() && transform.get<double>() != 0 && transform.get<double>() != 1;
}

std::uint8_t buttons_of(const Json& state) {
  unsigned out = flag(state, "button", false) ? 1U : 0U;
  if (const Json* const named = member(state, "buttons")) {
    unsigned bit = 0;
    for (const char* name : {"a", "b", "c"}) out |= (flag(*named, name, false) ? 1U : 0U) << bit++;
  }
  return static_cast<std::uint8_t>(out);
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
      if (const Json* const basis = member(*config, "basis"))
        one.basis = text(*basis, "permutation", "XYZ");
      if (const Json* const mount = member(*config, "mount")) one.mounted = moves(*mount);
      if (const Json* const filters = member(*config, "filters"))
        one.filters = filters->dump(-1, ' ', true, Json::error_handler_t::replace);
    }
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

std::string command(const std::string& arm, const Vec3& force, Dialect dialect, bool first) {
  std::array<char, 512> out{};
  // The id comes from the service's list; escape it for JSON.
  const std::string id = Json(arm).dump(-1, ' ', true, Json::error_handler_t::replace);
  const char* const key = dialect == Dialect::vector ? "vector" : "values";
  const int size = std::snprintf(
      out.data(), out.size(),
      R"({%s"inverse3":[{"device_id":%s,%s"commands":{"set_cursor_force":{"%s":{"x":%.6g,"y":%.6g,"z":%.6g}}}}]})",
      first ? R"("session":{"configure":{"profile":{"name":"palpate"}}},)" : "", id.c_str(),
      first ? R"("configure":{"preset":"arm_front_centered"},)" : "", key, force.x, force.y,
      force.z);
  if (size < 0 || static_cast<std::size_t>(size) >= out.size())
    throw std::runtime_error("the device's name is too long for a command");
  return {out.data(), static_cast<std::size_t>(size)};
}

}  // namespace palpate::runner::devices::haply
