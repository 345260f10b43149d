// The meaning of a person's keys in tasks and on pages: a screen that types a script, a virtual
// clock.

#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <set>

#include "protocols/parse.h"
#include "runner/participants/keyboard.h"

namespace palpate::runner::participants {
namespace {

constexpr const char* kTasks = R"({"version": 2, "name": "t", "renderers": ["point"],
  "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.02, "subdivisions": 1},
              {"name": "box", "shape": "cube", "edge_m": 0.03}],
  "blocks": [
    {"name": "which", "task": "identify", "stimuli": ["ball", "box"], "repetitions": 1,
     "keys": {"1": {"answer": "ball", "label": "Kugel"}, "2": {"answer": "box", "label": "Kasten"}}},
    {"name": "number", "task": "rate", "stimuli": ["ball"], "repetitions": 1, "min": 0, "max": 50},
    {"name": "equal", "task": "adjust", "stimuli": ["ball"], "standard": "ball",
     "level": {"path": "/stiffness_n_per_m"}, "min": 100, "max": 500, "turn": 50, "starts": [200]}],
  "texts": {"other_key": "OTHER KEY", "other_number": "OTHER NUMBER", "answer_first": "FIRST"}})";

/// One press for each poll, with the time of the poll.
class Scripted final : public display::ParticipantScreen {
 public:
  explicit Scripted(servo::Clock& clock) : clock_(clock) {}
  void show(const display::Page& page) override {
    pages.push_back(page);
    if (!page.reply.empty()) replies.insert(page.reply);
  }
  std::vector<display::KeyPress> keys() override {
    if (script.empty()) return {};
    std::vector<display::KeyPress> now;
    for (const std::string& key : script.front()) now.push_back({key, clock_.now_ns()});
    script.pop_front();
    return now;
  }
  bool open() const override { return true; }
  void type(const std::string& characters) {
    for (const char c : characters)
      script.push_back({c == ' ' ? "space" : c == '\n' ? "enter" : std::string(1, c)});
  }
  std::deque<std::vector<std::string>> script;
  std::vector<display::Page> pages;
  std::set<std::string> replies;

 private:
  servo::Clock& clock_;
};

class Nobody final : public Attendant {
 public:
  void attend() override {
    if (++looks > 100000) throw std::runtime_error("waits for ever");
    if (each_look) each_look();
  }
  void sound(SoundCue cue) override { sounds.push_back(cue); }
  int looks = 0;
  std::function<void()> each_look;
  std::vector<SoundCue> sounds;
};

class KeyboardTasks : public ::testing::Test {
 protected:
  KeyboardRespondent& person(AnswerBy by = AnswerBy::keys) {
    person_.emplace(protocol_, screen_, nobody_, clock_, by);
    return *person_;
  }
  void begin(int block, const IntervalView& view) {
    trial_.task_block = block;
    if (!view.continues) person_->begin_trial(trial_);
    person_->begin_interval(trial_, view);
  }
  servo::Sample felt(std::uint8_t buttons = 0) {
    servo::Sample sample;
    sample.phase = servo::Phase::feeling;
    sample.time_ns = clock_.now_ns();
    sample.buttons = buttons;
    return sample;
  }
  /// Ticks until there is an answer.
  std::optional<Answer> answer(int ticks = 200) {
    for (int i = 0; i < ticks; ++i) {
      if (const auto given = person_->step(felt())) return given;
      clock_.wait_until(clock_.now_ns() + 1'000'000);
    }
    return std::nullopt;
  }
  /// "BACK": to the question before.
  std::string ask(const protocols::PageItem& item, const std::string& keys) {
    screen_.script.push_back({});
    screen_.type(keys);
    return person_->ask({}, item, how_).value_or("BACK");
  }

