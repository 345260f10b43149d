// A live session in this process: a device that fails, a person who is a script, a console
// likewise.

#include "runner/session/live_session.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <set>

#include "protocols/parse.h"
#include "runner/servo/realtime.h"
#include "tests/runner/fake_device.h"

namespace palpate::runner {
namespace {

using testing::FakeDevice;

// 100 Hz: on a busy machine no five ticks are missed in a row.
constexpr const char* kProtocol = R"({"version": 1, "name": "live", "renderers": ["point"],
  "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.02, "subdivisions": 1},
              {"name": "box", "shape": "cube", "edge_m": 0.03}],
  "repetitions": 1, "servo": {"rate_hz": 100}, "home": {"rest_s": 0.05},
  "response": {"keys": {"1": "ball", "2": "box"}, "time_out_s": 30}})";

/// Answers "1" as soon as a trial may be answered, again and again.
class Screen final : public ParticipantScreen {
 public:
  explicit Screen(Clock& clock) : clock_(clock) {}
  void show(const Page& page) override {
    kind = page.kind;
    shown_ns_ = clock_.now_ns();
    texts.push_back(page.text);
    if (kind == Page::Kind::feedback && on_feedback) on_feedback();
    pages.push_back(page);
    if (shown) shown(page);
  }
  std::vector<KeyPress> keys() override {
    if (!wrong_key.empty()) return {{std::exchange(wrong_key, {}), clock_.now_ns()}};
    if (clock_.now_ns() < shown_ns_ + takes_ns) return {};
    if (kind == Page::Kind::text) return {{"space", clock_.now_ns()}};
    if (kind == Page::Kind::neutral && answers) return {{"1", clock_.now_ns()}};
    return {};
  }
  bool open() const override { return is_open; }
  Page::Kind kind = Page::Kind::message;
  std::vector<std::string> texts;
  std::vector<Page> pages;
  std::function<void(const Page&)> shown;
  std::string wrong_key;  ///< pressed once
  std::atomic<bool> answers{true};
  std::int64_t takes_ns = 0;  ///< to read or to answer
  std::function<void()> on_feedback;
  bool is_open = true;

 private:
  Clock& clock_;
  std::int64_t shown_ns_ = 0;
};

/// Clears every fault and goes on, if not told otherwise.
class Console final : public ExperimenterConsole {
 public:
  explicit Console(Clock& clock) : clock_(clock) {}
  void show(const ConsoleState& state) override {
    last = state;
    if (shown) shown(state);
  }
  std::vector<ConsoleCommand> commands() override {
    std::vector<ConsoleCommand> out = std::exchange(next, {});
    if (in_state && in_state->first == last.state)
      out.push_back(std::exchange(in_state, std::nullopt)->second);
    if (last.state == "paused" && goes_on) {
      ++pauses;
      if (repair) repair();
      out.push_back({ConsoleCommand::Kind::go_on, "", clock_.now_ns()});
    }
    if (last.state == "fault" && in_fault) {
      if (in_fault_sees != nullptr) *in_fault_sees = last.held_by;
      out.push_back(*std::exchange(in_fault, std::nullopt));
    } else if (last.state == "fault" && !clears && ++ignored > 1000) {
      out.push_back({ConsoleCommand::Kind::quit, "not obeyed", clock_.now_ns()});
    } else if (last.state == "fault" && clears) {
      ++faults;
      if (repair) repair();
      out.push_back({ConsoleCommand::Kind::clear_fault, "", clock_.now_ns()});
      out.push_back({ConsoleCommand::Kind::go_on, "", clock_.now_ns()});
    }
    return out;
  }
  std::string name_of(ConsoleCommand::Kind kind) const override {
    return kind == ConsoleCommand::Kind::go_on ? "'on'" : "'other'";
  }
  ConsoleState last;
  std::function<void(const ConsoleState&)> shown;
  std::vector<ConsoleCommand> next;
  std::function<void()> repair;
  bool goes_on = false;                    ///< after a pause
  bool clears = true;                      ///< faults
  std::optional<ConsoleCommand> in_fault;  ///< said once
  std::string* in_fault_sees = nullptr;    ///< what it was told then
  /// Said once, in this state.
  std::optional<std::pair<std::string, ConsoleCommand>> in_state;
  int pauses = 0;
  int faults = 0;
  int ignored = 0;  ///< looks at the console after `in_fault`

