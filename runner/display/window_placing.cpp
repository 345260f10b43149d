#include "runner/display/window_placing.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <X11/Xlib.h>

#include "runner/display/x11_errors.h"

// From GLFW's glfw3native.h, which asks for the headers of extensions that are not used here.
extern "C" Display* glfwGetX11Display();
extern "C" Window glfwGetX11Window(GLFWwindow* window);

namespace palpate::runner::display {
namespace {

constexpr double kEvery = 0.1;     // s, between two checks of the windows' places
constexpr double kSettling = 1.5;  // s, that the window manager has to show them
constexpr double kStill = 0.4;     // s without a move: it is not being dragged any more
constexpr double kRaiseEvery = 0.5;
constexpr int kTries = 3;

/// Puts a window above the others. Unlike glfwFocusWindow it does not move the keyboard focus.
void raise(GLFWwindow* window) {
  if (Display* const display = glfwGetX11Display()) XRaiseWindow(display, glfwGetX11Window(window));
}

/// Ends a maximised or full-screen state set through the window manager.
void restore(GLFWwindow* window) {
  Display* const display = glfwGetX11Display();
  if (display == nullptr) return;
  const auto atom = [display](const char* name) {
    return static_cast<long>(XInternAtom(display, name, False));
  };
  const auto remove = [&](const char* one, const char* other) {
    constexpr long kRemove = 0, kProgram = 1;
    XEvent event{};
    event.xclient.type = ClientMessage;
    event.xclient.window = glfwGetX11Window(window);
    event.xclient.message_type = static_cast<Atom>(atom("_NET_WM_STATE"));
    event.xclient.format = 32;
    event.xclient.data.l[0] = kRemove;
    event.xclient.data.l[1] = atom(one);
    event.xclient.data.l[2] = other != nullptr ? atom(other) : 0;
    event.xclient.data.l[3] = kProgram;
    XSendEvent(display, DefaultRootWindow(display), False,
               SubstructureNotifyMask | SubstructureRedirectMask, &event);
  };
  remove("_NET_WM_STATE_FULLSCREEN", nullptr);
  remove("_NET_WM_STATE_MAXIMIZED_VERT", "_NET_WM_STATE_MAXIMIZED_HORZ");
}

}  // namespace

WindowPlacing::WindowPlacing(GLFWwindow* participant, GLFWwindow* console,
                             const WindowLayout& layout)
    : participant_{participant, layout.participant.box},
      console_{console, layout.console.box},
      full_screen_(layout.participant.full_screen_on != nullptr) {}

/// \return false if a window is gone
bool WindowPlacing::look() {
  for (Placed* const one : {&participant_, &console_}) {
    ScreenBox& box = one->now;
    glfwGetWindowPos(one->window, &box.left, &box.top);
    glfwGetWindowSize(one->window, &box.width, &box.height);
    if (was_destroyed(one->window)) return false;
  }
  return true;
}

void WindowPlacing::ask_for(Placed& placed) {
  ++placed.tries;
  glfwSetWindowPos(placed.window, placed.asked.left, placed.asked.top);
}

/// Some window managers choose their own place for a new window but accept a later request.
void WindowPlacing::settle(double now) {
  bool there = true;
  for (Placed* const one : {&participant_, &console_}) {
    if (full_screen_ && one == &participant_) continue;
    if (one->now.left == one->asked.left && one->now.top == one->asked.top) continue;
    there = false;
    if (one->tries < kTries && now - began_ > 3 * kEvery * (one->tries + 1)) ask_for(*one);
  }
  if (!there && now - began_ < kSettling) return;
  settled_ = true;
  participant_.shown = participant_.now;
  console_.shown = console_.now;
}

void WindowPlacing::move_away(int bar) {
  if (full_screen_ || attempts_ >= kTries) return;
  ++attempts_;
  restore(participant_.window);
  const FrameSize frame = frame_of(participant_.window);
  const ScreenBox to = moved_into(participant_.now, room_beside(console_.now, bar, frame));
  if (to.width != participant_.now.width || to.height != participant_.now.height)
    glfwSetWindowSize(participant_.window, to.width, to.height);
  glfwSetWindowPos(participant_.window, to.left, to.top);
}

void WindowPlacing::uncover(double now, int bar) {
  const ScreenBox &console = console_.now, button{console.left, console.top, console.width, bar};
  const bool shown = glfwGetWindowAttrib(console_.window, GLFW_ICONIFIED) == GLFW_FALSE &&
                     glfwGetWindowAttrib(participant_.window, GLFW_ICONIFIED) == GLFW_FALSE;
  const bool covers =
      shown && overlap(with_frame(participant_.now, frame_of(participant_.window)), button);
  if (covers != covered_) {
    glfwSetWindowAttrib(console_.window, GLFW_FLOATING, covers ? GLFW_TRUE : GLFW_FALSE);
    covered_ = covers;
    raised_at_ = 0;
  }
  if (!covers) return;
  // At once, even while it is dragged.
  if (now - raised_at_ >= kRaiseEvery) {
    raise(console_.window);
    raised_at_ = now;
  }
  if (now - moved_at_ < kStill) return;
  moved_at_ = now;
  move_away(bar);
}

void WindowPlacing::step(double now, float bar) {
  if (now < next_) return;
  next_ = now + kEvery;
  if (began_ < 0) began_ = now;
  const ScreenBox participant = participant_.now, console = console_.now;
  if (!look()) return;
  if (participant_.now != participant || console_.now != console) {
    moved_at_ = now;
    attempts_ = 0;
  }
  if (!settled_) settle(now);
  if (settled_) uncover(now, static_cast<int>(bar));
}

std::optional<WindowPlaces> WindowPlacing::moved_to() const {
  if (!settled_ || full_screen_ ||
      (participant_.now == participant_.shown && console_.now == console_.shown))
    return std::nullopt;
  const ScreenBox all = desktop();
  // A window manager may put a window beside the requested place. Store the place to request next
  // time.
  const auto wish = [](const Placed& one) {
    return ScreenBox{one.asked.left + one.now.left - one.shown.left,
                     one.asked.top + one.now.top - one.shown.top, one.now.width, one.now.height};
  };
  return WindowPlaces{all.width, all.height, wish(participant_), wish(console_)};
}

}  // namespace palpate::runner::display
