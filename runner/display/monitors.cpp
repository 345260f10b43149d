#include "runner/display/monitors.h"

#include <X11/Xatom.h>
#include <X11/Xlib.h>
#include <X11/extensions/Xrandr.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <tuple>
#include <utility>

#include "runner/display/x11_properties.h"

// From GLFW's glfw3native.h, which asks for the headers of extensions that are not used here.
extern "C" Display* glfwGetX11Display();

namespace palpate::runner::display {
namespace {

ScreenBox whole_display(Display* display) {
  if (display == nullptr) return {0, 0, 1280, 800};  // assume a usual size
  const int screen = DefaultScreen(display);
  return {0, 0, DisplayWidth(display, screen), DisplayHeight(display, screen)};
}

bool lists_monitors(Display* display) {
  int first_event = 0, first_error = 0, major = 0, minor = 0;
  return display != nullptr && XRRQueryExtension(display, &first_event, &first_error) != 0 &&
         XRRQueryVersion(display, &major, &minor) != 0 &&
         std::make_pair(major, minor) >= std::make_pair(1, 5);
}

std::string name_of(Display* display, Atom atom) {
  const std::unique_ptr<char, decltype(&XFree)> name(XGetAtomName(display, atom), &XFree);
  return name ? name.get() : "";
}

}  // namespace

std::vector<Monitor> monitors() {
  Display* const display = glfwGetX11Display();
  int count = 0;
  const std::unique_ptr<XRRMonitorInfo, decltype(&XRRFreeMonitors)> found(
      lists_monitors(display) ? XRRGetMonitors(display, DefaultRootWindow(display), True, &count)
                              : nullptr,
      &XRRFreeMonitors);
  std::vector<XRRMonitorInfo> sorted(found.get(), found.get() + (found ? count : 0));
  std::stable_sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
    return std::make_tuple(!a.primary, a.x, a.y) < std::make_tuple(!b.primary, b.x, b.y);
  });
  std::vector<Monitor> out;
  for (const XRRMonitorInfo& one : sorted) {
    if (one.width > 0 && one.height > 0)
      out.push_back({name_of(display, one.name), {one.x, one.y, one.width, one.height}});
  }
  if (out.empty()) out.push_back({"screen", whole_display(display)});
  return out;
}

const Monitor* monitor_named(const std::vector<Monitor>& all, const std::string& name) {
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const Monitor& one) { return one.name == name; });
  return found == all.end() ? nullptr : &*found;
}

const Monitor* monitor_of(const std::vector<Monitor>& all, const ScreenBox& box) {
  const Monitor* best = nullptr;
  std::int64_t most = 0;
  for (const Monitor& one : all) {
    const ScreenBox& area = one.box;
    const int wide = std::min(box.right(), area.right()) - std::max(box.left, area.left);
    const int high = std::min(box.bottom(), area.bottom()) - std::max(box.top, area.top);
    if (wide <= 0 || high <= 0 || std::int64_t{wide} * high <= most) continue;
    most = std::int64_t{wide} * high;
    best = &one;
  }
  return best;
}

ScreenBox work_area(const Monitor& monitor) {
  Display* const display = glfwGetX11Display();
  if (display == nullptr) return monitor.box;
  const Window root = DefaultRootWindow(display);
  const auto areas = read_property(display, root, "_NET_WORKAREA", XA_CARDINAL);
  const auto desktop = read_property(display, root, "_NET_CURRENT_DESKTOP", XA_CARDINAL);
  if (desktop.empty() || areas.size() / 4 <= desktop[0]) return monitor.box;
  const std::size_t at = 4 * desktop[0];
  // One area for the whole desktop. It need not reach each of the monitors.
  const int left = std::max(monitor.box.left, static_cast<int>(areas[at]));
  const int top = std::max(monitor.box.top, static_cast<int>(areas[at + 1]));
  const int right = std::min(monitor.box.right(), static_cast<int>(areas[at] + areas[at + 2]));
  const int bottom =
      std::min(monitor.box.bottom(), static_cast<int>(areas[at + 1] + areas[at + 3]));
  if (2 * (right - left) < monitor.box.width || 2 * (bottom - top) < monitor.box.height)
    return monitor.box;
  return {left, top, right - left, bottom - top};
}

LitScreens::LitScreens(bool wanted) {
  Display* const display = glfwGetX11Display();
  if (!wanted || display == nullptr) return;
  XGetScreenSaver(display, &timeout_, &interval_, &blanking_, &exposures_);
  XSetScreenSaver(display, 0, 0, DontPreferBlanking, DefaultExposures);
  on_ = true;
}

void LitScreens::end() {
  if (!std::exchange(on_, false)) return;
  XSetScreenSaver(glfwGetX11Display(), timeout_, interval_, blanking_, exposures_);
}

}  // namespace palpate::runner::display
