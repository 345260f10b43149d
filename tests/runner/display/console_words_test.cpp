#include "runner/display/console_words.h"

#include <gtest/gtest.h>

#include "runner/servo/sample.h"

namespace palpate::runner::display {
namespace {

ConsoleState in(const char* word) {
  ConsoleState state;
  state.state = word;
  return state;
}

TEST(ConsoleWords, ABreakIsNamedWithItsDuration) {
  ConsoleState state = in("block begins");
  state.seconds_left = 90;
  EXPECT_EQ(state_title(state), "break");
  EXPECT_EQ(state_detail(state), "1 min 30 s left");
  state.seconds_left = 0;
  EXPECT_EQ(state_title(state), "block begins");
  EXPECT_EQ(state_title(in("rest")), "break");
}

TEST(ConsoleWords, APageToReadNamesTheKeyToPress) {
  for (const char* const word : {"instructions", "practice begins", "block begins", "rest"})
    EXPECT_EQ(state_detail(in(word)), "space bar continues") << word;
  EXPECT_EQ(state_detail(in("end")), "space bar ends it");
  EXPECT_EQ(state_detail(in("trial")), "");
  ConsoleState held = in("rest");
  held.held_by = "to continue: 'Go on'";
  EXPECT_EQ(state_detail(held), "") << "the space bar does not";
}

TEST(ConsoleWords, AQuestionOfAPageShowsItsNumber) {
  const ConsoleState state = in("question 2 of 5: about-you, age");
  EXPECT_EQ(state_title(state), "question 2 of 5");
  EXPECT_EQ(state_detail(state), "about-you, age");
  EXPECT_EQ(state_title(in("page: welcome")), "page");
  EXPECT_EQ(state_detail(in("page: welcome")), "welcome");
}

TEST(ConsoleWords, TrialsAreCountedOrEstimated) {
  ConsoleState state;
  EXPECT_EQ(trial_of(state), "-");
  state.trial = 3;
  state.trials = 24;
  EXPECT_EQ(trial_of(state), "3 of 24");
  state.about = true;
  EXPECT_EQ(trial_of(state), "3 of about 24");
  state.trial = 26;
  EXPECT_EQ(trial_of(state), "26 of about 26");
}

TEST(ConsoleWords, ALevelHasTheNameOfWhatVaries) {
  ConsoleState state;
  EXPECT_EQ(level_text(state), "-");
  state.level = "80 N/m";
  state.level_name = "stiffness";
  EXPECT_EQ(level_text(state), "stiffness 80 N/m");
}

TEST(ConsoleWords, APauseComesAfterTheTrial) {
  ConsoleState state = in("trial");
  state.pauses = true;
  EXPECT_EQ(state_detail(state), "pauses after this trial");
}

TEST(ConsoleWords, ANameIsShortenedAtAWholeLetter) {
  const auto letters = [](const std::string& words) {
    double count = 0;
    for (const char c : words) count += (c & 0xC0) != 0x80 ? 1 : 0;
    return count;
  };
  EXPECT_EQ(shortened("sphere", 6, letters), "sphere");
  EXPECT_EQ(shortened("sphere", 4, letters), "sph\u2026");
  EXPECT_EQ(shortened("W\u00fcrfel", 3, letters), "W\u00fc\u2026");
  EXPECT_EQ(shortened("sphere", 0, letters), "");
}

TEST(ConsoleWords, NumbersOfAnAxisAreNotRounded) {
  EXPECT_EQ(axis_label(0), "0");
  EXPECT_EQ(axis_label(2.5), "2.5");  // half of 5
  EXPECT_EQ(axis_label(0.5), "0.5");
  EXPECT_EQ(axis_label(25), "25");
  EXPECT_EQ(axis_label(500), "500");
}

TEST(ConsoleWords, TheBarCountsATrialAfterItsEnd) {
  ConsoleState state = in("trial");
  EXPECT_EQ(fraction_done(state), 0);
  state.trial = 4;
  state.trials = 8;
  EXPECT_EQ(fraction_done(state), 3 / 8.0);
  for (const char* const word : {"rest", "block begins"}) {
    state.state = word;
    EXPECT_EQ(fraction_done(state), 4 / 8.0) << word;
  }
  state.trial = 8;
  state.state = "end";
  EXPECT_EQ(fraction_done(state), 1);
}

TEST(ConsoleWords, WhileForcesAreOffTheNextButtonIsNamed) {
  ConsoleState state = in("rest");
  EXPECT_EQ(forces_text(state), "No fault");
  state.sample.faults = servo::servo_fault::kTripped | servo::servo_fault::kEmergency;
  state.fault = "zero force was asked for by the key F12";
  EXPECT_EQ(forces_text(state),
            "Forces are off: zero force was asked for by the key F12; next: 'Clear the fault'");
  state.held_by = "the device is unplugged; to continue: 'Clear the fault', then 'Go on'";
  EXPECT_EQ(forces_text(state), "Forces are off: " + state.held_by);
  state.sample.faults = 0;
  EXPECT_EQ(forces_text(state), state.held_by);
}

TEST(ConsoleWords, BeforeTheFirstTrialForcesOffIsNoAlarm) {
  ConsoleState state = in("pre-flight");
  state.checklist.steps = {{"Home the device", Checklist::Step::State::now}};
  state.sample.faults = servo::servo_fault::kTripped | servo::servo_fault::kDeviceLost;
  EXPECT_TRUE(forces_not_yet_on(state));
  EXPECT_EQ(forces_text(state), "Forces are off: none is needed yet");
  state.sample.trouble = servo::DeviceTrouble::unplugged;
  EXPECT_FALSE(forces_not_yet_on(state)) << "to clear it opens the device again";
  state.sample.trouble = servo::DeviceTrouble::none;
  state.fault = "zero force was asked for by the key F12";
  EXPECT_FALSE(forces_not_yet_on(state));
  EXPECT_NE(forces_text(state).find("F12; next: 'Clear the fault'"), std::string::npos);
}

}  // namespace
}  // namespace palpate::runner::display
