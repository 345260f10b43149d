#include "runner/display/window_layout.h"

#include <epoxy/gl.h>
// After epoxy, which replaces the GL headers.
#include <GLFW/glfw3.h>

#include <algorithm>

namespace palpate::runner {
namespace {

constexpr double kParticipantFraction = 0.4;  // of a monitor's width that both windows are on
constexpr int kFrame = 40;                    // px, for the decorations of the window manager

/// \param number  from 1; 0: `otherwise`, or the first if there are fewer
GLFWmonitor* monitor(int number, int otherwise) {
  int count = 0;
  GLFWmonitor** const all = glfwGetMonitors(&count);
  if (number < 0 || number > count) {
    throw DisplayError("monitor " + std::to_string(number) + " is not connected; there are " +
                       std::to_string(count));
  }
  if (count == 0) return nullptr;
  if (number > 0) return all[number - 1];
  return all[otherwise <= count ? otherwise - 1 : 0];
}

/// The desktop's scale if it sets one; else larger text on monitors of high resolution, where it
/// would be too small (3840 x 2160: half the size).
double scale_for(GLFWmonitor* on, double wanted) {
  constexpr double kMost = 4, kUsualHeight = 1080;  // px
  if (wanted > 0) return wanted;
  if (on == nullptr) return 1;
  float scale = 1, ignored = 1;
  glfwGetMonitorContentScale(on, &scale, &ignored);
  if (scale > 1) return std::min<double>(scale, kMost);
  int left = 0, top = 0, width = 0, height = 0;
  glfwGetMonitorWorkarea(on, &left, &top, &width, &height);
  return std::clamp(std::min(height / kUsualHeight, width / (kUsualHeight * 16 / 9)), 1.0, kMost);
}

/// The same monitor, or two that show the same part of the desktop.
bool overlap(GLFWmonitor* a, GLFWmonitor* b) {
  if (a == b) return true;
  int left[2], top[2], width[2], height[2];
  glfwGetMonitorWorkarea(a, &left[0], &top[0], &width[0], &height[0]);
  glfwGetMonitorWorkarea(b, &left[1], &top[1], &width[1], &height[1]);
  return left[0] < left[1] + width[1] && left[1] < left[0] + width[0] &&
         top[0] < top[1] + height[1] && top[1] < top[0] + height[0];
}

/// Centred in a part of the monitor. \param from, to  fractions of its width
WindowGeometry centred_in(GLFWmonitor* on, double from, double to, int width, int height) {
  int left = 0, top = 0, room_width = 1280, room_height = 800;
  if (on != nullptr) glfwGetMonitorWorkarea(on, &left, &top, &room_width, &room_height);
  left += static_cast<int>(from * room_width);
  room_width = static_cast<int>((to - from) * room_width);
  width = std::min(width, std::max(room_width - kFrame / 2, 200));
  height = std::min(height, std::max(room_height - kFrame, 200));
  return {nullptr, left + (room_width - width) / 2, top + (room_height - height) / 2, width,
          height};
}

}  // namespace

std::string glfw_reason() {
  const char* reason = nullptr;
  glfwGetError(&reason);
  return reason != nullptr ? reason : "no reason given";
}

WindowLayout lay_out_windows(const WindowSettings& settings) {
  GLFWmonitor* const participant = monitor(settings.participant_monitor, 2);
  GLFWmonitor* const console = monitor(settings.console_monitor, 1);
  WindowLayout layout;
  layout.shared = participant == nullptr || overlap(participant, console);
  layout.participant_scale = scale_for(participant, settings.ui_scale);
  layout.console_scale = scale_for(console, settings.ui_scale);
  const double fraction = layout.shared ? kParticipantFraction : 0;
  const auto scaled = [](int size, double scale) { return static_cast<int>(size * scale); };
  layout.participant =
      centred_in(participant, 0, layout.shared ? fraction : 1,
                 scaled(1280, layout.participant_scale), scaled(800, layout.participant_scale));
  layout.console =
      centred_in(layout.shared ? participant : console, fraction, 1,
                 scaled(1480, layout.console_scale), scaled(920, layout.console_scale));
  if (settings.full_screen && !layout.shared) {
    const GLFWvidmode* const mode = glfwGetVideoMode(participant);
    layout.participant = {participant, 0, 0, mode->width, mode->height};
  }
  return layout;
}

GLFWwindow* make_window(const std::string& title, const WindowGeometry& geometry) {
  glfwDefaultWindowHints();
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_VISIBLE, GLFW_FALSE);
  // A click into the console must not minimise the participant's full-screen window.
  glfwWindowHint(GLFW_AUTO_ICONIFY, GLFW_FALSE);
  GLFWwindow* const window = glfwCreateWindow(geometry.width, geometry.height, title.c_str(),
                                              geometry.full_screen_on, nullptr);
  if (window == nullptr) throw DisplayError("no window with OpenGL 3.3: " + glfw_reason());
  if (geometry.full_screen_on == nullptr) glfwSetWindowPos(window, geometry.left, geometry.top);
  glfwMakeContextCurrent(window);
  glfwSwapInterval(0);  // waiting for a vertical retrace would delay the keys of both windows
  return window;
}

}  // namespace palpate::runner
