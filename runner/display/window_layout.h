#pragma once

#include <string>

#include "runner/display/window.h"
#include "runner/display/window_places.h"

struct GLFWmonitor;
struct GLFWwindow;

namespace palpate::runner {

/// Where a window is to be, without its frame.
struct WindowGeometry {
  GLFWmonitor* full_screen_on = nullptr;  ///< nullptr: a window with a frame
  ScreenBox box;
  int least_width = 0, least_height = 0;  ///< px, that the user can make it
};

struct WindowLayout {
  WindowGeometry participant, console;
  bool shared = false;  ///< both windows are on the participant's monitor
  double participant_scale = 1, console_scale = 1;  ///< of letters and buttons
};

/// Each window where it was put last, if it still fits there, else on its monitor. On a single
/// monitor the participant's gets what the console leaves: nothing may cover the emergency button,
/// and without a window manager nothing could be moved.
/// \throws DisplayError if a requested monitor is not connected
WindowLayout lay_out_windows(const WindowSettings& settings);

/// For the participant's window where it must not be on the console: the rest of the console's
/// monitor. \param console  without its frame \param bar  px, height of its emergency button
ScreenBox room_beside(const ScreenBox& console, int bar, const FrameSize& frame);

/// In the middle of the first monitor. \param width, height  px, at scale 1
WindowGeometry lay_out_single(int width, int height, double scale);

/// The scale of letters and buttons on the first monitor. \param wanted  0: taken from it
double single_scale(double wanted);

/// The part of the desktop that all monitors cover together.
ScreenBox desktop();

/// What is around a window; of a hidden one, what will be, if the window manager says so.
FrameSize frame_of(GLFWwindow* window);

/// A hidden window with an OpenGL 3.3 context, made current. \throws DisplayError
GLFWwindow* make_window(const std::string& title, const WindowGeometry& geometry);

/// GLFW's description of its latest error.
std::string glfw_reason();

}  // namespace palpate::runner
