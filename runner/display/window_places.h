#pragma once
// Rectangles on the desktop, and the places of a session's windows.

#include <optional>
#include <string>

namespace palpate::runner::display {

/// px, from the desktop's upper left corner.
struct ScreenBox {
  int left = 0, top = 0, width = 0, height = 0;
  int right() const { return left + width; }
  int bottom() const { return top + height; }
  bool operator==(const ScreenBox&) const = default;
};

/// Frame that a window manager puts around a window, px.
struct FrameSize {
  int left = 0, top = 0, right = 0, bottom = 0;
};

bool overlap(const ScreenBox& a, const ScreenBox& b);
bool contains(const ScreenBox& whole, const ScreenBox& part);
/// The window with its frame.
ScreenBox with_frame(const ScreenBox& window, const FrameSize& frame);
/// The window that fills a box with its frame, `gap` px from each edge.
ScreenBox without_frame(const ScreenBox& box, const FrameSize& frame, int gap = 0);
/// The largest part of `room` that is wholly left of, right of, above or below `taken`.
ScreenBox rest_of(const ScreenBox& room, const ScreenBox& taken);
/// The box moved into `room` by as little as possible, and made smaller only if it does not fit.
ScreenBox moved_into(const ScreenBox& box, const ScreenBox& room);

/// Places of a session's windows, without their frames.
struct WindowPlaces {
  int desktop_width = 0, desktop_height = 0;  ///< px, of all monitors together
  ScreenBox participant, console;
  bool operator==(const WindowPlaces&) const = default;
};

/// A note of a run; it places the next session's windows.
std::string to_note(const WindowPlaces& places);
/// None: the note is of another kind.
std::optional<WindowPlaces> window_places(const std::string& note);

}  // namespace palpate::runner::display