 private:
  Clock& clock_;
};

class Collected final : public MarkerSink {
 public:
  explicit Collected(std::vector<Marker>& to) : to_(to) {}
  bool send(const Marker& marker) noexcept override {
    to_.push_back(marker);
    return true;
  }

 private:
  std::vector<Marker>& to_;
};

class LiveSessions : public ::testing::Test {
 protected:
  LiveSessions() {
    std::string pattern = ::testing::TempDir() + "live-XXXXXX";
    folder_ = mkdtemp(pattern.data());
    store_.emplace(data::Store::open(folder_ / "live.db", data::Store::Mode::write_or_create));
    participant_ = store_->enrol(info_of(protocol_), "P01");
  }
  ~LiveSessions() override {
    store_.reset();
    std::filesystem::remove_all(folder_);
  }

  LiveSession::Outcome run(Device& device, AnswerBy by = AnswerBy::keys) {
    ServoSettings settings;
    settings.rate = protocol_.servo_rate;
    settings.realtime.lock_memory = false;
    ServoThread servo(device, clock_, settings);
    data::RunInfo info;
    info.program_version = "0.0.0";
    info.device = "fake";
    SessionPlan plan(protocol_, participant_.number, 1);
    for (const data::TrialRecord& r : store_->progress(participant_, 1).completed)
      plan.answered(r.correct);
    std::vector<std::unique_ptr<MarkerSink>> sinks;
    sinks.push_back(std::make_unique<Collected>(markers_));
    Markers markers(std::move(sinks));
    RunRecord record(*store_, info_of(protocol_), participant_, info);
    record.begin();
    const LiveStation station{{protocol_, library_, plan, servo, clock_, {0, 0}, record},
                              record,
                              device.capabilities(),
                              nullptr,
                              servo,
                              nullptr,
                              [this] { return signal_; },
                              screen_,
                              console_,
                              by,
                              markers,
                              noise_.get()};
    return LiveSession(station).run();
  }

  bool has_note(const std::string& text) {
    const std::vector<data::StoredNote> notes = store_->notes();
    return std::any_of(notes.begin(), notes.end(),
                       [&text](const data::StoredNote& note) { return note.text == text; });
  }
  std::vector<data::TrialRecord> records() { return store_->progress(participant_, 1).completed; }
  std::vector<std::string> cut_off_reasons() {
    std::vector<std::string> out;
    store_->for_each_cut_off([&](const data::StoredTrial& t) { out.push_back(t.cut_off_reason); });
    return out;
  }

  protocols::Protocol protocol_ = protocols::parse_protocol_text(kProtocol, "live.json");
  StimulusLibrary library_{protocol_};
  RealClock clock_;
  Screen screen_{clock_};
  Console console_{clock_};
  std::vector<Marker> markers_;
  int signal_ = 0;
  std::unique_ptr<NoisePlayer> noise_;
  std::filesystem::path folder_;
  std::optional<data::Store> store_;
  data::Participant participant_;
};

DeviceReading at(double x, bool lost = false, std::uint8_t buttons = 0) {
  DeviceReading reading{{{x, 0, 0}, {x, 0, 0.12}}, buttons, lost};
  if (lost) reading.trouble = DeviceTrouble::unplugged;
  return reading;
}

