#include "runner/display/window_places.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

namespace palpate::runner::display {
namespace {

TEST(WindowPlaces, TheRestIsTheLargestFreePart) {
  const ScreenBox room{100, 50, 1000, 800};
  EXPECT_EQ(rest_of(room, {600, 50, 500, 800}), (ScreenBox{100, 50, 500, 800}));
  EXPECT_EQ(rest_of(room, {100, 50, 300, 800}), (ScreenBox{400, 50, 700, 800}));
  EXPECT_EQ(rest_of(room, {100, 50, 1000, 200}), (ScreenBox{100, 250, 1000, 600}));
  EXPECT_EQ(rest_of(room, {100, 600, 1000, 250}), (ScreenBox{100, 50, 1000, 550}));
  EXPECT_EQ(rest_of(room, {2000, 0, 50, 50}), room) << "taken elsewhere";
  const ScreenBox none = rest_of(room, {0, 0, 3000, 3000});
  EXPECT_EQ(none.width * none.height, 0) << "nothing is left";
}

TEST(WindowPlaces, TheRestNeverOverlapsAndLiesInTheRoom) {
  const ScreenBox room{-200, 30, 900, 500};
  for (int i = 0; i < 2000; ++i) {
    const auto draw = [i](int which, int most) {
      return static_cast<int>((i * 7919LL + which * 104729LL) * 2654435761LL % most + most) % most;
    };
    const ScreenBox taken{draw(1, 1400) - 500, draw(2, 900) - 200, draw(3, 900) + 1,
                          draw(4, 700) + 1};
    const ScreenBox rest = rest_of(room, taken);
    EXPECT_TRUE(contains(room, rest));
    EXPECT_FALSE(rest.width > 0 && rest.height > 0 && overlap(rest, taken));
  }
}

TEST(WindowPlaces, EdgesThatTouchDoNotOverlap) {
  const ScreenBox a{0, 0, 10, 10};
  EXPECT_FALSE(overlap(a, {10, 0, 5, 5}));
  EXPECT_FALSE(overlap(a, {0, 10, 5, 5}));
  EXPECT_TRUE(overlap(a, {9, 9, 5, 5}));
  EXPECT_TRUE(overlap({9, 9, 5, 5}, a));
}

TEST(WindowPlaces, AFrameIsAroundTheWindow) {
  const FrameSize frame{1, 20, 2, 5};
  EXPECT_EQ(with_frame({100, 100, 300, 200}, frame), (ScreenBox{99, 80, 303, 225}));
  EXPECT_EQ(without_frame({99, 80, 303, 225}, frame), (ScreenBox{100, 100, 300, 200}));
  EXPECT_EQ(without_frame({89, 70, 323, 245}, frame, 10), (ScreenBox{100, 100, 300, 200}));
}

TEST(WindowPlaces, MovingInKeepsTheSizeWhereItFits) {
  const ScreenBox room{0, 0, 1000, 700};
  EXPECT_EQ(moved_into({100, 100, 300, 200}, room), (ScreenBox{100, 100, 300, 200}));
  EXPECT_EQ(moved_into({900, -50, 300, 200}, room), (ScreenBox{700, 0, 300, 200}));
  EXPECT_EQ(moved_into({900, 300, 3000, 200}, room), (ScreenBox{0, 300, 1000, 200}));
}

TEST(WindowPlaces, PlacesAreReadOnlyFromTheirNote) {
  const WindowPlaces places{3840, 1080, {-5, 20, 500, 400}, {1920, 31, 1480, 920}};
  const std::string note = to_note(places);
  EXPECT_EQ(note,
            "{\"windows\":{\"desktop_px\":[3840,1080],\"participant_px\":[-5,20,500,400],"
            "\"console_px\":[1920,31,1480,920]}}");
  EXPECT_EQ(window_places(note), places);
  EXPECT_EQ(window_places(""), std::nullopt);
  EXPECT_EQ(window_places("{\"sounds\":\"left out\"}"), std::nullopt);
  for (std::size_t end = 0; end < note.size(); ++end)
    EXPECT_EQ(window_places(note.substr(0, end)), std::nullopt) << end;
  // Numbers of a hostile note must not overflow.
  EXPECT_EQ(window_places("{\"windows\":{\"desktop_px\":[99999999999999999999,1]"), std::nullopt);
}

}  // namespace
}  // namespace palpate::runner::display
