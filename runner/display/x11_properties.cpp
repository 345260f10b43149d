#include "runner/display/x11_properties.h"

#include <X11/Xutil.h>

#include <memory>

namespace palpate::runner::display {

std::vector<unsigned long> read_property(Display* display, Window of, const char* name, Atom type) {
  constexpr long kMost = 4096;  // units of 32 bits
  Atom found = None;
  int format = 0;
  unsigned long count = 0, rest = 0;
  unsigned char* value = nullptr;
  const int failed = XGetWindowProperty(display, of, XInternAtom(display, name, False), 0, kMost,
                                        False, type, &found, &format, &count, &rest, &value);
  const std::unique_ptr<unsigned char, decltype(&XFree)> owned(value, &XFree);
  if (failed != Success || found != type || format != 32) return {};
  const auto* const first = reinterpret_cast<const unsigned long*>(value);  // so Xlib gives 32 bits
  return {first, first + count};
}

}  // namespace palpate::runner::display
