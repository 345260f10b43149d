#include "runner/display/window_layout.h"

#include <epoxy/gl.h>
// After epoxy, which replaces the GL headers.
#include <GLFW/glfw3.h>
#include <X11/Xatom.h>
#include <X11/Xlib.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "runner/display/x11_errors.h"
#include "runner/display/x11_properties.h"

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

std::string in_words(const std::vector<Monitor>& all) {
  std::string text;
  for (const Monitor& one : all)
    text += (text.empty() ? " (" : ", ") + one.name + ", " + std::to_string(one.box.width) + " x " +
            std::to_string(one.box.height);
  return text.empty() ? text : text + ")";
}

/// \param number  from 1; 0: `otherwise`, or the first if there are fewer
const Monitor& monitor(const std::vector<Monitor>& all, int number, std::size_t otherwise) {
  if (number < 0 || static_cast<std::size_t>(number) > all.size()) {
    throw DisplayError("monitor " + std::to_string(number) + " is not connected; there are " +
                       std::to_string(all.size()) + in_words(all));
  }
  if (number > 0) return all[static_cast<std::size_t>(number) - 1];
  return all[otherwise <= all.size() ? otherwise - 1 : 0];
}

/// The desktop's scale if it sets one; else larger text on monitors of high resolution, where it
/// would be too small (3840 x 2160: half the size).
double scale_for(const Monitor& on, double wanted) {
  constexpr double kMost = 4, kUsualHeight = 1080;  // px
  if (wanted > 0) return wanted;
  float scale = 1, ignored = 1;
  // One value for all monitors, read when GLFW started.
  if (GLFWmonitor* const any = glfwGetPrimaryMonitor())
    glfwGetMonitorContentScale(any, &scale, &ignored);
  if (scale > 1) return std::min<double>(scale, kMost);
  const ScreenBox area = work_area(on);
  return std::clamp(std::min(area.height / kUsualHeight, area.width / (kUsualHeight * 16 / 9)), 1.0,
                    kMost);
}

/// The part of the desktop that all monitors cover together.
ScreenBox desktop(const std::vector<Monitor>& all) {
  ScreenBox out{0, 0, 0, 0};
  for (const Monitor& one : all) {
    out.width = std::max(out.width, one.box.right());
    out.height = std::max(out.height, one.box.bottom());
  }
  return out;
}