TEST_F(LiveSessions, ALostDeviceCutsTheTrialOffAndItIsShownAgainOnceCleared) {
  std::atomic<bool> plugged{true};
  FakeDevice device([&](int tick) {
    if (tick == 30) plugged = false;  // in the first trial
    return at(0.1, !plugged);
  });
  screen_.answers = false;
  console_.repair = [&] { plugged = screen_.answers = true; };
  const LiveSession::Outcome outcome = run(device);
  EXPECT_EQ(outcome.end, data::RunEnd::done);
  EXPECT_EQ(outcome.recorded, 2u);
  EXPECT_GE(console_.faults, 1);
  ASSERT_GE(cut_off_reasons().size(), 1u);
  EXPECT_NE(cut_off_reasons()[0].find("the device is unplugged"), std::string::npos);
  ASSERT_EQ(records().size(), 2u);
  EXPECT_GE(records()[0].attempt, 2);
  EXPECT_EQ(device.force, Vec3(0));
}

TEST_F(LiveSessions, FirstContactIsMarkedAndAnAnswerBeforeItHasNone) {
  screen_.answers = false;
  FakeDevice device([&](int tick) {
    if (tick == 60) screen_.answers = true;
    return at(tick < 30 || tick > 64 ? 0.1 : 0.019);
  });
  EXPECT_EQ(run(device).end, data::RunEnd::done);
  const std::vector<data::TrialRecord> both = records();
  ASSERT_EQ(both.size(), 2u);
  ASSERT_TRUE(both[0].first_contact_time.has_value());
  EXPECT_LT(*both[0].first_contact_time, both[0].response_time);
  EXPECT_FALSE(both[1].first_contact_time.has_value());
  EXPECT_EQ(both[1].response, "ball");
  std::string kinds;
  for (const Marker& marker : markers_) kinds += std::string(to_string(marker.kind)) + " ";
  EXPECT_EQ(kinds, "trial_start first_contact response trial_start response ");
  EXPECT_EQ(markers_[1].time_ns - markers_[0].time_ns,
            std::llround(*both[0].first_contact_time * 1e9));
}

TEST_F(LiveSessions, EveryTrialAsksForTheSameDistanceWhateverItsShape) {
  protocol_.home.rest = 0.4;
  std::atomic<bool> far{false};
  std::vector<std::set<std::string>> seen;  // what the page has said, in each trial
  screen_.answers = false;
  screen_.shown = [&](const Page& page) {
    if (page.kind == Page::Kind::neutral && page.text.empty()) {
      far = screen_.answers = false;
      seen.emplace_back();
    }
    if (page.text == protocol_.texts.move_away) far = true;
    if (page.go) screen_.answers = true;
    if (!seen.empty() && !page.text.empty()) seen.back().insert(page.text);
  };
  // 30 mm off, the ball alone would let its trial begin.
  FakeDevice device([&](int) { return at(far ? 0.1 : 0.03); });
  EXPECT_EQ(run(device).end, data::RunEnd::done);
  ASSERT_EQ(seen.size(), 2u);
  const auto& texts = protocol_.texts;
  for (const auto& said : seen)
    EXPECT_EQ(said, (std::set<std::string>{texts.move_away, texts.ready, texts.go}));
}

TEST_F(LiveSessions, AKeyThatDoesNothingGetsAReplyAndAFaultAsksToWait) {
  std::atomic<bool> plugged{true};
  FakeDevice device([&](int) { return at(0.1, !plugged); });
  screen_.answers = false;
  screen_.shown = [&](const Page& page) {
    if (page.go && page.reply.empty() && plugged && !screen_.answers) screen_.wrong_key = "x";
    if (page.go && !page.reply.empty() && !screen_.answers) plugged = false;
  };
  console_.repair = [&] { plugged = screen_.answers = true; };
  EXPECT_EQ(run(device).end, data::RunEnd::done);
  const auto has = [&](const auto& what) {
    return std::any_of(screen_.pages.begin(), screen_.pages.end(), what);
  };
  EXPECT_TRUE(has([&](const Page& p) { return p.go && p.reply == protocol_.texts.other_key; }));
  EXPECT_TRUE(has([&](const Page& p) {
    return p.kind == Page::Kind::message && p.text == protocol_.texts.wait;
  }));
}

