#pragma once
// The JSON of Haply's Inverse Service (3.1 to 3.5), WebSocket on port 10001, according to its
// documentation and public clients. Every received message is answered by one.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "stimuli/vec.h"

namespace palpate::runner::devices::haply {

/// The key under which a service expects a force. The service ignores unknown keys without an
/// error.
enum class Dialect { values, vector };

struct ServiceVersion {
  int major = 0, minor = 0;
  std::string text;
};

/// From the reply to GET /version, bare or wrapped in {"ok": true, "data": ...}.
/// \throws std::runtime_error if it has no version, or one below 3.1
ServiceVersion parse_version(std::string_view reply);
/// 3.5 and newer have "vector".
Dialect dialect_of(const ServiceVersion& version);
/// From the reply to GET /settings/devices/force_scale; none: the service does not report it.
std::optional<double> parse_force_scale(std::string_view reply);

/// One arm or grip in the list of the first message.
struct Listed {
  std::string id;
  std::string basis = "XYZ";  ///< of an arm: order of its axes
  bool mounted = false;       ///< of an arm: positions are transformed
  bool in_use = false, calibrated = true;
  std::string filters;  ///< of an arm: the service's filters of forces as JSON; for the record
};
struct Inventory {
  std::vector<Listed> arms, grips;
};
/// \throws std::runtime_error with the expectation
Inventory parse_inventory(std::string_view message);

/// One arm and the grip on it, from a message. The frame is the world's: x right, y forward, z up.
struct State {
  Vec3 position;        ///< m
  Vec3 force;           ///< N, applied by the service; NaN: not reported
  Vec3 axis{0, -1, 0};  ///< unit, from the grip's centre to the tail; needs a grip
  std::uint8_t buttons = 0;
  bool has_arm = false, has_grip = false;
  bool calibrated = true, powered = true;
};
/// The newest state of the arm and, unless `grip` is empty, the grip. Values missing from the
/// message are missing from the result. \throws std::runtime_error if it is not such a message
State parse_state(std::string_view message, const std::string& arm, const std::string& grip);

/// A command with a force on the hand, N. \param first  with the session's configuration
std::string command(const std::string& arm, const Vec3& force, Dialect dialect, bool first);

}  // namespace palpate::runner::devices::haply