  protocols::Protocol protocol_ = protocols::parse_protocol_text(kTasks, "t.json");
  servo::VirtualClock clock_{1'000'000'000};
  Scripted screen_{clock_};
  Nobody nobody_;
  std::optional<KeyboardRespondent> person_;
  protocols::Trial trial_;
  Asking how_;
};

TEST_F(KeyboardTasks, MovementShowsItsTargetAndTakesNoKey) {
  protocol_ = protocols::parse_protocol(PALPATE_SOURCE_DIR "/tests/protocols/good/reach-v2.json");
  person();
  trial_.level = 2;
  const protocols::Interval shown{0, protocols::RendererKind::point};
  begin(0, {1, 1, true, true, &shown});
  EXPECT_TRUE(screen_.pages.back().keys.empty());
  servo::Sample away = felt();
  away.phase = servo::Phase::homing;
  away.waiting = servo::Waiting::for_return;
  away.time_ns += 200'000'000;
  person_->step(away);
  EXPECT_EQ(screen_.pages.back().text, protocol_.texts.go_home);
  screen_.type("1 1 ");
  clock_.wait_until(clock_.now_ns() + 300'000'000);
  for (int i = 0; i < 100; ++i) {
    servo::Sample sample = felt();
    sample.probe.tip = {0.001 * i, 0.01, 0};
    EXPECT_FALSE(person_->step(sample));
    clock_.wait_until(clock_.now_ns() + 1'000'000);
  }
  const display::Page& page = screen_.pages.back();
  ASSERT_TRUE(page.reach);
  EXPECT_TRUE(page.go);
  EXPECT_EQ(page.reach->target, Vec3(0.05, 0, 0));
  EXPECT_EQ(page.reach->home, Vec3(0, -0.03, 0));
  EXPECT_GT(page.reach->tip.x, 0.08);
  // The targets differ in y and z, most in y.
  EXPECT_EQ(page.reach->up, 1);
  EXPECT_NEAR(page.reach->extent, 0.08 + 0.006, 1e-12);
}

TEST_F(KeyboardTasks, NumbersAreTypedWithPointCommaMinusAndBackspace) {
  for (const auto& [typed, number] : std::vector<std::pair<std::string, double>>{{"12.5\n", 12.5},
                                                                                 {"7,25\n", 7.25},
                                                                                 {".5\n", 0.5},
                                                                                 {"0\n", 0},
                                                                                 {"-0\n", 0},
                                                                                 {"5.\n", 5}}) {
    person();
    begin(1, {});
    screen_.script = {{}, {}};
    screen_.type(typed);
    const auto given = answer();
    ASSERT_TRUE(given) << typed;
    EXPECT_EQ(given->number, number) << typed;
    EXPECT_FALSE(std::signbit(given->number));
  }
  screen_.script = {{}, {}, {"4"}, {"2"}, {"backspace"}, {"3"}, {"enter"}};
  person();
  begin(1, {});
  EXPECT_EQ(answer()->number, 43);
}

TEST_F(KeyboardTasks, InvalidNumbersAreRefusedAndStayInTheField) {
  for (const char* typed : {"\n", "51\n", "-1\n", "1.2.3\n", "--1\n", "1-\n", ".\n"}) {
    screen_.replies.clear();
    person();
    begin(1, {});
    screen_.script = {{}, {}};
    screen_.type(typed);
    EXPECT_FALSE(answer()) << typed;
    const std::string said = std::string(typed) == "\n" ? "FIRST" : "OTHER NUMBER";
    EXPECT_EQ(screen_.replies, std::set<std::string>{said + " (0 \u2013 50)"}) << typed;
    EXPECT_EQ(screen_.pages.back().typed + "\n", typed);
  }
  // Endless digits must overflow neither number nor field.
  person();
  begin(1, {});
  screen_.script = {{}, {}};
  screen_.type(std::string(400, '9') + "\n");
  EXPECT_FALSE(answer(1000));
  EXPECT_EQ(screen_.pages.back().typed.size(), 200U);
}

TEST_F(KeyboardTasks, TurnsAreCountedWhileTheNextIntervalIsPrepared) {
  person();
  begin(2, {1, 2, true, true, nullptr});
  screen_.script = {{}, {}, {"2", "2", "2"}};
  const auto first = answer();
  ASSERT_TRUE(first);
  EXPECT_EQ(first->times, 3);
  screen_.script = {{"wheel down", "1"}};  // before the first tick with forces
  begin(2, {1, 2, true, true, nullptr, true});
  const auto second = answer();
  ASSERT_TRUE(second);
  EXPECT_EQ(second->stimulus, 0);
  EXPECT_EQ(second->times, 2);
  // Another key pressed at once is handled after the turn.
  begin(2, {1, 2, true, true, nullptr, true});
  screen_.script = {{"2", "4", "1"}};
  EXPECT_EQ(answer()->stimulus, 1);
  begin(2, {1, 2, true, true, nullptr, true});
  EXPECT_EQ(answer()->stimulus, 3);
  begin(2, {2, 2, true, true, nullptr});
  screen_.script = {{}, {}, {"2"}};
  EXPECT_FALSE(answer()) << "the standard cannot be turned";
}

TEST_F(KeyboardTasks, AKeyBeforeTheForcesIsNoAnswer) {
  person();
  begin(0, {});
  screen_.script = {{"1"}, {"2"}};
  servo::Sample before = felt();
  before.phase = servo::Phase::homing;
  EXPECT_FALSE(person_->step(before));
  EXPECT_EQ(answer()->stimulus, 1);
  EXPECT_TRUE(screen_.replies.contains("OTHER KEY"));
}

TEST_F(KeyboardTasks, OnlyTheExperimenterTypesSpokenAnswers) {
  person(AnswerBy::experimenter);
  begin(0, {});
  screen_.script = {{}, {"1"}, {"2"}};  // the participant's own keys
  EXPECT_FALSE(answer(20));
  EXPECT_FALSE(person_->spoken("Pyramide", clock_.now_ns()));
  for (const char* words : {"kasten", "2"}) {
    begin(0, {});
    EXPECT_FALSE(answer(2));
    EXPECT_TRUE(person_->spoken(words, clock_.now_ns()));
    EXPECT_EQ(answer()->stimulus, 1) << words;
  }
  begin(1, {});
  EXPECT_FALSE(answer(2));
  EXPECT_TRUE(person_->spoken("12,5", clock_.now_ns()));
  EXPECT_EQ(answer()->number, 12.5);
  // Ineffective input is reported to the experimenter: too early, repeated, or out of range.
  begin(1, {});
  EXPECT_FALSE(person_->spoken("12", clock_.now_ns()));
  EXPECT_FALSE(answer(2));
  for (const char* words : {"51", "-1", "many", "1 2", "inf"})
    EXPECT_FALSE(person_->spoken(words, clock_.now_ns())) << words;
  EXPECT_FALSE(answer());
  EXPECT_TRUE(screen_.replies.empty()) << "and the participant's page does not blame anybody";
  EXPECT_TRUE(person_->spoken("7", clock_.now_ns()));
  EXPECT_EQ(answer()->number, 7);
  begin(0, {});
  EXPECT_FALSE(person_->spoken("2", clock_.now_ns()));
  begin(1, {1, 2, false, true, nullptr});
  EXPECT_FALSE(answer(2));
  EXPECT_TRUE(person_->spoken("", clock_.now_ns()));
  EXPECT_TRUE(answer()->continues);
}

TEST_F(KeyboardTasks, TextsMayHaveAnyLettersAndMayBeRequired) {
  person();
  protocols::PageItem item;
  item.question = "?";
  screen_.script.push_back({});
  screen_.script.push_back({"\u00dc"});
  screen_.script.push_back({"b"});
  EXPECT_EQ(ask(item, " x,\n"), "\u00dcb x,");
  EXPECT_EQ(ask(item, "\n  \na\n"), "  a");
  item.required = false;
  EXPECT_EQ(ask(item, "\n"), "");
  item.kind = protocols::PageItem::Kind::number;
  item.least = 18;
  EXPECT_EQ(ask(item,
                "17\n"
                "5\n"),
            "175");
}

TEST_F(KeyboardTasks, PagesGoBackAndForth) {
  person();
  screen_.script = {{},        {"space"}, {},        {"left"}, {},        {"left"},
                    {"right"}, {},        {"space"}, {},       {"right"}, {"enter"}};
  person_->read_screens({{"one"}, {"two"}, {""}, {"three"}});
  std::string seen;
  for (const display::Page& page : screen_.pages) {
    if (!page.reply.empty()) continue;
    if (seen.empty() || seen.substr(seen.size() - page.text.size()) != page.text)
      seen += (seen.empty() ? "" : " ") + page.text;
    EXPECT_EQ(page.parts, 3);
  }
  EXPECT_EQ(seen, "one two one two three");
  EXPECT_TRUE(screen_.replies.contains("OTHER KEY")) << "nothing stands before the first screen";
}

TEST_F(KeyboardTasks, ConsentIsGivenBelowItsLastScreenOnly) {
  person();
  protocols::PageSpec page;
  page.kind = protocols::PageSpec::Kind::consent;
  page.text = "first\fsecond";
  screen_.script = {{}, {"1"}, {"space"}, {}, {"space"}, {"2"}};
  EXPECT_EQ(person_->ask(page, {}, {}), "disagree");
  for (const display::Page& shown : screen_.pages)
    EXPECT_EQ(shown.keys.empty(), shown.text == "first");
}

const protocols::PageItem kHand{protocols::PageItem::Kind::choice,
                                "hand",
                                "HAND?",
                                {"l", "r"},
                                {},
                                {},
                                true,
                                {"left", "right"}};
const protocols::PageItem kAge{protocols::PageItem::Kind::number, "age", "AGE?", {}, 18, 120};

TEST_F(KeyboardTasks, LeftAndBackspaceGoBackAQuestion) {
  person();
  for (const char* const key : {"left", "backspace"}) {
    how_ = {.can_go_back = true};
    screen_.script = {{}, {key}};
    EXPECT_EQ(ask(kHand, ""), "BACK");
    screen_.script = {{}, {key}};
    EXPECT_EQ(ask(kAge, ""), "BACK");
    how_ = {};
    screen_.script = {{}, {key}, {"2"}};
    EXPECT_EQ(ask(kHand, ""), "r");
  }
}

TEST_F(KeyboardTasks, AQuestionShownAgainKeepsItsAnswer) {
  person();
  how_ = {.can_go_back = true, .given = "r"};
  screen_.script = {{}, {"enter"}};
  EXPECT_EQ(ask(kHand, ""), "r");
  EXPECT_EQ(screen_.pages.back().chosen, "2");
  screen_.script = {{}, {"1"}};
  EXPECT_EQ(ask(kHand, ""), "l");
  how_.given = "42";
  screen_.script = {{}, {"enter"}};
  EXPECT_EQ(ask(kAge, ""), "42");
  EXPECT_EQ(screen_.pages.back().typed, "42");
  screen_.script = {{}, {"backspace"}, {"4"}, {"enter"}};
  EXPECT_EQ(ask(kAge, ""), "44");
}

TEST_F(KeyboardTasks, HeldBackspaceErasesWithoutGoingBack) {
  person();
  how_ = {.can_go_back = true, .given = "42"};
  screen_.script = {{}};
  for (int i = 0; i < 20; ++i) screen_.script.push_back({"backspace"});
  EXPECT_EQ(ask(kAge, "51\n"), "51");
}

TEST_F(KeyboardTasks, ANumberTypedAheadAnswersNoChoice) {
  person();
  how_.number_follows = true;
  screen_.script = {{}, {"2"}, {"1"}, {"enter"}};
  screen_.script.resize(200);
  screen_.script.push_back({"1"});
  EXPECT_EQ(ask(kHand, ""), "l");
  EXPECT_EQ(screen_.replies.count("OTHER KEY"), 1U);
  how_.number_follows = false;
  screen_.script = {{}, {"2"}, {"1"}};
  EXPECT_EQ(ask(kHand, ""), "r");
}

TEST_F(KeyboardTasks, TheRangeIsShownBeforeAnError) {
  person();
  ask(kAge, "42\n");
  EXPECT_EQ(screen_.pages.front().text, "AGE?\n(18 \u2013 120)");
  begin(1, {});
  screen_.script = {{}, {}};
  screen_.type("7\n");
  ASSERT_TRUE(answer());
  EXPECT_NE(screen_.pages.back().text.find("(0 \u2013 50)"), std::string::npos);
}

TEST_F(KeyboardTasks, LongScalesHaveAKeyForEachStep) {
  person();
  protocols::PageItem item;
  item.kind = protocols::PageItem::Kind::choice;
  for (int i = 0; i < 20; ++i) item.choices.push_back("c" + std::to_string(i));
  item.shown = item.choices;
  EXPECT_EQ(ask(item, "0"), "c9");
  EXPECT_EQ(ask(item, "j"), "c19");
  std::set<std::string> keys;
  for (const auto& [key, label] : screen_.pages.back().keys) keys.insert(key);
  EXPECT_EQ(keys.size(), 20U);
}

TEST_F(KeyboardTasks, CuesSoundWhenTheyAreShown) {
  person();
  begin(0, {});
  servo::Sample ready = felt();
  ready.phase = servo::Phase::homing;
  ready.waiting = servo::Waiting::for_rest;
  for (int i = 0; i < 5; ++i) {
    person_->step(ready);
    ready.time_ns += 200'000'000;
  }
  person_->feedback(true);
  person_->feedback(false);
  EXPECT_EQ(nobody_.sounds,
            (std::vector<SoundCue>{SoundCue::ready, SoundCue::right, SoundCue::wrong}));
}

/// Polls a button that is pressed at some polls, numbered from 1.
void press_at(KeyboardRespondent& person, Nobody& nobody, servo::Clock& clock,
              const std::map<int, int>& presses) {
  const int begun = nobody.looks;
  nobody.each_look = [&person, &nobody, &clock, presses, begun] {
    servo::Sample sample;
    sample.time_ns = clock.now_ns();
    const auto now = presses.find((nobody.looks - begun) / 3);  // each is held for three polls
    if (now != presses.end()) sample.buttons = static_cast<std::uint8_t>(1U << (now->second - 1));
    person.look_at_buttons(sample);
  };
}

TEST_F(KeyboardTasks, ButtonsAnswerPagesAndConfidence) {
  KeyboardRespondent& one = person(AnswerBy::buttons);
  const protocols::ConfidenceSpec sure{"SURE?", {{1, "guessed"}, {2, "sure"}, {3, "certain"}}};
  press_at(one, nobody_, clock_, {{2, 5}, {4, 3}});  // there is no fifth
  EXPECT_EQ(one.confidence(sure).value().stimulus, 2);
  EXPECT_EQ(screen_.replies.count("OTHER KEY"), 1U);
  // The same press has no further effect: it is still held when the next page appears.
  const protocols::PageItem hand{protocols::PageItem::Kind::choice,
                                 "hand",
                                 "HAND?",
                                 {"l", "r"},
                                 {},
                                 {},
                                 true,
                                 {"left", "right"}};
  press_at(one, nobody_, clock_, {{0, 3}, {2, 2}});
  EXPECT_EQ(one.ask({}, hand, {}), "r");
  const std::size_t pages = screen_.pages.size();
  press_at(one, nobody_, clock_, {{2, 4}, {4, 1}});
  one.read_screens({{"FIRST", nullptr}, {"SECOND", nullptr}});
  ASSERT_GE(screen_.pages.size(), pages + 2);
  EXPECT_EQ(screen_.pages.back().text, "SECOND");
}

TEST_F(KeyboardTasks, ButtonsDoNotTypeAndKeysOfPagesStayAllowed) {
  KeyboardRespondent& one = person(AnswerBy::buttons);
  press_at(one, nobody_, clock_, {{1, 1}, {3, 2}});
  protocols::PageItem age{protocols::PageItem::Kind::number, "age", "AGE?", {}, 18, 120};
  EXPECT_EQ(ask(age, "42\n"), "42");
  KeyboardRespondent& by_keys = person(AnswerBy::keys);
  press_at(by_keys, nobody_, clock_, {{1, 1}});
  screen_.script = {{}, {}, {}, {}, {}, {}, {}, {}, {"2"}};
  EXPECT_EQ(by_keys.confidence({"SURE?", {{1, "no"}, {2, "yes"}}}).value().stimulus, 1);
}

}  // namespace
}  // namespace palpate::runner::participants
