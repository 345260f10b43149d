#include "runner/display/lost_display.h"

#include <X11/Xlib.h>
#include <X11/Xresource.h>
#include <X11/Xutil.h>
#include <poll.h>

#include <csignal>

// From GLFW's glfw3native.h, which asks for the headers of extensions that are not used here.
extern "C" Display* glfwGetX11Display();
extern "C" Window glfwGetX11Window(GLFWwindow* window);

namespace palpate::runner {
namespace {

/// Under which Xlib keeps our windows.
XContext our_windows() {
  static const XContext context = XUniqueContext();
  return context;
}

int stay_quiet(Display*) { return 0; }

// The exceptions pass the frames of Xlib, GLFW and Mesa. These hold locks of the display, which is
// never used again, and carry the unwinding tables that compilers for Debian always write.
void leave(Display*, void*) { throw LostDisplay(); }

/// A picture or a focus that could not be had is no reason to end a session. Nothing may be thrown
/// from here: the display would stay locked.
int note_or_ignore(Display* display, XErrorEvent* error) {
  XPointer gone = nullptr;
  if ((error->error_code == BadWindow || error->error_code == BadDrawable) &&
      XFindContext(display, error->resourceid, our_windows(), &gone) == 0) {
    *reinterpret_cast<bool*>(gone) = true;
  }
  return 0;
}

}  // namespace

void survive_lost_display() {
  Display* const display = glfwGetX11Display();
  if (display == nullptr) return;
  XSetErrorHandler(&note_or_ignore);
  XSetIOErrorHandler(&stay_quiet);
  XSetIOErrorExitHandler(display, &leave, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
}

void watch_window(GLFWwindow* window, bool& gone) {
  Display* const display = glfwGetX11Display();
  if (display == nullptr) return;
  XSaveContext(display, glfwGetX11Window(window), our_windows(), reinterpret_cast<XPointer>(&gone));
}

bool is_gone(GLFWwindow* window) {
  Display* const display = glfwGetX11Display();
  XPointer gone = nullptr;
  return display != nullptr &&
         XFindContext(display, glfwGetX11Window(window), our_windows(), &gone) == 0 &&
         *reinterpret_cast<bool*>(gone);
}

bool display_lost() {
  Display* const display = glfwGetX11Display();
  if (display == nullptr) return false;
  pollfd connection{ConnectionNumber(display), POLLIN, 0};
  return poll(&connection, 1, 0) > 0 && (connection.revents & (POLLHUP | POLLERR)) != 0;
}

}  // namespace palpate::runner