/// The frame around a window; for a hidden window the future frame, if the window manager reports
/// it.
FrameSize frame_of(GLFWwindow* window) {
  FrameSize frame;
  glfwGetWindowFrameSize(window, &frame.left, &frame.top, &frame.right, &frame.bottom);
  return frame;
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
const WindowPlaces* usable(const WindowSettings& settings, const std::vector<Monitor>& monitors,
                           const FrameSize& frame, int bar) {
  if (!settings.places || settings.full_screen || settings.participant_monitor > 0 ||
      settings.console_monitor > 0)
    return nullptr;
  const WindowPlaces& places = *settings.places;
  const ScreenBox all = desktop(monitors);
  if (places.desktop_width != all.width || places.desktop_height != all.height) return nullptr;
  for (const ScreenBox* const box : {&places.participant, &places.console}) {
    const Monitor* const on = monitor_of(monitors, *box);
    if (on == nullptr || box->width < kLeast || box->height < kLeast || !contains(on->box, *box))
      return nullptr;
  }
  const ScreenBox &console = places.console, button{console.left, console.top, console.width, bar};
  return overlap(with_frame(places.participant, frame), button) ? nullptr : &places;
}

void limit_sizes(WindowLayout& layout) {
  layout.console.least_width = std::min(kLeastWidth, layout.console.box.width);
  layout.console.least_height = std::min(kLeastHeight, layout.console.box.height);
}

int bar_height(double scale) { return scaled(kBarHeight, scale); }

/// Space for the participant's window when it must not cover the console: the rest of the console's
/// monitor. \param console  without its frame \param bar  height of its emergency button, px
ScreenBox room_beside(const ScreenBox& console, int bar, const FrameSize& frame) {
  const std::vector<Monitor> all = monitors();
  const Monitor* const on = monitor_of(all, console);
  const ScreenBox area = work_area(on != nullptr ? *on : all.front());
  const ScreenBox beside = rest_of(area, with_frame(console, frame));
  if (beside.width >= 2 * kLeast && beside.height >= kLeast)
    return without_frame(beside, frame, kGap);
  // The console fills the monitor: put the window on it, below the button.
  const int below = std::clamp(console.top + bar, area.top, area.bottom());
  return without_frame({area.left, below, area.width, area.bottom() - below}, frame, kGap);
}

/// Each window on its monitor, in the middle; both side by side where it is the same one, or where
/// two show the same part of the desktop.
WindowLayout lay_out(const WindowSettings& settings, const Monitor& participant,
                     const Monitor& console, const FrameSize& frame) {
  WindowLayout layout;
  layout.participant.monitor = participant;
  layout.console.monitor = console;
  layout.shared = overlap(participant.box, console.box);
  layout.participant_scale = scale_for(participant, settings.ui_scale);
  layout.console_scale = scale_for(console, settings.ui_scale);
  if (layout.shared) {
    layout.console.box =
        console_beside_participant(work_area(participant), layout.console_scale, frame);
    layout.participant.box =
        room_beside(layout.console.box, bar_height(layout.console_scale), frame);
  } else {
    layout.participant.box =
        centred_in(work_area(participant), scaled(kParticipantWidth, layout.participant_scale),
                   scaled(kParticipantHeight, layout.participant_scale), frame);
    layout.console.box = centred_in(work_area(console), scaled(kConsoleWidth, layout.console_scale),
                                    scaled(kConsoleHeight, layout.console_scale), frame);
  }
  if (settings.full_screen && !layout.shared) {
    layout.participant.full_screen = true;
    layout.participant.box = participant.box;
  }
  return layout;
}

constexpr double kEvery = 0.1;          // s, between two checks of the windows' places
constexpr double kEveryMonitors = 0.5;  // s, between two looks at the list of monitors
constexpr double kSettling = 1.5;       // s, that the window manager has to show them
constexpr double kFilling = 2.5;        // s, that it has to fill a monitor
constexpr double kStill = 0.4;          // s without a move: it is not being dragged any more
constexpr double kRaiseEvery = 0.5;
constexpr int kTries = 3, kFillingTries = 7;

constexpr const char* kFullScreenState = "_NET_WM_STATE_FULLSCREEN";

/// Puts a window above the others. Unlike glfwFocusWindow it does not move the keyboard focus.
void raise(GLFWwindow* window) {
  if (Display* const display = glfwGetX11Display()) XRaiseWindow(display, glfwGetX11Window(window));
}

bool lists(const std::vector<unsigned long>& atoms, Atom atom) {
  return std::find(atoms.begin(), atoms.end(), atom) != atoms.end();
}

/// Asks the window manager to set or end a state of a window, or two.
void ask_for_state(GLFWwindow* window, bool set, const char* one, const char* other = nullptr) {
  Display* const display = glfwGetX11Display();
  if (display == nullptr) return;
  const auto atom = [display](const char* name) {
    return static_cast<long>(XInternAtom(display, name, False));
  };
  constexpr long kProgram = 1;
  XEvent event{};
  event.xclient.type = ClientMessage;
  event.xclient.window = glfwGetX11Window(window);
  event.xclient.message_type = static_cast<Atom>(atom("_NET_WM_STATE"));
  event.xclient.format = 32;
  event.xclient.data.l[0] = set ? 1 : 0;
  event.xclient.data.l[1] = atom(one);
  event.xclient.data.l[2] = other != nullptr ? atom(other) : 0;
  event.xclient.data.l[3] = kProgram;
  XSendEvent(display, DefaultRootWindow(display), False,
             SubstructureNotifyMask | SubstructureRedirectMask, &event);
}

/// Ends a maximised or full-screen state set through the window manager.
void restore(GLFWwindow* window) {
  ask_for_state(window, false, kFullScreenState);
  ask_for_state(window, false, "_NET_WM_STATE_MAXIMIZED_VERT", "_NET_WM_STATE_MAXIMIZED_HORZ");
}

/// Whether a window manager keeps full-screen windows above panels and others.
bool manager_fills_screens() {
  Display* const display = glfwGetX11Display();
  if (display == nullptr) return false;
  const Window root = DefaultRootWindow(display);
  const auto manager = read_property(display, root, "_NET_SUPPORTING_WM_CHECK", XA_WINDOW);
  if (manager.empty() ||
      read_property(display, manager.front(), "_NET_SUPPORTING_WM_CHECK", XA_WINDOW).empty())
    return false;  // none, or it was killed
  return lists(read_property(display, root, "_NET_SUPPORTED", XA_ATOM),
               XInternAtom(display, kFullScreenState, False));
}

bool is_full_screen(GLFWwindow* window) {
  Display* const display = glfwGetX11Display();
  return display != nullptr &&
         lists(read_property(display, glfwGetX11Window(window), "_NET_WM_STATE", XA_ATOM),
               XInternAtom(display, kFullScreenState, False));
}

bool on_one_monitor(const std::vector<Monitor>& all, const ScreenBox& a, const ScreenBox& b) {
  const Monitor *one = monitor_of(all, a), *other = monitor_of(all, b);
  return one == nullptr || other == nullptr || overlap(one->box, other->box);
}

bool same_monitors(const WindowLayout& a, const WindowLayout& b) {
  return a.participant.monitor == b.participant.monitor && a.console.monitor == b.console.monitor;
}

/// The layout on the monitors that are left of one, or that are back.
WindowLayout lay_out_again(const WindowSettings& settings, const WindowLayout& first) {
  const std::vector<Monitor> all = monitors();
  const auto still = [&](const std::string& name) -> const Monitor& {
    const Monitor* const there = monitor_named(all, name);
    return there != nullptr ? *there : all.front();
  };
  WindowLayout layout = lay_out(settings, still(first.participant.monitor.name),
                                still(first.console.monitor.name), usual_frame());
  limit_sizes(layout);
  return layout;
}

}  // namespace

