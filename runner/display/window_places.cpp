#include "runner/display/window_places.h"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <initializer_list>

namespace palpate::runner::display {
namespace {

/// Format for writing and reading: JSON, like the other events among a run's notes.
constexpr const char* kWritten =
    "{\"windows\":{\"desktop_px\":[%d,%d],\"participant_px\":[%d,%d,%d,%d],"
    "\"console_px\":[%d,%d,%d,%d]}}";
constexpr const char* kRead =
    "{\"windows\":{\"desktop_px\":[%6d,%6d],\"participant_px\":[%6d,%6d,%6d,%6d],"
    "\"console_px\":[%6d,%6d,%6d,%6d]}}%n";

}  // namespace

bool overlap(const ScreenBox& a, const ScreenBox& b) {
  return a.left < b.right() && b.left < a.right() && a.top < b.bottom() && b.top < a.bottom();
}

bool contains(const ScreenBox& whole, const ScreenBox& part) {
  return part.left >= whole.left && part.top >= whole.top && part.right() <= whole.right() &&
         part.bottom() <= whole.bottom();
}

ScreenBox with_frame(const ScreenBox& window, const FrameSize& frame) {
  return {window.left - frame.left, window.top - frame.top, window.width + frame.left + frame.right,
          window.height + frame.top + frame.bottom};
}

ScreenBox without_frame(const ScreenBox& box, const FrameSize& frame, int gap) {
  return {box.left + frame.left + gap, box.top + frame.top + gap,
          box.width - frame.left - frame.right - 2 * gap,
          box.height - frame.top - frame.bottom - 2 * gap};
}

ScreenBox rest_of(const ScreenBox& room, const ScreenBox& taken) {
  const int left = std::clamp(taken.left, room.left, room.right());
  const int right = std::clamp(taken.right(), room.left, room.right());
  const int top = std::clamp(taken.top, room.top, room.bottom());
  const int bottom = std::clamp(taken.bottom(), room.top, room.bottom());
  return std::max({ScreenBox{room.left, room.top, left - room.left, room.height},
                   ScreenBox{right, room.top, room.right() - right, room.height},
                   ScreenBox{room.left, room.top, room.width, top - room.top},
                   ScreenBox{room.left, bottom, room.width, room.bottom() - bottom}},
                  [](const ScreenBox& a, const ScreenBox& b) {
                    return std::int64_t{a.width} * a.height < std::int64_t{b.width} * b.height;
                  });
}

ScreenBox moved_into(const ScreenBox& box, const ScreenBox& room) {
  const int width = std::min(box.width, room.width), height = std::min(box.height, room.height);
  return {std::clamp(box.left, room.left, room.right() - width),
          std::clamp(box.top, room.top, room.bottom() - height), width, height};
}

std::string to_note(const WindowPlaces& places) {
  const ScreenBox &p = places.participant, &c = places.console;
  char text[400];
  std::snprintf(text, sizeof text, kWritten, places.desktop_width, places.desktop_height, p.left,
                p.top, p.width, p.height, c.left, c.top, c.width, c.height);
  return text;
}

std::optional<WindowPlaces> window_places(const std::string& note) {
  WindowPlaces out;
  ScreenBox &p = out.participant, &c = out.console;
  int read = 0;
  std::sscanf(note.c_str(), kRead, &out.desktop_width, &out.desktop_height, &p.left, &p.top,
              &p.width, &p.height, &c.left, &c.top, &c.width, &c.height, &read);
  if (read == 0) return std::nullopt;
  return out;
}

}  // namespace palpate::runner::display
