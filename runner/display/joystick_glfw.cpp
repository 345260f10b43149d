#include <GLFW/glfw3.h>

#include "runner/display/joystick.h"

namespace palpate::runner::display {
namespace {

class GlfwJoystick final : public Joystick {
 public:
  std::optional<JoystickState> read() override {
    for (int id = GLFW_JOYSTICK_1; id <= GLFW_JOYSTICK_LAST; ++id) {
      if (glfwJoystickPresent(id) == GLFW_FALSE) continue;
      JoystickState state;
      int count = 0;
      const unsigned char* const buttons = glfwGetJoystickButtons(id, &count);
      for (int i = 0; buttons != nullptr && i < count; ++i)
        state.buttons.push_back(buttons[i] == GLFW_PRESS);
      const float* const axes = glfwGetJoystickAxes(id, &count);
      for (int i = 0; axes != nullptr && i < count; ++i)
        state.axes.push_back(static_cast<double>(axes[i]));
      const unsigned char* const hats = glfwGetJoystickHats(id, &count);
      for (int i = 0; hats != nullptr && i < count; ++i) state.hats.push_back(hats[i]);
      return state;
    }
    return std::nullopt;
  }
};

}  // namespace

std::unique_ptr<Joystick> make_joystick() { return std::make_unique<GlfwJoystick>(); }

}  // namespace palpate::runner::display
