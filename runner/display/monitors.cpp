#include "runner/display/monitors.h"

#include <epoxy/gl.h>
// After epoxy, which replaces the GL headers.
#include <GLFW/glfw3.h>

#include <algorithm>

namespace palpate::runner {
namespace {

constexpr double kParticipantsShare = 0.4;  // of a monitor's width that both windows are on
constexpr int kFrame = 40;                  // px, room for what the window manager adds

/// \param number  from 1; 0: `otherwise`, or the first where there are not so many
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

/// What the desktop asks for; where it asks for nothing, letters on a screen of many lines are
/// enlarged, or 3840 x 2160 would show them at half their size.
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

/// One and the same, or two that show the same part of the desktop.
bool overlap(GLFWmonitor* a, GLFWmonitor* b) {
  if (a == b) return true;
  int left[2], top[2], width[2], height[2];
  glfwGetMonitorWorkarea(a, &left[0], &top[0], &width[0], &height[0]);
  glfwGetMonitorWorkarea(b, &left[1], &top[1], &width[1], &height[1]);
  return left[0] < left[1] + width[1] && left[1] < left[0] + width[0] &&
         top[0] < top[1] + height[1] && top[1] < top[0] + height[0];
}

/// Centred in a part of the monitor. \param from, to  shares of its width
Place place(GLFWmonitor* on, double from, double to, int width, int height) {
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

Places place_windows(const WindowSettings& settings) {
  GLFWmonitor* const participant = monitor(settings.participant_monitor, 2);
  GLFWmonitor* const console = monitor(settings.console_monitor, 1);
  Places places;
  places.shared = participant == nullptr || overlap(participant, console);
  places.participant_scale = scale_for(participant, settings.ui_scale);
  places.console_scale = scale_for(console, settings.ui_scale);
  const double share = places.shared ? kParticipantsShare : 0;
  const auto scaled = [](int size, double scale) { return static_cast<int>(size * scale); };
  places.participant =
      place(participant, 0, places.shared ? share : 1, scaled(1280, places.participant_scale),
            scaled(800, places.participant_scale));
  places.console = place(places.shared ? participant : console, share, 1,
                         scaled(1480, places.console_scale), scaled(920, places.console_scale));
  if (settings.full_screen && !places.shared) {
    const GLFWvidmode* const mode = glfwGetVideoMode(participant);
    places.participant = {participant, 0, 0, mode->width, mode->height};
  }
  return places;
}

GLFWwindow* make_window(const std::string& title, const Place& place) {
  glfwDefaultWindowHints();
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_VISIBLE, GLFW_FALSE);
  // A click into the console must not take the participant's screen away.
  glfwWindowHint(GLFW_AUTO_ICONIFY, GLFW_FALSE);
  GLFWwindow* const window =
      glfwCreateWindow(place.width, place.height, title.c_str(), place.full_screen_on, nullptr);
  if (window == nullptr) throw DisplayError("no window with OpenGL 3.3: " + glfw_reason());
  if (place.full_screen_on == nullptr) glfwSetWindowPos(window, place.left, place.top);
  glfwMakeContextCurrent(window);
  glfwSwapInterval(0);  // waiting for one screen's retrace would hold up the keys of both
  return window;
}

}  // namespace palpate::runner