std::string glfw_reason() {
  const char* reason = nullptr;
  glfwGetError(&reason);
  return reason != nullptr ? reason : "no reason given";
}

double single_scale(double wanted) { return scale_for(monitors().front(), wanted); }

WindowGeometry lay_out_single(int width, int height, double scale) {
  const Monitor first = monitors().front();
  const ScreenBox box =
      centred_in(work_area(first), scaled(width, scale), scaled(height, scale), usual_frame());
  return {false, box, first, std::min(kLeastWidth, box.width), std::min(kLeastHeight, box.height)};
}

void bring_into_sight(GLFWwindow* window) {
  ScreenBox box;
  glfwGetWindowPos(window, &box.left, &box.top);
  glfwGetWindowSize(window, &box.width, &box.height);
  const std::vector<Monitor> all = monitors();
  if (was_destroyed(window) || monitor_of(all, box) != nullptr) return;
  const ScreenBox to = centred_in(work_area(all.front()), box.width, box.height, frame_of(window));
  glfwSetWindowSize(window, to.width, to.height);
  glfwSetWindowPos(window, to.left, to.top);
}

WindowLayout lay_out_windows(const WindowSettings& settings) {
  const std::vector<Monitor> all = monitors();
  const Monitor& participant = monitor(all, settings.participant_monitor, 2);
  const Monitor& console = monitor(all, settings.console_monitor, 1);
  const FrameSize frame = usual_frame();
  WindowLayout layout;
  if (const WindowPlaces* const places =
          usable(settings, all, frame, bar_height(scale_for(console, settings.ui_scale)))) {
    layout = lay_out(settings, *monitor_of(all, places->participant),
                     *monitor_of(all, places->console), frame);
    layout.participant.box = places->participant;
    layout.console.box = places->console;
  } else {
    layout = lay_out(settings, participant, console, frame);
  }
  limit_sizes(layout);
  return layout;
}

GLFWwindow* make_window(const std::string& title, const WindowGeometry& geometry, bool stereo) {
  glfwDefaultWindowHints();
  glfwWindowHint(GLFW_STEREO, stereo ? GLFW_TRUE : GLFW_FALSE);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_VISIBLE, GLFW_FALSE);
  // Not GLFW's own full screen: a window manager that does not know the monitor (openbox) takes the
  // one of the window's first place, which GLFW sets on another.
  glfwWindowHint(GLFW_DECORATED, geometry.full_screen ? GLFW_FALSE : GLFW_TRUE);
  const ScreenBox& box = geometry.box;
  GLFWwindow* const window =
      glfwCreateWindow(box.width, box.height, title.c_str(), nullptr, nullptr);
  if (window == nullptr)
    throw DisplayError((stereo ? "no window with a buffer for each eye (stereo: quad_buffer): "
                               : "no window with OpenGL 3.3: ") +
                       glfw_reason());
  if (geometry.least_width > 0)
    glfwSetWindowSizeLimits(window, geometry.least_width, geometry.least_height, GLFW_DONT_CARE,
                            GLFW_DONT_CARE);
  // Call it after setting the limits, which rewrite the window's hints: without a position in
  // them the window manager would choose one.
  glfwSetWindowPos(window, box.left, box.top);
  glfwMakeContextCurrent(window);
  glfwSwapInterval(0);  // waiting for a vertical retrace would delay the keys of both windows
  return window;
}