TEST_F(LiveSessions, ABreakCountsDownAndTheConsoleKnowsWhatWasAnswered) {
  protocol_.breaks.every_trials = 1;
  protocol_.breaks.min_seconds = 2;
  protocol_.response.labels["ball"] = "Kugel";
  FakeDevice device([](int) { return at(0.1); });
  EXPECT_EQ(run(device).end, data::RunEnd::done);
  std::vector<int> counted;
  for (const Page& page : screen_.pages) {
    if (page.seconds_left == 0) continue;
    counted.push_back(page.seconds_left);
    EXPECT_EQ(page.done, 1);
    EXPECT_EQ(page.trials, 2);
  }
  EXPECT_EQ(counted, (std::vector<int>{2, 1}));
  const auto trial = std::find_if(screen_.pages.begin(), screen_.pages.end(),
                                  [](const Page& page) { return !page.keys.empty(); });
  ASSERT_NE(trial, screen_.pages.end());
  EXPECT_EQ(trial->keys[0], std::pair(std::string("1"), std::string("Kugel")));
  for (const data::TrialRecord& record : records()) EXPECT_EQ(record.response, "ball");
  EXPECT_EQ(console_.last.answer.substr(0, 6), "ball, ");
  ASSERT_EQ(console_.last.scores.size(), 2u);
  EXPECT_EQ(console_.last.scores[0].right + console_.last.scores[1].right, 1);
  EXPECT_EQ(console_.last.scores[0].shown + console_.last.scores[1].shown, 2);
}

TEST_F(LiveSessions, ButtonsAnswerAtTheirTickAndOneHeldFromBeforeDoesNot) {
  FakeDevice device([](int tick) {  // button 1 is stuck, button 2 is pressed every 40 ticks
    return at(0.1, false, static_cast<std::uint8_t>(1 + (tick % 40 > 35 ? 2 : 0)));
  });
  screen_.answers = false;
  EXPECT_EQ(run(device, AnswerBy::buttons).end, data::RunEnd::done);
  ASSERT_EQ(records().size(), 2u);
  for (const data::TrialRecord& record : records()) EXPECT_EQ(record.response, "box");
}

TEST_F(LiveSessions, AClosedScreenASignalAndAQuitEndItResumably) {
  FakeDevice device([](int) { return at(0.1); });
  screen_.answers = screen_.is_open = false;
  LiveSession::Outcome outcome = run(device);
  EXPECT_EQ(outcome.end, data::RunEnd::aborted);
  EXPECT_TRUE(outcome.failed);
  screen_.is_open = true;
  signal_ = 15;
  outcome = run(device);
  EXPECT_EQ(outcome.end, data::RunEnd::aborted);
  EXPECT_TRUE(outcome.failed);
  signal_ = 0;
  console_.next = {{ConsoleCommand::Kind::quit, "tired", 0}};
  outcome = run(device);
  EXPECT_EQ(outcome.end, data::RunEnd::aborted);
  EXPECT_FALSE(outcome.failed);
  EXPECT_EQ(outcome.reason, "ended by the experimenter: tired");
  screen_.answers = true;
  outcome = run(device);
  EXPECT_EQ(outcome.end, data::RunEnd::done);
  EXPECT_EQ(outcome.recorded, 2u);
}

