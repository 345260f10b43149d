#include "runner/display/monitors.h"

#include <epoxy/gl.h>
// After epoxy, which replaces the GL headers.
#include <GLFW/glfw3.h>

#include <algorithm>

namespace palpate {

std::string glfw_reason() {
  const char* reason = nullptr;
  glfwGetError(&reason);
  return reason != nullptr ? reason : "no reason given";
}

GLFWmonitor* monitor(int number, int otherwise) {
  int count = 0;
  GLFWmonitor** const all = glfwGetMonitors(&count);
  if (number > count) {
    throw DisplayError("monitor " + std::to_string(number) + " is not connected; there are " +
                       std::to_string(count));
  }
  if (count == 0) return nullptr;
  if (number > 0) return all[number - 1];
  return all[otherwise <= count ? otherwise - 1 : 0];
}

GLFWwindow* make_window(const std::string& title, GLFWmonitor* on, int width, int height,
                        bool full_screen) {
  glfwDefaultWindowHints();
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_VISIBLE, GLFW_FALSE);
  glfwWindowHint(GLFW_FOCUS_ON_SHOW, GLFW_TRUE);
  // A click into the console must not take the participant's screen away.
  glfwWindowHint(GLFW_AUTO_ICONIFY, GLFW_FALSE);
  int left = 0, top = 0, room_width = width, room_height = height;
  if (on != nullptr) {
    glfwGetMonitorWorkarea(on, &left, &top, &room_width, &room_height);
    const GLFWvidmode* const mode = glfwGetVideoMode(on);
    if (full_screen && mode != nullptr) {
      width = mode->width;
      height = mode->height;
      glfwWindowHint(GLFW_REFRESH_RATE, mode->refreshRate);
    }
  }
  const bool full = full_screen && on != nullptr;
  width = full ? width : std::min(width, room_width);
  height = full ? height : std::min(height, room_height);
  GLFWwindow* const window =
      glfwCreateWindow(width, height, title.c_str(), full ? on : nullptr, nullptr);
  if (window == nullptr) {
    throw DisplayError("no window with OpenGL 3.3: " + glfw_reason());
  }
  if (!full && on != nullptr) {
    glfwSetWindowPos(window, left + (room_width - width) / 2, top + (room_height - height) / 2);
  }
  glfwMakeContextCurrent(window);
  glfwSwapInterval(0);  // waiting for one screen's retrace would hold up the keys of both
  return window;
}

}  // namespace palpate