WindowPlacing::WindowPlacing(GLFWwindow* participant, GLFWwindow* console,
                             const WindowSettings& settings, const WindowLayout& layout)
    : settings_(settings),
      first_(layout),
      layout_(layout),
      participant_{participant, layout.participant.box},
      console_{console, layout.console.box},
      monitors_(monitors()),
      shared_(layout.shared) {}

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

/// Windows stay where they are when a monitor is switched off that shows neither.
void WindowPlacing::look_at_monitors(double now) {
  if (now < next_monitors_) return;
  next_monitors_ = now + kEveryMonitors;
  std::vector<Monitor> all = monitors();
  if (all == monitors_) return;
  monitors_ = std::move(all);
  WindowLayout again = lay_out_again(settings_, first_);
  if (same_monitors(again, first_)) again = first_;
  if (!same_monitors(again, layout_)) place_again(again, now);
}

void WindowPlacing::place_again(const WindowLayout& layout, double now) {
  const bool both = layout.shared != layout_.shared;
  const bool move_participant = both || layout.participant.monitor != layout_.participant.monitor;
  const bool move_console = both || layout.console.monitor != layout_.console.monitor;
  if (full_screen()) restore(participant_.window);
  layout_ = layout;
  glfwSetWindowAttrib(participant_.window, GLFW_DECORATED, full_screen() ? GLFW_FALSE : GLFW_TRUE);
  glfwSetWindowSizeLimits(console_.window, layout.console.least_width, layout.console.least_height,
                          GLFW_DONT_CARE, GLFW_DONT_CARE);
  participant_.asked = move_participant ? layout.participant.box : participant_.now;
  console_.asked = move_console ? layout.console.box : console_.now;
  participant_.tries = console_.tries = 0;
  if (move_participant) ask_for(participant_);
  if (move_console) ask_for(console_);
  settled_ = false;
  began_ = now;
}

void WindowPlacing::ask_for(Placed& placed) {
  ++placed.tries;
  const ScreenBox& box = placed.asked;
  if (box.width != placed.now.width || box.height != placed.now.height)
    glfwSetWindowSize(placed.window, box.width, box.height);
  glfwSetWindowPos(placed.window, box.left, box.top);
}

bool WindowPlacing::fills_its_monitor() const {
  return participant_.now == participant_.asked &&
         (!manager_fills_screens() || is_full_screen(participant_.window));
}

/// One step towards it. The window manager fills the monitor on which the window is: so first move
/// it there, without the state.
void WindowPlacing::fill_monitor() {
  const Monitor* const on = monitor_of(monitors_, participant_.now);
  const bool elsewhere = on == nullptr || !overlap(on->box, participant_.asked);
  const bool filled = is_full_screen(participant_.window);
  if (filled) restore(participant_.window);
  if (elsewhere || filled || !manager_fills_screens()) {
    ask_for(participant_);
    return;
  }
  ++participant_.tries;
  ask_for_state(participant_.window, true, kFullScreenState);
}

/// Some window managers choose their own place for a new window but accept a later request.
void WindowPlacing::settle(double now) {
  bool there = true;
  for (Placed* const one : {&participant_, &console_}) {
    const bool fill = full_screen() && one == &participant_;
    if (fill ? fills_its_monitor()
             : one->now.left == one->asked.left && one->now.top == one->asked.top)
      continue;
    there = false;
    // A window that already is on its monitor is filled at once.
    const double due = began_ + 3 * kEvery * (one->tries + (fill ? 0 : 1));
    if (one->tries >= (fill ? kFillingTries : kTries) || now < due) continue;
    if (fill)
      fill_monitor();
    else
      ask_for(*one);
  }
  if (!there && now - began_ < (full_screen() ? kFilling : kSettling)) return;
  settled_ = true;
  participant_.shown = participant_.now;
  console_.shown = console_.now;
  if (!there) misplaced_ = misplacement();
}

