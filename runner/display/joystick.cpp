#include "runner/display/joystick.h"

#include <array>
#include <cstdlib>
#include <string_view>
#include <utility>

namespace palpate::runner::display {
namespace {

constexpr double kPressed = 0.6, kReleased = 0.4;  // of an axis
constexpr std::array<std::pair<std::string_view, unsigned>, 4> kHatSides = {
    {{"up", 1U}, {"right", 2U}, {"down", 4U}, {"left", 8U}}};

}  // namespace

bool JoystickKeys::is_down(const std::string& input, const JoystickState& now) const {
  const std::size_t space = input.find(' ');
  const std::string kind = input.substr(0, space);
  char* end = nullptr;
  const unsigned long number = std::strtoul(input.c_str() + space, &end, 10);
  if (number < 1) return false;
  const auto at = static_cast<std::size_t>(number - 1);
  const std::string_view side = *end == ' ' ? end + 1 : end;
  if (kind == "button") return at < now.buttons.size() && now.buttons[at];
  if (kind == "axis") {
    if (at >= now.axes.size()) return false;
    const double along = side == "+" ? now.axes[at] : -now.axes[at];
    return along > (down_.contains(input) ? kReleased : kPressed);
  }
  for (const auto& [name, bit] : kHatSides) {
    if (name == side) return at < now.hats.size() && (now.hats[at] & bit) != 0;
  }
  return false;
}

std::vector<std::string> JoystickKeys::pressed(const std::optional<JoystickState>& now) {
  std::vector<std::string> out;
  if (!now) {
    connected_ = false;
    down_.clear();
    return out;
  }
  for (const auto& [input, key] : keys_) {
    const bool before = down_.contains(input);
    const bool is = is_down(input, *now);
    if (is && !before && connected_) out.push_back(key);
    if (is) down_.insert(input);
    if (!is) down_.erase(input);
  }
  connected_ = true;
  return out;
}

}  // namespace palpate::runner::display
