// How a live session ends: signals, a closed screen, withdrawal, stops and limits.

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/runner/fake_device.h"
#include "tests/runner/session/live_session_case.h"

namespace palpate::runner::session {
namespace {

using runner::testing::FakeDevice;
using testing::at;
using testing::LiveSessions;

TEST_F(LiveSessions, AClosedScreenASignalOrAQuitEndsItResumably) {
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
  console_.next = {{display::ConsoleCommand::Kind::quit, "tired", 0}};
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
  protocol_.repetitions = protocol_.blocks_per_renderer = 2;  // no text is read after practice
  protocol_.texts.break_text = "have a rest";
  protocol_.breaks.every_trials = 1;
  protocol_.breaks.min_seconds = 0.05;
  protocol_.blocks.front().feedback = true;
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
    console_.clears = console_.resumes = std::string(state) != "fault";
    if (state == std::string("paused")) {
      console_.resumes = false;
      console_.next = {{display::ConsoleCommand::Kind::pause, "", 0}};
    }
    const std::string& text = texts[static_cast<std::size_t>(number) % texts.size()];
    console_.in_state = {state, {display::ConsoleCommand::Kind::quit, text, 0}};
    FakeDevice device(
        [state](int tick) { return at(0.1, tick > 60 && std::string(state) == "fault"); });
    const LiveSession::Outcome outcome = run(device);
    EXPECT_EQ(outcome.end, data::RunEnd::withdrawn) << text << " in " << state;
    EXPECT_FALSE(outcome.failed);
    EXPECT_EQ(store_->progress(participant_, 1).last_end, data::RunEnd::withdrawn);
    EXPECT_EQ(store_->progress(participant_, 1).completed.size(), outcome.recorded) << state;
  }
}

TEST_F(LiveSessions, AnEndDuringTheFeedbackKeepsTheAnswer) {
  protocol_.blocks.front().feedback = true;
  FakeDevice device([](int) { return at(0.1); });
  screen_.on_feedback = [&] { console_.next = {{display::ConsoleCommand::Kind::quit, "", 0}}; };
  const LiveSession::Outcome outcome = run(device);
  EXPECT_EQ(outcome.recorded, 1u);
  EXPECT_EQ(records().size(), 1u);
}

TEST_F(LiveSessions, LateWithdrawalsCount) {
  protocol_.texts.end = "that was all";
  FakeDevice device([](int) { return at(0.1); });
  screen_.takes_ns = 80'000'000;
  console_.in_state = {"end", {display::ConsoleCommand::Kind::quit, "withdrawn", 0}};
  LiveSession::Outcome outcome = run(device);
  EXPECT_EQ(outcome.recorded, 2u);
  EXPECT_EQ(outcome.end, data::RunEnd::withdrawn);
  participant_ = store_->enrol({protocol_.name, protocol_.source_text, protocol_.sha256}, "P02");
  console_.next = {{display::ConsoleCommand::Kind::quit, "a mistake", 0},
                   {display::ConsoleCommand::Kind::note, "she said why", 0},
                   {display::ConsoleCommand::Kind::quit, "Withdrawn", 0}};
  outcome = run(device);
  EXPECT_EQ(outcome.end, data::RunEnd::withdrawn);
  EXPECT_EQ(store_->progress(participant_, 1).last_end, data::RunEnd::withdrawn);
  EXPECT_TRUE(has_note("she said why"));
}

TEST_F(LiveSessions, AStopCanBeCancelledAndTheEndReportsIt) {
  protocol_.texts.end = "that was all";
  FakeDevice device([](int) { return at(0.1); });
  const display::ConsoleCommand stop{display::ConsoleCommand::Kind::stop_after_trial, "", 0};
  console_.next = {stop, stop};
  EXPECT_EQ(run(device).end, data::RunEnd::done);
  EXPECT_EQ(screen_.texts.back(), "that was all");
  EXPECT_EQ(console_.last.state, "end");
  EXPECT_EQ(console_.last.stop_plan, "");

  participant_ = store_->enrol({protocol_.name, protocol_.source_text, protocol_.sha256}, "P02");
  console_.next = {{display::ConsoleCommand::Kind::quit, "", 0}};
  run(device);
  EXPECT_EQ(screen_.texts.back(), "") << "it was not the last object";
}

TEST_F(LiveSessions, TheLastPageAfterAStopCountsEveryRecordedTrial) {
  FakeDevice device([](int) { return at(0.1); });
  screen_.takes_ns = 80'000'000;
  console_.in_state = {"trial", {display::ConsoleCommand::Kind::stop_after_trial, "", 0}};
  const LiveSession::Outcome outcome = run(device);
  EXPECT_EQ(outcome.end, data::RunEnd::paused);
  ASSERT_EQ(outcome.recorded, 1u);
  EXPECT_EQ(screen_.pages.back().done, 1);
  EXPECT_EQ(screen_.pages.back().trials, 2);
}

TEST_F(LiveSessions, AStopIsObeyedWhileTheSessionWaits) {
  FakeDevice device([](int tick) { return at(0.1, tick > 30); });  // lost for good
  screen_.answers = false;
  console_.clears = false;
  console_.in_fault = {display::ConsoleCommand::Kind::stop_after_trial, "", 0};
  const LiveSession::Outcome outcome = run(device);
  EXPECT_EQ(outcome.end, data::RunEnd::paused);
  EXPECT_FALSE(outcome.failed);
  EXPECT_EQ(outcome.recorded, 0u);
}

TEST_F(LiveSessions, ASessionThatReachesItsLimitIsPaused) {
  protocol_.sessions.max_minutes = 1e-6;
  FakeDevice device([](int) { return at(0.1); });
  const LiveSession::Outcome outcome = run(device);
  EXPECT_EQ(outcome.end, data::RunEnd::paused);
  EXPECT_LT(outcome.recorded, 2u);
}

}  // namespace
}  // namespace palpate::runner::session
