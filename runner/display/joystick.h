#pragma once
// Gamepads and foot pedals: their buttons, axes and hats stand for keys of the keyboard.

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace palpate::runner::display {

struct JoystickState {
  std::vector<bool> buttons;
  std::vector<double> axes;        ///< -1 to 1; a pedal that is up: -1
  std::vector<std::uint8_t> hats;  ///< bits: 1 up, 2 right, 4 down, 8 left
};

class Joystick {
 public:
  virtual ~Joystick() = default;
  /// The current state; none: nothing is connected.
  virtual std::optional<JoystickState> read() = 0;
};

/// The first connected device, read through GLFW. Use it in the main thread, after start_glfw.
std::unique_ptr<Joystick> make_joystick();

/// Detects presses from successive states.
class JoystickKeys {
 public:
  /// \param keys  "button 1", "axis 2 +", "hat 1 up" -> name of a key
  explicit JoystickKeys(std::map<std::string, std::string> keys) : keys_(std::move(keys)) {}

  /// Keys whose inputs held down were pressed since the last call. An input that is down on
  /// connection counts only after its release. An axis is pressed beyond 0.6 and released within
  /// 0.4.
  std::vector<std::string> pressed(const std::optional<JoystickState>& now);

 private:
  bool is_down(const std::string& input, const JoystickState& now) const;

  std::map<std::string, std::string> keys_;
  std::set<std::string> down_;  ///< inputs
  bool connected_ = false;
};

}  // namespace palpate::runner::display
