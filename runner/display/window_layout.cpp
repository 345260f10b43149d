#include "runner/display/window_layout.h"

#include <epoxy/gl.h>
// After epoxy, which replaces the GL headers.
#include <GLFW/glfw3.h>
#include <X11/Xlib.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "runner/display/x11_errors.h"

// From GLFW's glfw3native.h, which asks for the headers of extensions that are not used here.
extern "C" Display* glfwGetX11Display();
extern "C" Window glfwGetX11Window(GLFWwindow* window);

namespace palpate::runner::display {
namespace {

constexpr double kParticipantFraction = 0.4;  // share of the width of a monitor with both windows
constexpr int kGap = 10;                      // px, around each window
constexpr int kLeast = 200;                   // px, of a side; a smaller window is useless
// px, at scale 1:
constexpr int kConsoleWidth = 1480, kConsoleHeight = 920;
constexpr int kParticipantWidth = 1280, kParticipantHeight = 800;
constexpr int kLeastWidth = 700, kLeastHeight = 480;  // of the console and of `explore`
constexpr int kBarHeight = 64;  // height of the emergency button with its margin

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

/// Whether these are one monitor, or two that show the same part of the desktop.
bool overlap(GLFWmonitor* a, GLFWmonitor* b) {
  if (a == b) return true;
  int left[2], top[2], width[2], height[2];
  glfwGetMonitorWorkarea(a, &left[0], &top[0], &width[0], &height[0]);
  glfwGetMonitorWorkarea(b, &left[1], &top[1], &width[1], &height[1]);
  return left[0] < left[1] + width[1] && left[1] < left[0] + width[0] &&
         top[0] < top[1] + height[1] && top[1] < top[0] + height[0];
}

/// The monitor's area without panels. \param on  nullptr: assume a usual size
ScreenBox work_area(GLFWmonitor* on) {
  ScreenBox area{0, 0, 1280, 800};
  if (on != nullptr) glfwGetMonitorWorkarea(on, &area.left, &area.top, &area.width, &area.height);
  return area;
}

ScreenBox whole_area(GLFWmonitor* on) {
  ScreenBox area{0, 0, 1280, 800};
  const GLFWvidmode* const mode = on != nullptr ? glfwGetVideoMode(on) : nullptr;
  if (mode == nullptr) return area;
  glfwGetMonitorPos(on, &area.left, &area.top);
  area.width = mode->width;
  area.height = mode->height;
  return area;
}

std::vector<GLFWmonitor*> monitors() {
  int count = 0;
  GLFWmonitor** const all = glfwGetMonitors(&count);
  return {all, all + count};
}

/// The monitor that shows most of the box.
GLFWmonitor* monitor_of(const ScreenBox& box) {
  GLFWmonitor* best = nullptr;
  std::int64_t most = 0;
  for (GLFWmonitor* const one : monitors()) {
    const ScreenBox area = whole_area(one);
    const int wide = std::min(box.right(), area.right()) - std::max(box.left, area.left);
    const int high = std::min(box.bottom(), area.bottom()) - std::max(box.top, area.top);
    if (wide <= 0 || high <= 0 || std::int64_t{wide} * high <= most) continue;
    most = std::int64_t{wide} * high;
    best = one;
  }
  return best;
}

/// The window manager's frame, if it reports one before a window is shown.
FrameSize usual_frame() {
  glfwDefaultWindowHints();
  glfwWindowHint(GLFW_CLIENT_API, GLFW_NO_API);
  glfwWindowHint(GLFW_VISIBLE, GLFW_FALSE);
  GLFWwindow* const probe = glfwCreateWindow(100, 100, "", nullptr, nullptr);
  if (probe == nullptr) return {};
  const FrameSize frame = frame_of(probe);
  glfwDestroyWindow(probe);
  return frame;
}

int scaled(int size, double scale) { return static_cast<int>(size * scale); }

/// A box of the wanted size, as far as it fits, in the middle of the room.
ScreenBox centred_in(const ScreenBox& room, int width, int height, const FrameSize& frame) {
  const ScreenBox most = without_frame(room, frame, kGap);
  width = std::min(width, std::max(most.width, kLeast));
  height = std::min(height, std::max(most.height, kLeast));
  return {most.left + (most.width - width) / 2,
          std::max(most.top, most.top + (most.height - height) / 2), width, height};
}

/// A box at the right edge of the room, beside the participant's window.
ScreenBox console_beside_participant(const ScreenBox& room, double scale, const FrameSize& frame) {
  const int part = static_cast<int>((1 - kParticipantFraction) * room.width);
  const int around = 2 * kGap + frame.left + frame.right;
  const int width = std::min(scaled(kConsoleWidth, scale), std::max(part - around, kLeast));
  const int height = std::min(
      scaled(kConsoleHeight, scale),
      std::max(room.height - std::max(4 * kGap, 2 * kGap + frame.top + frame.bottom), kLeast));
  return {room.right() - kGap - frame.right - width, room.top + kGap + frame.top, width, height};
}

/// The last places of the windows; null: they no longer fit there, or the settings ask for others.
const WindowPlaces* usable(const WindowSettings& settings, const FrameSize& frame, int bar) {
  if (!settings.places || settings.full_screen || settings.participant_monitor > 0 ||
      settings.console_monitor > 0)
    return nullptr;
  const WindowPlaces& places = *settings.places;
  const ScreenBox all = desktop();
  if (places.desktop_width != all.width || places.desktop_height != all.height) return nullptr;
  for (const ScreenBox* const box : {&places.participant, &places.console}) {
    GLFWmonitor* const on = monitor_of(*box);
    if (on == nullptr || box->width < kLeast || box->height < kLeast ||
        !contains(whole_area(on), *box))
      return nullptr;
  }
  const ScreenBox &console = places.console, button{console.left, console.top, console.width, bar};
  return overlap(with_frame(places.participant, frame), button) ? nullptr : &places;
}

}  // namespace

std::string glfw_reason() {
  const char* reason = nullptr;
  glfwGetError(&reason);
  return reason != nullptr ? reason : "no reason given";
}

FrameSize frame_of(GLFWwindow* window) {
  FrameSize frame;
  glfwGetWindowFrameSize(window, &frame.left, &frame.top, &frame.right, &frame.bottom);
  return frame;
}

ScreenBox desktop() {
  ScreenBox all{0, 0, 0, 0};
  for (GLFWmonitor* const one : monitors()) {
    const ScreenBox area = whole_area(one);
    all.width = std::max(all.width, area.right());
    all.height = std::max(all.height, area.bottom());
  }
  return all;
}

ScreenBox room_beside(const ScreenBox& console, int bar, const FrameSize& frame) {
  const ScreenBox area = work_area(monitor_of(console));
  const ScreenBox beside = rest_of(area, with_frame(console, frame));
  if (beside.width >= 2 * kLeast && beside.height >= kLeast)
    return without_frame(beside, frame, kGap);
  // The console fills the monitor: put the window on it, below the button.
  const int below = std::clamp(console.top + bar, area.top, area.bottom());
  return without_frame({area.left, below, area.width, area.bottom() - below}, frame, kGap);
}

double single_scale(double wanted) { return scale_for(monitor(0, 1), wanted); }

WindowGeometry lay_out_single(int width, int height, double scale) {
  const ScreenBox box = centred_in(work_area(monitor(0, 1)), scaled(width, scale),
                                   scaled(height, scale), usual_frame());
  return {nullptr, box, std::min(kLeastWidth, box.width), std::min(kLeastHeight, box.height)};
}

WindowLayout lay_out_windows(const WindowSettings& settings) {
  GLFWmonitor* participant = monitor(settings.participant_monitor, 2);
  GLFWmonitor* console = monitor(settings.console_monitor, 1);
  const FrameSize frame = usual_frame();
  const auto bar_at = [](double scale) { return scaled(kBarHeight, scale); };
  const WindowPlaces* const places =
      usable(settings, frame, bar_at(scale_for(console, settings.ui_scale)));
  if (places != nullptr) {
    participant = monitor_of(places->participant);
    console = monitor_of(places->console);
  }
  WindowLayout layout;
  layout.shared = participant == nullptr || overlap(participant, console);
  layout.participant_scale = scale_for(participant, settings.ui_scale);
  layout.console_scale = scale_for(console, settings.ui_scale);
  if (places != nullptr) {
    layout.participant.box = places->participant;
    layout.console.box = places->console;
  } else if (layout.shared) {
    layout.console.box =
        console_beside_participant(work_area(participant), layout.console_scale, frame);
    layout.participant.box = room_beside(layout.console.box, bar_at(layout.console_scale), frame);
  } else {
    layout.participant.box =
        centred_in(work_area(participant), scaled(kParticipantWidth, layout.participant_scale),
                   scaled(kParticipantHeight, layout.participant_scale), frame);
    layout.console.box = centred_in(work_area(console), scaled(kConsoleWidth, layout.console_scale),
                                    scaled(kConsoleHeight, layout.console_scale), frame);
  }
  layout.console.least_width = std::min(kLeastWidth, layout.console.box.width);
  layout.console.least_height = std::min(kLeastHeight, layout.console.box.height);
  if (settings.full_screen && !layout.shared)
    layout.participant = {participant, whole_area(participant), 0, 0};
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
  const ScreenBox& box = geometry.box;
  GLFWwindow* const window =
      glfwCreateWindow(box.width, box.height, title.c_str(), geometry.full_screen_on, nullptr);
  if (window == nullptr) throw DisplayError("no window with OpenGL 3.3: " + glfw_reason());
  if (geometry.full_screen_on == nullptr) {
    if (geometry.least_width > 0)
      glfwSetWindowSizeLimits(window, geometry.least_width, geometry.least_height, GLFW_DONT_CARE,
                              GLFW_DONT_CARE);
    // Call it after setting the limits, which rewrite the window's hints: without a position in
    // them the window manager would choose one.
    glfwSetWindowPos(window, box.left, box.top);
  }
  glfwMakeContextCurrent(window);
  glfwSwapInterval(0);  // waiting for a vertical retrace would delay the keys of both windows
  return window;
}

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