std::string WindowPlacing::misplacement() const {
  const auto where = [&](const Placed& one) {
    const Monitor* const on = monitor_of(monitors_, one.now);
    return on != nullptr ? "on " + on->name : std::string("on no monitor");
  };
  const std::string &asked = first_.participant.monitor.name, &other = first_.console.monitor.name;
  if (monitor_named(monitors_, asked) == nullptr)
    return "monitor " + asked + " is gone: the participant's window is " + where(participant_);
  if (monitor_named(monitors_, other) == nullptr)
    return "monitor " + other + " is gone: the console is " + where(console_);
  const std::string remedy =
      ": move it there, or choose other monitors (--participant-monitor, --console-monitor)";
  const bool wrong = full_screen() ? participant_.now != participant_.asked
                                   : participant_.now == participant_.shown;
  if (!wrong || layout_.shared) return {};
  const Monitor* const on = monitor_of(monitors_, participant_.now);
  const bool elsewhere = on == nullptr || on->name != asked;
  if (elsewhere && (full_screen() || shared_))
    return "the participant's window is " + where(participant_) + ", not on its monitor " + asked +
           remedy;
  if (!full_screen()) return {};
  return "the participant's window does not fill its monitor " + asked;
}

/// A window that has left its monitor, as when the window manager is replaced, is put back once.
void WindowPlacing::judge(double now) {
  std::string found = misplacement();
  if (found.empty()) put_back_ = false;
  if (!found.empty() && misplaced_.empty() && full_screen() && !put_back_) {
    put_back_ = true;
    settled_ = false;
    began_ = now;
    participant_.tries = 0;
    return;
  }
  misplaced_ = std::move(found);
}

void WindowPlacing::move_away(int bar) {
  if (attempts_ >= kTries) return;
  ++attempts_;
  restore(participant_.window);
  const FrameSize frame = frame_of(participant_.window);
  const ScreenBox to = moved_into(participant_.now, room_beside(console_.now, bar, frame));
  if (to.width != participant_.now.width || to.height != participant_.now.height)
    glfwSetWindowSize(participant_.window, to.width, to.height);
  glfwSetWindowPos(participant_.window, to.left, to.top);
}

/// The emergency button must be on a monitor.
void WindowPlacing::bring_back(int bar) {
  const ScreenBox &console = console_.now, button{console.left, console.top, console.width, bar};
  if (attempts_ >= kTries || monitor_of(monitors_, button) != nullptr) return;
  ++attempts_;
  const ScreenBox room =
      without_frame(work_area(monitors_.front()), frame_of(console_.window), kGap);
  const ScreenBox to = moved_into(console, room);
  glfwSetWindowSize(console_.window, to.width, to.height);
  glfwSetWindowPos(console_.window, to.left, to.top);
}

void WindowPlacing::uncover(double now, int bar) {
  const ScreenBox &console = console_.now, button{console.left, console.top, console.width, bar};
  // A window that should fill another monitor must not hide the words that say so.
  const ScreenBox& kept = full_screen() && !misplaced_.empty() ? console : button;
  const bool shown = glfwGetWindowAttrib(console_.window, GLFW_ICONIFIED) == GLFW_FALSE &&
                     glfwGetWindowAttrib(participant_.window, GLFW_ICONIFIED) == GLFW_FALSE;
  const bool covers =
      shown && overlap(with_frame(participant_.now, frame_of(participant_.window)), kept);
  if (covers != covered_) {
    glfwSetWindowAttrib(console_.window, GLFW_FLOATING, covers ? GLFW_TRUE : GLFW_FALSE);
    covered_ = covers;
    raised_at_ = 0;
  }
  // At once, even while it is dragged.
  if (covers && now - raised_at_ >= kRaiseEvery) {
    raise(console_.window);
    raised_at_ = now;
  }
  if (now - moved_at_ < kStill) return;
  if (covers) {
    moved_at_ = now;
    move_away(bar);
  } else {
    bring_back(bar);
  }
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
  look_at_monitors(now);
  shared_ = on_one_monitor(monitors_, participant_.now, console_.now);
  if (!settled_) settle(now);
  if (!settled_) return;
  uncover(now, static_cast<int>(bar));
  if (now - moved_at_ >= kStill || now - began_ < kFilling) judge(now);
}

std::optional<WindowPlaces> WindowPlacing::moved_to() const {
  if (!settled_ || full_screen() || !same_monitors(layout_, first_) ||
      (participant_.now == participant_.shown && console_.now == console_.shown))
    return std::nullopt;
  const ScreenBox all = desktop(monitors_);
  // A window manager may put a window beside the requested place. Store the place to request next
  // time.
  const auto wish = [](const Placed& one) {
    return ScreenBox{one.asked.left + one.now.left - one.shown.left,
                     one.asked.top + one.now.top - one.shown.top, one.now.width, one.now.height};
  };
  return WindowPlaces{all.width, all.height, wish(participant_), wish(console_)};
}

}  // namespace palpate::runner::display
