#pragma once

#include <X11/Xlib.h>

#include <vector>

namespace palpate::runner::display {

/// The property's numbers of 32 bits: CARDINAL, ATOM or WINDOW. Empty: it has no such property of
/// this type, or is gone (then Xlib's error handler was called).
std::vector<unsigned long> read_property(Display* display, Window of, const char* name, Atom type);

}  // namespace palpate::runner::display