TEST_F(LiveSessions, AWithdrawalCountsInEveryStateAndSpelling) {
  protocol_.texts.instructions = "read this";
  protocol_.texts.practice = "try";
  protocol_.practice.repetitions = 1;
  protocol_.texts.break_text = "have a rest";
  protocol_.breaks.every_trials = 1;
  protocol_.breaks.min_seconds = 0.05;
  protocol_.response.feedback = true;
  protocol_.texts.end = "that was all";
  const std::vector<std::string> texts = {"withdrawn", "Withdrawn", "WITHDRAWN.",
                                          "she withdrew, feels sick"};
  screen_.takes_ns = 80'000'000;
  int number = 0;
  for (const char* state : {"instructions", "practice begins", "block begins", "rest", "homing",
                            "trial", "fault", "paused", "end"}) {
    participant_ = store_->enrol({protocol_.name, protocol_.source_text, protocol_.sha256},
                                 "W" + std::to_string(++number));
    console_.next.clear();
    console_.last = {};
    console_.clears = console_.goes_on = std::string(state) != "fault";
    if (state == std::string("paused")) {
      console_.goes_on = false;
      console_.next = {{ConsoleCommand::Kind::pause, "", 0}};
    }
    const std::string& text = texts[static_cast<std::size_t>(number) % texts.size()];
    console_.in_state = {state, {ConsoleCommand::Kind::quit, text, 0}};
    FakeDevice device(
        [state](int tick) { return at(0.1, tick > 60 && std::string(state) == "fault"); });
    const LiveSession::Outcome outcome = run(device);
    EXPECT_EQ(outcome.end, data::RunEnd::withdrawn) << text << " in " << state;
    EXPECT_FALSE(outcome.failed);
    EXPECT_EQ(store_->progress(participant_, 1).last_end, data::RunEnd::withdrawn);
    EXPECT_EQ(store_->progress(participant_, 1).completed.size(), outcome.recorded) << state;
  }
}

TEST_F(LiveSessions, WhoLeavesDuringTheFeedbackHasAnswered) {
  protocol_.response.feedback = true;
  FakeDevice device([](int) { return at(0.1); });
  screen_.on_feedback = [&] { console_.next = {{ConsoleCommand::Kind::quit, "", 0}}; };
  const LiveSession::Outcome outcome = run(device);
  EXPECT_EQ(outcome.recorded, 1u);
  EXPECT_EQ(records().size(), 1u);
}

TEST_F(LiveSessions, AWithdrawalOnTheLastPageOrRightAfterAnotherEndCounts) {
  protocol_.texts.end = "that was all";
  FakeDevice device([](int) { return at(0.1); });
  screen_.takes_ns = 80'000'000;
  console_.in_state = {"end", {ConsoleCommand::Kind::quit, "withdrawn", 0}};
  LiveSession::Outcome outcome = run(device);
  EXPECT_EQ(outcome.recorded, 2u);
  EXPECT_EQ(outcome.end, data::RunEnd::withdrawn);
  participant_ = store_->enrol({protocol_.name, protocol_.source_text, protocol_.sha256}, "P02");
  console_.next = {{ConsoleCommand::Kind::quit, "a mistake", 0},
                   {ConsoleCommand::Kind::note, "she said why", 0},
                   {ConsoleCommand::Kind::quit, "Withdrawn", 0}};
  outcome = run(device);
  EXPECT_EQ(outcome.end, data::RunEnd::withdrawn);
  EXPECT_EQ(store_->progress(participant_, 1).last_end, data::RunEnd::withdrawn);
  EXPECT_TRUE(has_note("she said why"));
}

TEST_F(LiveSessions, AClearedFaultIsCleared) {
  std::atomic<bool> plugged{true};
  FakeDevice device([&](int tick) {
    if (tick == 30) plugged = false;
    return at(0.1, !plugged);
  });
  screen_.answers = false;
  int tries = 0;
  console_.repair = [&] {
    if (++tries == 3) plugged = screen_.answers = true;
  };
  EXPECT_EQ(run(device).end, data::RunEnd::done);
  int cleared = 0, refused = 0;
  for (const std::string& message : console_.last.messages) {
    cleared += message.find("fault cleared") == 0 ? 1 : 0;
    refused += message.find("not cleared, forces stay off: the device is unplugged") == 0 ? 1 : 0;
  }
  EXPECT_EQ(cleared, tries - 2) << "also where a busy machine has made it more";
  EXPECT_EQ(refused, 2);
  EXPECT_TRUE(has_note("fault cleared"));
}

