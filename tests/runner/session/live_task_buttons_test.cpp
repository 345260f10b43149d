// Live sessions of tasks without a keyboard: the device's buttons, or a gamepad, answer consent,
// questions, trials and confidence.

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <tuple>

#include "runner/display/joystick.h"
#include "tests/runner/fake_device.h"
#include "tests/runner/session/live_session_case.h"

namespace palpate::runner::session {
namespace {

using runner::testing::FakeDevice;
using testing::at;
using testing::LiveSessions;

constexpr const char* kPagesAndTasks = R"({"version": 2, "name": "pages", "renderers": ["point"],
  "orientation": "fixed", "servo": {"rate_hz": 100}, "home": {"rest_s": 0.05},
  "material": {"stiffness_n_per_m": 60},
  "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.02, "subdivisions": 1,
               "stiffness_n_per_m": 60}],
  "pages": [
    {"name": "consent", "kind": "consent", "consent_version": "2", "text": "YOU MAY STOP"},
    {"name": "you", "kind": "questionnaire", "items": [
      {"name": "hand", "kind": "choice", "question": "WHICH HAND", "choices": ["left", "right"]},
      {"name": "tired", "kind": "scale", "question": "TIRED", "labels": ["not", "a bit", "very"]}]},
    {"name": "how", "kind": "instructions", "text": "FIRST\fSECOND"},
    {"name": "after", "kind": "questionnaire", "when": "after", "items": [
      {"name": "again", "kind": "choice", "question": "AGAIN", "choices": ["yes", "no"]}]}],
  "blocks": [
    {"name": "comp", "task": "compare", "stimuli": ["ball"], "standard": "ball", "question": "STIFFER",
     "level": {"path": "/stiffness_n_per_m"}, "inter_interval_s": 0.1,
     "procedure": {"kind": "constant", "levels": [40, 80], "repetitions": 1},
     "confidence": {"question": "HOW SURE", "scale": [{"label": "guessed", "number": 1},
       {"label": "rather", "number": 2}, {"label": "sure", "number": 5}]}},
    {"name": "any", "task": "detect", "stimuli": ["ball"], "repetitions": 1, "question": "ANYTHING"}],
  "texts": {"instructions": "WELCOME", "end": "BYE"}})";

/// The button pressed on a page, by a word on it; otherwise the first.
constexpr std::array<std::pair<const char*, int>, 6> kPressed{{{"YOU MAY STOP", 1},
                                                               {"WHICH HAND", 2},
                                                               {"TIRED", 3},
                                                               {"AGAIN", 2},
                                                               {"HOW SURE", 3},
                                                               {"STIFFER", 2}}};

class LiveTaskButtons : public LiveSessions {
 protected:
  LiveTaskButtons() {
    protocol_ = protocols::parse_protocol_text(kPagesAndTasks, "pages.json");
    library_ = StimulusLibrary(protocol_);
    participant_ = store_->enrol(info_of(protocol_), "P02");
    screen_.answers = false;
    screen_.takes_ns = 3'600'000'000'000;  // the keyboard is unattended
    screen_.shown = [this](const display::Page& page) {
      int button = 1;
      for (const auto& [word, number] : kPressed) {
        if (page.text.find(word) != std::string::npos) button = number;
      }
      button_ = button;
      since_page_ = 0;
    };
  }

  /// The button that is down, polled every 10 ms: some time after a page has appeared, for 40 ms,
  /// and again. \return 0: none
  int held() {
    const int since = ++since_page_ % 16;
    return since >= 6 && since < 10 ? button_.load() : 0;
  }

  void expect_all_answered() {
    std::vector<std::tuple<std::string, std::string, std::string>> answers;
    for (const data::StoredPageAnswer& one : store_->page_answers())
      answers.emplace_back(one.answer.page, one.answer.item, one.answer.answer);
    const std::vector<std::tuple<std::string, std::string, std::string>> expected{
        {"consent", "consent", "agree"},
        {"you", "hand", "right"},
        {"you", "tired", "very"},
        {"after", "again", "no"}};
    EXPECT_EQ(answers, expected);
    const std::vector<data::TrialRecord> trials = records();
    ASSERT_EQ(trials.size(), 3U);
    for (int i : {0, 1}) {
      EXPECT_EQ(trials[i].response, "2");
      ASSERT_TRUE(trials[i].task.confidence.has_value());
      EXPECT_EQ(*trials[i].task.confidence, 5);
      EXPECT_GE(trials[i].task.confidence_ns, trials[i].onset_ns);
    }
    EXPECT_EQ(trials[2].response, "yes");
    EXPECT_FALSE(trials[2].task.confidence.has_value());
  }

  std::atomic<int> button_{1}, since_page_{0};
};

TEST_F(LiveTaskButtons, AnswerWithDevice) {
  FakeDevice device([this](int) {
    const int button = held();
    return at(0.1, false, static_cast<std::uint8_t>(button == 0 ? 0 : 1U << (button - 1)));
  });
  EXPECT_EQ(run(device, participants::AnswerBy::buttons).end, data::RunEnd::done);
  expect_all_answered();
}

TEST_F(LiveTaskButtons, TheConsoleNamesTheCurrentQuestion) {
  for (const char* const state :
       {"question 1 of 1: consent, consent", "question 2 of 2: you, tired", "page: how",
        "question 1 of 1: after, again"}) {
    console_.next.clear();
    console_.last = {};
    console_.in_state = {state, {display::ConsoleCommand::Kind::quit, "seen", 0}};
    FakeDevice device([this](int) {
      const int button = held();
      return at(0.1, false, static_cast<std::uint8_t>(button == 0 ? 0 : 1U << (button - 1)));
    });
    EXPECT_EQ(run(device, participants::AnswerBy::buttons).reason,
              "ended by the experimenter: seen")
        << state;
  }
}

TEST_F(LiveTaskButtons, AnswerWithGamepad) {
  display::JoystickKeys keys(
      {{"button 1", "1"}, {"button 2", "2"}, {"button 3", "3"}, {"axis 1 +", "space"}});
  std::int64_t next = 0;
  screen_.pressed = [&] {
    if (clock_.now_ns() < next) return std::vector<display::KeyPress>{};
    next = clock_.now_ns() + 10'000'000;
    const int button = held();
    display::JoystickState state{{button == 1, button == 2, button == 3}, {-1}, {}};
    // Where no answer is expected, the pedal continues.
    if (button == 1 && screen_.pages.back().keys.empty()) state = {{false, false, false}, {1}, {}};
    std::vector<display::KeyPress> all;
    for (const std::string& key : keys.pressed(state)) all.push_back({key, clock_.now_ns()});
    return all;
  };
  FakeDevice device([](int) { return at(0.1); });
  EXPECT_EQ(run(device).end, data::RunEnd::done);
  expect_all_answered();
}

}  // namespace
}  // namespace palpate::runner::session
