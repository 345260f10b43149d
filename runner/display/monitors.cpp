#include "runner/display/monitors.h"

#include <epoxy/gl.h>
// After epoxy, which replaces the GL headers.
#include <GLFW/glfw3.h>

#include <algorithm>

namespace palpate {
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
  const bool share = participant == console && !settings.full_screen;
  Places places{place(participant, 0, share ? kParticipantsShare : 1, 1280, 800),
                place(console, share ? kParticipantsShare : 0, 1, 1480, 920)};
  if (settings.full_screen && participant != nullptr) {
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

}  // namespace palpate