TEST_F(LiveSessions, ADeviceThatIsUnpluggedInABreakIsToldOfThere) {
  protocol_.breaks.every_trials = 1;
  protocol_.texts.break_text = "Rest.";
  std::atomic<bool> plugged{true};
  FakeDevice device([&](int) { return at(0.1, !plugged); });
  screen_.takes_ns = 150'000'000;
  std::string state, fault;
  screen_.shown = [&](const Page& page) {
    if (page.text == "Rest." && fault.empty()) plugged = false;
  };
  console_.shown = [&](const ConsoleState& now) {
    if (!fault.empty() || now.fault.empty()) return;
    state = now.state;
    fault = now.fault;
    plugged = true;
    console_.next = {{ConsoleCommand::Kind::clear_fault, "", 0},
                     {ConsoleCommand::Kind::go_on, "", 0}};
  };
  const LiveSession::Outcome outcome = run(device);
  EXPECT_EQ(outcome.end, data::RunEnd::done);
  EXPECT_EQ(outcome.recorded, 2u);
  EXPECT_EQ(state, "rest");
  EXPECT_NE(fault.find("the device is unplugged"), std::string::npos) << fault;
  EXPECT_TRUE(cut_off_reasons().empty()) << "no trial was begun without a device";
}

TEST_F(LiveSessions, AFaultSaysWhatItIsAndWhatGoesOn) {
  FakeDevice device([&](int tick) { return at(0.1, tick > 30); });
  screen_.answers = console_.clears = false;
  console_.in_fault = {ConsoleCommand::Kind::stop_after_trial, "", 0};
  std::string held;
  console_.in_fault_sees = &held;
  run(device);
  EXPECT_EQ(held,
            "the device was lost: the device is unplugged: plug it in again; to continue: 'other', "
            "then 'on'");
}

TEST_F(LiveSessions, ALateGuardIsAPauseAndOneThatHasEndedEndsIt) {
  std::atomic<DeviceTrouble> trouble{DeviceTrouble::none};
  FakeDevice device([&](int tick) {
    if (tick == 30) trouble = DeviceTrouble::guard_late;
    DeviceReading reading = at(0.1, trouble != DeviceTrouble::none);
    reading.trouble = trouble;
    return reading;
  });
  screen_.answers = false;
  console_.goes_on = true;
  console_.clears = false;
  console_.repair = [&] {
    EXPECT_EQ(console_.last.held_by,
              "the guard process was late: the machine may be busy; to continue: 'on'");
    EXPECT_EQ(device.force, Vec3(0));
    trouble = DeviceTrouble::none;
    screen_.answers = true;
  };
  EXPECT_EQ(run(device).end, data::RunEnd::done);
  EXPECT_EQ(console_.pauses, 1);

  participant_ = store_->enrol({protocol_.name, protocol_.source_text, protocol_.sha256}, "P02");
  screen_.answers = false;
  FakeDevice dying([&](int tick) {
    DeviceReading reading = at(0.1, tick >= 30);
    if (tick >= 30) reading.trouble = DeviceTrouble::guard_lost;
    return reading;
  });
  const LiveSession::Outcome outcome = run(dying);
  EXPECT_EQ(outcome.end, data::RunEnd::aborted);
  EXPECT_TRUE(outcome.failed);
  EXPECT_NE(outcome.reason.find("start the program again"), std::string::npos);
  EXPECT_EQ(dying.force, Vec3(0));
}

TEST_F(LiveSessions, AStopIsTakenBackAndTheEndSaysSo) {
  protocol_.texts.end = "that was all";
  FakeDevice device([](int) { return at(0.1); });
  const ConsoleCommand stop{ConsoleCommand::Kind::stop_after_trial, "", 0};
  console_.next = {stop, stop};
  EXPECT_EQ(run(device).end, data::RunEnd::done);
  EXPECT_EQ(screen_.texts.back(), "that was all");
  EXPECT_EQ(console_.last.state, "end");
  EXPECT_EQ(console_.last.stop_plan, "");

  participant_ = store_->enrol({protocol_.name, protocol_.source_text, protocol_.sha256}, "P02");
  console_.next = {{ConsoleCommand::Kind::quit, "", 0}};
  run(device);
  EXPECT_EQ(screen_.texts.back(), "") << "it was not the last object";
}

