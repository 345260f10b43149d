// Presses on a gamepad or a pedal, from the reports of a fake one.

#include "runner/display/joystick.h"

#include <gtest/gtest.h>

#include <deque>

namespace palpate::runner::display {
namespace {

using Strings = std::vector<std::string>;

/// Reports states one after the other, then repeats the last one.
class FakeJoystick final : public Joystick {
 public:
  explicit FakeJoystick(std::deque<std::optional<JoystickState>> states)
      : states_(std::move(states)) {}
  std::optional<JoystickState> read() override {
    const std::optional<JoystickState> now = states_.front();
    if (states_.size() > 1) states_.pop_front();
    return now;
  }

 private:
  std::deque<std::optional<JoystickState>> states_;
};

JoystickState buttons(bool first, bool second) { return {{first, second}, {}, {}}; }
JoystickState axis(double value) { return {{}, {value}, {}}; }
JoystickState hat(std::uint8_t value) { return {{}, {}, {value}}; }

Strings keys_of(const std::map<std::string, std::string>& mapping,
                const std::deque<std::optional<JoystickState>>& states) {
  FakeJoystick joystick(states);
  JoystickKeys keys(mapping);
  Strings all;
  for (std::size_t i = 0; i < states.size() + 3; ++i) {
    for (const std::string& key : keys.pressed(joystick.read())) all.push_back(key);
  }
  return all;
}

TEST(Joystick, EachPressOfAButtonIsOneKey) {
  EXPECT_EQ(keys_of({{"button 1", "1"}, {"button 2", "space"}},
                    {buttons(false, false), buttons(true, false), buttons(true, false),
                     buttons(true, true), buttons(false, true), buttons(true, true)}),
            (Strings{"1", "space", "1"}));
}

TEST(Joystick, InputsHeldOnConnectionAreNoPresses) {
  EXPECT_EQ(keys_of({{"button 1", "1"}}, {buttons(true, false), buttons(true, false),
                                          buttons(false, false), buttons(true, false)}),
            Strings{"1"});
  // Unplugged while held, and plugged in again.
  EXPECT_EQ(keys_of({{"button 1", "1"}}, {buttons(false, false), buttons(true, false), std::nullopt,
                                          buttons(true, false)}),
            Strings{"1"});
}

TEST(Joystick, APedalIsPressedBeyondItsMiddleAndDoesNotChatter) {
  const std::map<std::string, std::string> mapping = {{"axis 1 +", "1"}, {"axis 1 -", "2"}};
  EXPECT_EQ(keys_of(mapping,
                    {axis(-1), axis(0), axis(0.7), axis(0.55), axis(0.65), axis(0.3), axis(0.7)}),
            (Strings{"1", "1"}));
  EXPECT_EQ(keys_of(mapping, {axis(0), axis(-0.7), axis(0)}), Strings{"2"});
}

TEST(Joystick, AHatHasFourSides) {
  EXPECT_EQ(
      keys_of({{"hat 1 up", "u"}, {"hat 1 right", "r"}, {"hat 1 down", "d"}, {"hat 1 left", "l"}},
              {hat(0), hat(1), hat(3), hat(2), hat(0), hat(4), hat(8)}),
      (Strings{"u", "r", "d", "l"}));
}

TEST(Joystick, MissingInputsAreNeverPressed) {
  EXPECT_EQ(keys_of({{"button 9", "1"}, {"axis 4 +", "2"}, {"hat 2 up", "3"}},
                    {buttons(false, false), buttons(true, true)}),
            Strings{});
}

}  // namespace
}  // namespace palpate::runner::display
