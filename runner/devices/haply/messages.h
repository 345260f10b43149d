#pragma once
// The JSON of Haply's Inverse Service (3.1 to 3.5), WebSocket on port 10001, as its documentation
// and public clients have it. Every message that is received is answered with one.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "stimuli/vec.h"

namespace palpate::runner::haply {

/// The key under which a service expects a force. Unknown keys are ignored there without an error.
enum class Dialect { values, vector };

struct ServiceVersion {
  int major = 0, minor = 0;
  std::string text;
};

/// From the reply to GET /version, bare or wrapped in {"ok": true, "data": ...}.
/// \throws std::runtime_error where it has no version, or one below 3.1
ServiceVersion parse_version(std::string_view reply);
/// 3.5 and newer have "vector".
Dialect dialect_of(const ServiceVersion& version);
/// From the reply to GET /settings/devices/force_scale; none where the service does not tell.
std::optional<double> parse_force_scale(std::string_view reply);

/// One arm or grip as the first message lists it.
struct Listed {
  std::string id;
  std::string basis = "XYZ";  ///< of an arm: which axis is which
  bool mounted = false;       ///< of an arm: positions are transformed
  bool in_use = false, calibrated = true;
  std::string filters;  ///< of an arm: JSON of what the service does to forces; for the record
};
struct Inventory {
  std::vector<Listed> arms, grips;
};
/// \throws std::runtime_error saying what was expected
Inventory parse_inventory(std::string_view message);

/// One arm with the grip on it, as a message tells. Frame as the world's: x right, y forward, z up.
struct State {
  Vec3 position;        ///< m
  Vec3 force;           ///< N, that the service applies; NaN where it does not say
  Vec3 axis{0, -1, 0};  ///< unit, from the grip's centre to the tail; needs a grip
  std::uint8_t buttons = 0;
  bool has_arm = false, has_grip = false;
  bool calibrated = true, powered = true;
};
/// The newest state of the arm and, unless `grip` is empty, the grip. What the message does not
/// have is missing from the result. \throws std::runtime_error where it is no such message
State parse_state(std::string_view message, const std::string& arm, const std::string& grip);

/// A command with a force on the hand, N. \param first  with the session's configuration
std::string command(const std::string& arm, const Vec3& force, Dialect dialect, bool first);

}  // namespace palpate::runner::haply
