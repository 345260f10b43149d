// The output of a session on a terminal, for participant and experimenter.

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "runner/display/text_display.h"

namespace palpate::runner::display {
namespace {

using Step = Checklist::Step;

/// The texts added since the last call; all must go to `file`.
std::string written(EventQueue<Output>& out, int file) {
  std::string text;
  for (const Output& output : out.take()) {
    EXPECT_EQ(output.file, file);
    text += output.text;
  }
  return text;
}

class TextScreens : public ::testing::Test {
 protected:
  std::string page(const Page& page) {
    screen_.show(page);
    return written(out_, STDOUT_FILENO);
  }
  std::string console(const ConsoleState& state) {
    console_.show(state);
    return written(out_, STDERR_FILENO);
  }
  static Page of_kind(Page::Kind kind, const std::string& text) {
    Page page;
    page.kind = kind;
    page.text = text;
    return page;
  }
  static ConsoleState in(const std::string& word, int trial = 0) {
    ConsoleState state;
    state.state = word;
    state.trial = trial;
    state.trials = 12;
    state.block = 2;
    state.blocks = 3;
    return state;
  }

  EventQueue<Output> out_;
  WakeEvent wake_;
  TextScreen screen_{out_, wake_};
  TextConsole console_{out_, wake_};
};

TEST_F(TextScreens, TextsNameTheirKeyAndLength) {
  EXPECT_EQ(page(of_kind(Page::Kind::text, "Hello")), "Hello\n[space bar: go on]\n");
  Page second = of_kind(Page::Kind::text, "More");
  second.part = 2;
  second.parts = 3;
  second.picture = std::make_shared<const std::string>("png");
  EXPECT_EQ(page(second),
            "More\n[2 / 3]\n[a picture, which the window shows]\n[space bar: go on]\n");
  Page rest = of_kind(Page::Kind::text, "Rest");
  rest.seconds_left = 30;
  rest.done = 4;
  rest.trials = 12;
  EXPECT_EQ(page(rest), "Rest\n[30 s]\n[4 of 12]\n[space bar: go on]\n");
  EXPECT_EQ(page(of_kind(Page::Kind::message, "Wait")), "Wait\n");
  Page right = of_kind(Page::Kind::feedback, "Correct");
  right.done = 4;
  right.trials = 12;
  EXPECT_EQ(page(right), "Correct\n") << "how far the session is comes with the next trial";
}

TEST_F(TextScreens, AnswersAreListedWithTheirKeysOnceForcesAreOn) {
  Page trial = of_kind(Page::Kind::neutral, "Which?");
  trial.keys = {{"1", "ball"}, {"2", "b\x1b[2Jx"}};
  EXPECT_EQ(page(trial), "Which?\n") << "nothing to answer yet";
  trial.go = true;
  const std::string shown = page(trial);
  EXPECT_LT(shown.find("1 ball"), shown.find("2 b")) << shown;
  EXPECT_EQ(shown.find('\x1b'), std::string::npos) << "a label of a protocol is no command";
  EXPECT_EQ(page(trial), "") << "nothing new";
  Page again = trial;
  again.reply = "another key";
  EXPECT_EQ(page(again), "another key\n");
  EXPECT_EQ(page(again), "");
}

TEST_F(TextScreens, TypedTextIsShownAfterAPrompt) {
  Page age = of_kind(Page::Kind::message, "How old?");
  age.typing = Page::Typing::number;
  EXPECT_EQ(page(age), "How old?\n> \n");
  age.typed = "3";
  EXPECT_EQ(page(age), "> 3\n") << "without the question once more";
  age.typed = "37";
  age.reply = "18 to 30";
  EXPECT_EQ(page(age), "> 37\n18 to 30\n");
}

TEST_F(TextScreens, ACountDownIsWrittenOnceNotEverySecond) {
  Page rest = of_kind(Page::Kind::message, "Rest");
  rest.seconds_left = 3;
  EXPECT_EQ(page(rest), "Rest\n[3 s]\n");
  rest.seconds_left = 2;
  EXPECT_EQ(page(rest), "");
  rest.seconds_left = 5;
  EXPECT_EQ(page(rest), "Rest\n[5 s]\n") << "a new one";
}

TEST_F(TextScreens, TheStatusNamesTrialBlockTimeAndFaultsWhenItChanges) {
  EXPECT_EQ(console(in("homing")), "[homing]\n") << "no trial yet";
  EXPECT_EQ(console(in("homing")), "");
  ConsoleState trial = in("trial", 5);
  trial.practice = true;
  trial.remaining = 185;
  trial.missed_ticks = 7;
  EXPECT_EQ(console(trial),
            "[trial, practice, block 2 of 3, trial 5 of 12, 3 min left, 7 ticks missed]\n");
  trial.missed_ticks = 8;
  EXPECT_EQ(console(trial), "") << "not at every tick";
  trial.trial = 6;
  trial.practice = false;
  trial.remaining = 59;
  EXPECT_EQ(console(trial), "[trial, block 2 of 3, trial 6 of 12, 8 ticks missed]\n");
  ConsoleState held = in("paused", 6);
  held.practice = true;
  held.held_by = "the device is gone";
  EXPECT_EQ(console(held), "[paused, block 2 of 3, trial 6 of 12: the device is gone]\n");
  held.held_by = "";
  EXPECT_EQ(console(held), "[paused, block 2 of 3, trial 6 of 12]\n");
}

TEST_F(TextScreens, EveryMessageIsWrittenOnceEvenWhenOldOnesAreDropped) {
  ConsoleState state;
  state.messages = {"one", "two"};
  EXPECT_EQ(console(state), "* one\n* two\n");
  state.messages = {"two", "three"};
  state.older_messages = 1;
  EXPECT_EQ(console(state), "* three\n");
  state.messages = {"seven"};
  state.older_messages = 6;
  EXPECT_EQ(console(state), "* seven\n") << "what was dropped unseen is not waited for";
  EXPECT_EQ(console(state), "");
}

TEST_F(TextScreens, TheChecklistNamesTheCurrentStepAndItsCommands) {
  ConsoleState state;
  state.checklist.steps = {{"a", Step::State::done},
                           {"b", Step::State::left_out},
                           {"c", Step::State::now},
                           {"d", Step::State::to_do}};
  state.checklist.instruction = "weigh the grip";
  EXPECT_EQ(console(state), "* step 3 of 4: weigh the grip\n");
  EXPECT_EQ(console(state), "");
  state.checklist.instruction = "home the device";
  state.checklist.choices = {{ConsoleCommand::Kind::resume, "it is home"},
                             {ConsoleCommand::Kind::quit, "end"}};
  EXPECT_EQ(console(state), "* step 3 of 4: home the device (':go': it is home; ':quit': end)\n");
}

TEST_F(TextScreens, KeysAndCommandsArriveInOrderAndOnce) {
  screen_.press({"1", 5});
  screen_.press({"2", 6});
  const std::vector<KeyPress> keys = screen_.keys();
  ASSERT_EQ(keys.size(), 2U);
  EXPECT_EQ(keys[0].key, "1");
  EXPECT_EQ(keys[1].time_ns, 6);
  EXPECT_TRUE(screen_.keys().empty());
  console_.add_command({ConsoleCommand::Kind::note, "late", 9});
  ASSERT_EQ(console_.commands().size(), 1U);
  EXPECT_TRUE(console_.commands().empty());
  EXPECT_EQ(console_.name_of(ConsoleCommand::Kind::pause), "':pause'");
  EXPECT_TRUE(screen_.open());
  screen_.close();
  EXPECT_FALSE(screen_.open());
}

}  // namespace
}  // namespace palpate::runner::display
