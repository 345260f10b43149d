#include "runner/display/x11_errors.h"

#include <GLFW/glfw3.h>
#include <X11/Xatom.h>
#include <X11/Xlib.h>
#include <X11/Xresource.h>
#include <X11/Xutil.h>
#include <X11/extensions/Xrandr.h>
#include <poll.h>

#include <csignal>
#include <memory>

#include "runner/display/x11_properties.h"

// From GLFW's glfw3native.h, which asks for the headers of extensions that are not used here.
extern "C" Display* glfwGetX11Display();
extern "C" Window glfwGetX11Window(GLFWwindow* window);

namespace palpate::runner::display {
namespace {

/// The context under which Xlib stores our flags with the windows.
XContext our_windows() {
  static const XContext context = XUniqueContext();
  return context;
}

int ignore_error(Display*, XErrorEvent*) { return 0; }

/// The window that a window's _NET_SUPPORTING_WM_CHECK names; None: it has none, or is gone.
Window checked_window(Display* display, Window of) {
  const auto named = read_property(display, of, "_NET_SUPPORTING_WM_CHECK", XA_WINDOW);
  return named.empty() ? None : named.front();
}

/// The window of a living window manager has the property, too (Extended Window Manager Hints 1.5,
/// "Root Window Properties"). Another program may have been given the number of the dead one's.
void forget_killed_manager(Display* display) {
  XErrorHandler const before = XSetErrorHandler(&ignore_error);
  XGrabServer(display);  // no manager can start between the question and the removal
  const Window root = DefaultRootWindow(display);
  const Window named = checked_window(display, root);
  if (named != None && checked_window(display, named) == None)
    XDeleteProperty(display, root, XInternAtom(display, "_NET_SUPPORTING_WM_CHECK", False));
  XUngrabServer(display);
  XSync(display, False);
  XSetErrorHandler(before);
}

int ignore_io_error(Display*) { return 0; }

// The exception passes frames of Xlib, GLFW and Mesa. They may hold locks of the display, which is
// never used again. They have unwind tables, as all Debian libraries do.
void throw_display_lost(Display*, void*) { throw DisplayLost(); }

/// Ignores errors of single requests: they do not justify ending a session. Must not throw: the
/// display would stay locked.
int flag_destroyed_window(Display* display, XErrorEvent* error) {
  XPointer gone = nullptr;
  if ((error->error_code == BadWindow || error->error_code == BadDrawable) &&
      XFindContext(display, error->resourceid, our_windows(), &gone) == 0) {
    *reinterpret_cast<bool*>(gone) = true;
  }
  return 0;
}

}  // namespace

bool start_glfw() {
  // Closed last: a server in memory resets itself when its only connection ends.
  const std::unique_ptr<Display, decltype(&XCloseDisplay)> display(XOpenDisplay(nullptr),
                                                                   &XCloseDisplay);
  if (display) forget_killed_manager(display.get());
  if (glfwInit() == GLFW_FALSE) return false;
  // GLFW's own list of monitors is not used; keeping it up to date can end the program.
  int first_event = 0, first_error = 0;
  Display* const own = glfwGetX11Display();
  if (own != nullptr && XRRQueryExtension(own, &first_event, &first_error) != 0)
    XRRSelectInput(own, DefaultRootWindow(own), 0);
  return true;
}

void handle_display_errors() {
  Display* const display = glfwGetX11Display();
  if (display == nullptr) return;
  XSetErrorHandler(&flag_destroyed_window);
  XSetIOErrorHandler(&ignore_io_error);
  XSetIOErrorExitHandler(display, &throw_display_lost, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
}

void flag_when_destroyed(GLFWwindow* window, bool& gone) {
  Display* const display = glfwGetX11Display();
  if (display == nullptr) return;
  XSaveContext(display, glfwGetX11Window(window), our_windows(), reinterpret_cast<XPointer>(&gone));
}

bool was_destroyed(GLFWwindow* window) {
  Display* const display = glfwGetX11Display();
  XPointer gone = nullptr;
  return display != nullptr &&
         XFindContext(display, glfwGetX11Window(window), our_windows(), &gone) == 0 &&
         *reinterpret_cast<bool*>(gone);
}

bool connection_lost() {
  Display* const display = glfwGetX11Display();
  if (display == nullptr) return false;
  pollfd connection{ConnectionNumber(display), POLLIN, 0};
  return poll(&connection, 1, 0) > 0 && (connection.revents & (POLLHUP | POLLERR)) != 0;
}

}  // namespace palpate::runner::display
