// The session as a state machine, with a scripted respondent on a fake device.

#include <gtest/gtest.h>

#include <deque>
#include <limits>
#include <string>

#include "runner/session/run_record.h"
#include "tests/runner/session/session_case.h"
#include "tests/shared/temporary_folder.h"

namespace palpate::runner::session {
namespace {

using runner::testing::FakeDevice;

TEST(Session, RunsPracticeBlocksBreaksAndEnd) {
  SessionBench bench;
  ScriptedRespondent respondent({});
  Session session = bench.session(respondent, protocols::SessionPlan(bench.protocol, 1, 1));
  run(session);
  // Practice of 2, then blocks of 2. A rest comes between blocks, not after practice. Practice does
  // not count in the three trials until a break either.
  EXPECT_EQ(respondent.pages, "hello;try;right;right;rest;bye;");
  ASSERT_EQ(bench.log.finished.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) {
    const data::TrialRecord& record = bench.log.finished[i];
    EXPECT_EQ(record.trial, static_cast<int>(i) + 1);
    EXPECT_EQ(record.practice, i < 2);
    EXPECT_TRUE(record.correct);
    EXPECT_EQ(record.response, record.shape);
    EXPECT_DOUBLE_EQ(record.response_time, 0.3);
    EXPECT_EQ(record.onset_utc.substr(0, 11), "1970-01-01T");
  }
  EXPECT_LT(bench.log.finished[2].onset_ns - bench.log.finished[1].response_ns, 20'000'000'000);
  EXPECT_GE(bench.log.finished[4].onset_ns - bench.log.finished[3].response_ns, 20'000'000'000);
}

TEST(Session, BreaksAreDueAfterTheirTrials) {
  SessionBench bench;
  bench.protocol.blocks_per_renderer = 1;
  bench.protocol.repetitions = 4;  // 2 of practice, then 8 for each renderer
  ScriptedRespondent respondent({});
  Session session = bench.session(respondent, protocols::SessionPlan(bench.protocol, 1, 1));
  run(session);
  std::vector<std::size_t> after;  // number of trials before each break
  const auto& finished = bench.log.finished;
  for (std::size_t i = 1; i < finished.size(); ++i) {
    if (finished[i].onset_ns - finished[i - 1].response_ns >= 20'000'000'000) after.push_back(i);
  }
  const std::size_t practice = static_cast<std::size_t>(
      std::count_if(finished.begin(), finished.end(), [](const auto& r) { return r.practice; }));
  ASSERT_FALSE(after.empty());
  EXPECT_EQ(after.front(), practice + 3);
}

TEST(Session, TimeOutIsWrongWithTheLimitAsItsTime) {
  SessionBench bench;
  ScriptedRespondent respondent({1, 1, -1});
  Session session = bench.session(respondent, protocols::SessionPlan(bench.protocol, 1, 1));
  run(session);
  const data::TrialRecord& record = bench.log.finished[2];
  EXPECT_TRUE(record.timed_out);
  EXPECT_FALSE(record.correct);
  EXPECT_EQ(record.response, "");
  EXPECT_EQ(record.response_time, 2);
}

TEST(Session, PracticeIsRepeatedUntilTheCriterionOrTheLastRound) {
  const struct {
    std::deque<int> right;
    std::size_t trials;
  } cases[] = {{{}, 6}, {{0}, 8}, {{0, 1, 1, 0}, 10}, {{0, 0, 0, 0, 0, 0}, 10}};
  for (const auto& [right, trials] : cases) {
    SessionBench bench;
    ScriptedRespondent respondent(right);
    Session session = bench.session(respondent, protocols::SessionPlan(bench.protocol, 1, 1));
    run(session);
    ASSERT_EQ(bench.log.finished.size(), trials);
    for (std::size_t i = 0; i < trials; ++i) {
      EXPECT_EQ(bench.log.finished[i].trial, static_cast<int>(i) + 1);
      EXPECT_EQ(bench.log.finished[i].practice, i + 4 < trials);
    }
  }
}

TEST(Session, ResumesAtTheFirstUnrecordedTrial) {
  const std::deque<int> script = {0, 1, 1, 1, 0, -1, 1, 0};
  SessionBench whole;
  ScriptedRespondent respondent(script);
  Session session = whole.session(respondent, protocols::SessionPlan(whole.protocol, 1, 1));
  run(session);
  const auto& expected = whole.log.finished;
  for (std::size_t stop = 0; stop <= expected.size(); ++stop) {
    SessionBench bench;
    protocols::SessionPlan plan(bench.protocol, 1, 1);
    for (std::size_t i = 0; i < stop; ++i)
      plan.answered({expected[i].correct, expected[i].correct});
    ScriptedRespondent rest(
        {script.begin() + static_cast<std::ptrdiff_t>(std::min(stop, script.size())),
         script.end()});
    Session resumed = bench.session(rest, plan);
    run(resumed);
    ASSERT_EQ(bench.log.finished.size(), expected.size() - stop);
    for (std::size_t i = stop; i < expected.size(); ++i) {
      const data::TrialRecord& record = bench.log.finished[i - stop];
      EXPECT_EQ(record.trial, expected[i].trial);
      EXPECT_EQ(record.shape, expected[i].shape);
      EXPECT_EQ(record.orientation_wxyz, expected[i].orientation_wxyz);
    }
  }
}

TEST(Session, AFaultCutsTheTrialOffWithZeroForce) {
  SessionBench bench;
  FakeDevice failing([](int tick) {
    const double z = tick == 700 ? std::numeric_limits<double>::quiet_NaN() : 0.1;
    return servo::DeviceReading{{{0, 0, z}, {0, 0, 0.22}}, 0, false};
  });
  servo::Servo servo(failing, bench.clock, 1000, servo::ForceLimits{});
  ScriptedRespondent respondent({-1});
  Session session = bench.session(respondent, protocols::SessionPlan(bench.protocol, 1, 1), servo);
  EXPECT_THROW(run(session), SessionFault);
  EXPECT_EQ(failing.force, Vec3(0));
  EXPECT_EQ(bench.log.began.size(), 1u);
  EXPECT_TRUE(bench.log.finished.empty());
  ASSERT_EQ(bench.log.cut.size(), 1u);
  EXPECT_NE(bench.log.cut[0].find("not finite"), std::string::npos);
}

// A live session's trial in the store: begun on disk, cut off by a fault, repeated.
TEST(Session, RecordsBothAttemptsOfACutOffTrial) {
  const palpate::testing::TemporaryFolder folder;
  {
    SessionBench bench;
    const protocols::Protocol& protocol = bench.protocol;
    data::Store store = data::Store::open(folder / "live.db", data::Store::Mode::write_or_create);
    const data::Participant participant = store.enrol(info_of(protocol), "P01");
    data::RunInfo info;
    info.program_version = "0.0.0";
    info.device = "fake";
    FakeDevice failing([](int tick) {
      return servo::DeviceReading{
          {{0, 0, 0.1}, {0, 0, 0.22}}, 0, tick == 2000};  // in the third trial
    });
    servo::Servo servo(failing, bench.clock, 1000, servo::ForceLimits{});
    RunRecord log(store, info_of(protocol), participant, info);
    ScriptedRespondent respondent({});
    Session session({protocol,
                     bench.library,
                     protocols::SessionPlan(protocol, participant.number, 1),
                     servo,
                     bench.clock,
                     {0, 0},
                     log},
                    respondent);
    EXPECT_THROW(run(session), SessionFault);
    EXPECT_EQ(failing.force, Vec3(0));
    log.end(data::RunEnd::aborted, bench.clock.now_ns());

    const data::SessionProgress before = store.progress(participant, 1);
    EXPECT_EQ(before.completed.size(), 2u);
    EXPECT_EQ(before.cut_off, 1);
    protocols::SessionPlan plan(protocol, participant.number, 1);
    for (const data::TrialRecord& record : before.completed)
      plan.answered({record.correct, record.correct});
    RunRecord again(store, info_of(protocol), participant, info);
    Session resumed({protocol, bench.library, plan, bench.servo, bench.clock, {0, 0}, again},
                    respondent);
    run(resumed);
    again.end(data::RunEnd::done, bench.clock.now_ns());
    const data::SessionProgress after = store.progress(participant, 1);
    ASSERT_EQ(after.completed.size(), 6u);
    for (const data::TrialRecord& record : after.completed) {
      EXPECT_EQ(record.attempt, record.trial == 3 ? 2 : 1);
    }
  }
}

}  // namespace
}  // namespace palpate::runner::session