TEST_F(LiveSessions, AStopIsObeyedWhileItIsHeld) {
  FakeDevice device([](int tick) { return at(0.1, tick > 30); });  // lost for good
  screen_.answers = false;
  console_.clears = false;
  console_.in_fault = {ConsoleCommand::Kind::stop_after_trial, "", 0};
  const LiveSession::Outcome outcome = run(device);
  EXPECT_EQ(outcome.end, data::RunEnd::paused);
  EXPECT_FALSE(outcome.failed);
  EXPECT_EQ(outcome.recorded, 0u);
}

TEST_F(LiveSessions, ASessionAsLongAsAllowedIsPaused) {
  protocol_.sessions.max_minutes = 1e-6;
  FakeDevice device([](int) { return at(0.1); });
  const LiveSession::Outcome outcome = run(device);
  EXPECT_EQ(outcome.end, data::RunEnd::paused);
  EXPECT_LT(outcome.recorded, 2u);
}

/// Shared with the player's thread, which outlives a test's own variables.
using Plugged = std::shared_ptr<std::atomic<bool>>;

/// Takes everything, until it is pulled out.
class Headphones final : public SoundOutput {
 public:
  explicit Headphones(Plugged plugged) : plugged_(std::move(plugged)) {}
  double rate() const override { return 8000; }
  int write(std::span<const std::int16_t>) override {
    if (!*plugged_) throw SoundError("pulled out");
    return 0;
  }
  double latency() override { return 0; }

 private:
  const Plugged plugged_;
};

TEST_F(LiveSessions, HeadphonesPulledOutInATrialCutItOffAndPauseUntilTheyAreBack) {
  const Plugged plugged = std::make_shared<std::atomic<bool>>(true);
  noise_ =
      std::make_unique<NoisePlayer>(protocols::MaskingNoise{}, 1, "headphones",
                                    [plugged](const std::string&) -> std::unique_ptr<SoundOutput> {
                                      if (!*plugged) throw SoundError("no headphones");
                                      return std::make_unique<Headphones>(plugged);
                                    });
  FakeDevice device([&](int tick) {
    if (tick == 30) *plugged = false;  // in the first trial
    return at(0.1);
  });
  screen_.answers = false;
  console_.goes_on = true;
  console_.repair = [&] {  // at the second try
    if (console_.pauses == 2) *plugged = screen_.answers = true;
  };
  EXPECT_EQ(run(device).end, data::RunEnd::done);
  EXPECT_GE(console_.pauses, 2);
  ASSERT_GE(cut_off_reasons().size(), 1u);
  EXPECT_EQ(cut_off_reasons()[0], "the masking noise stopped");
  std::vector<std::string> events;
  for (const data::StoredNote& note : store_->notes()) {
    if (note.text.find("masking_noise") != std::string::npos) events.push_back(note.text);
  }
  ASSERT_EQ(events.size(), 4u);
  EXPECT_NE(events[0].find("\"on\",\"kind\":\"pink\",\"level_db\":-24.0"), std::string::npos);
  EXPECT_NE(events[1].find("\"trouble\":\"pulled out\""), std::string::npos);
  EXPECT_NE(events[2].find("\"on\""), std::string::npos);
  EXPECT_EQ(events[3].find("trouble"), std::string::npos);
}

TEST_F(LiveSessions, MarkersThatNobodyTakesAreCountedAndHoldNobodyUp) {
  struct Never final : MarkerSink {
    bool send(const Marker&) noexcept override { return false; }
  };
  std::vector<std::unique_ptr<MarkerSink>> sinks;
  sinks.push_back(std::make_unique<Never>());
  std::optional<Markers> markers(std::in_place, std::move(sinks));
  for (int i = 0; i < 10; ++i) markers->send({});
  while (markers->dropped() < 10) clock_.wait_until(clock_.now_ns() + 1'000'000);
  EXPECT_EQ(markers->dropped(), 10u);
}

}  // namespace
}  // namespace palpate::runner
