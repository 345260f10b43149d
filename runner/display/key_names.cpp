#include "runner/display/key_names.h"

#include <GLFW/glfw3.h>

#include <algorithm>

#include "protocols/answer_keys.h"

namespace palpate::runner::display {
namespace {

const char* special(int key) {
  switch (key) {
    case GLFW_KEY_SPACE:
      return "space";
    case GLFW_KEY_ESCAPE:
      return "escape";
    case GLFW_KEY_ENTER:
    case GLFW_KEY_KP_ENTER:
      return "enter";
    case GLFW_KEY_TAB:
      return "tab";
    case GLFW_KEY_BACKSPACE:
      return "backspace";
    case GLFW_KEY_LEFT:
      return "left";
    case GLFW_KEY_RIGHT:
      return "right";
    case GLFW_KEY_UP:
      return "up";
    case GLFW_KEY_DOWN:
      return "down";
    default:
      return nullptr;
  }
}

/// The character of the key on a US keyboard; 0: none that a protocol can name.
char on_us_keyboard(int key) {
  if (key >= GLFW_KEY_KP_0 && key <= GLFW_KEY_KP_9) {
    return static_cast<char>('0' + key - GLFW_KEY_KP_0);
  }
  if (key >= GLFW_KEY_A && key <= GLFW_KEY_Z) return static_cast<char>('a' + key - GLFW_KEY_A);
  if (key > GLFW_KEY_SPACE && key <= GLFW_KEY_GRAVE_ACCENT) return static_cast<char>(key);
  return 0;
}

}  // namespace

const char* emergency_key_name(int key) {
  return key == GLFW_KEY_F12 ? "the key F12" : "the key Escape";
}

std::string keypad_character(int key) {
  if (key >= GLFW_KEY_KP_0 && key <= GLFW_KEY_KP_9)
    return {static_cast<char>('0' + key - GLFW_KEY_KP_0)};
  if (key == GLFW_KEY_KP_DECIMAL) return ".";
  return key == GLFW_KEY_KP_SUBTRACT ? "-" : "";
}

bool on_keypad(int key) { return key >= GLFW_KEY_KP_0 && key <= GLFW_KEY_KP_EQUAL; }

std::vector<std::string> key_names(int key, int scancode) {
  if (const char* const name = special(key)) return {name};
  std::vector<std::string> names;
  const char place = on_us_keyboard(key);
  if (!on_keypad(key)) {
    const char* const written = glfwGetKeyName(GLFW_KEY_UNKNOWN, scancode);
    if (written != nullptr && *written != 0) names.emplace_back(written);
  }
  if (place != 0 && (names.empty() || names.front() != std::string(1, place))) {
    names.emplace_back(1, place);
  }
  return names;
}

std::string match_key(const std::vector<std::string>& names,
                      const std::vector<std::pair<std::string, std::string>>& keys) {
  for (const std::string& name : names) {
    // A protocol may say "A" where the keyboard gives "a".
    const auto found =
        std::find_if(keys.begin(), keys.end(), [key = protocols::one_key(name)](const auto& entry) {
          return protocols::one_key(entry.first) == key;
        });
    if (found != keys.end()) return found->first;
  }
  return names.empty() ? std::string() : names.front();
}

}  // namespace palpate::runner::display
