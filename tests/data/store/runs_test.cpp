// Permitted operations of a session, their order, and the state on resuming.

#include <gtest/gtest.h>

#include "data/store/store.h"
#include "tests/data/store/store_fixture.h"

namespace palpate::data {
namespace {

using namespace palpate::data::testing;

using StoreSession = StoreOnDisk;

TEST_F(StoreSession, LatestRecordedTimeIsOfALiveSession) {
  Store store = open();
  EXPECT_EQ(store.latest_recorded_time(), std::nullopt);
  RunInfo info = a_run();
  info.observer_sha256 = std::string(64, 'f');
  store.begin_run(store.enrol(a_protocol(), "S1", {}, true, 7), info);
  EXPECT_EQ(store.latest_recorded_time(), std::nullopt) << "a simulated study has its own calendar";
  info = a_run();
  const palpate::data::Run run = store.begin_run(store.enrol(a_protocol(), "A"), info);
  EXPECT_EQ(store.latest_recorded_time(), info.clock.utc_ns);
  show(store, run, 2);
  const std::int64_t answered_ns = a_record(2).response_ns - info.clock.monotonic_ns;
  EXPECT_EQ(store.latest_recorded_time(), info.clock.utc_ns + answered_ns);
  store.end_run(run, RunEnd::paused, info.clock.monotonic_ns + 3'600'000'000'000);
  EXPECT_EQ(store.latest_recorded_time(), info.clock.utc_ns + 3'600'000'000'000);
}

TEST_F(StoreSession, ProgressStartsEmptyAndGrowsByTrial) {
  Store store = open();
  const Participant person = store.enrol(a_protocol(), "A");
  EXPECT_EQ(store.progress(person, 1).last_end, std::nullopt);
  EXPECT_TRUE(store.progress(person, 1).completed.empty());
  const palpate::data::Run run = store.begin_run(person, a_run());
  show(store, run, 2);
  show(store, run, 1);
  store.begin_attempt(run, a_plan(3), 1);
  const auto progress = store.progress(person, 1);
  ASSERT_EQ(progress.completed.size(), 2u);
  EXPECT_EQ(progress.completed[0].trial, 1);
  EXPECT_EQ(progress.completed[1].trial, 2);
  EXPECT_EQ(progress.latest_ns, a_record(2).response_ns);
  EXPECT_EQ(progress.last_end, RunEnd::running);
  EXPECT_EQ(progress.clock.utc_ns, a_run().clock.utc_ns);
  EXPECT_EQ(progress.clock.monotonic_ns, a_run().clock.monotonic_ns);
  EXPECT_TRUE(store.progress(person, 2).completed.empty());
}

TEST_F(StoreSession, RecordsInterruptionsAndShowsTheTrialAgain) {
  Participant person;
  {
    Store store = open();
    person = store.enrol(a_protocol(), "A");
    const palpate::data::Run run = store.begin_run(person, a_run());
    show(store, run, 1);
    EXPECT_EQ(store.begin_attempt(run, a_plan(2), 77), 1);
  }  // no end_run: as if the process had died
  {
    Store reader = Store::open(path_, Store::Mode::read_only);
    EXPECT_EQ(reader.progress(person, 1).last_end, RunEnd::running) << "a reader changes nothing";
  }
  Store store = open();
  const auto progress = store.progress(person, 1);
  EXPECT_EQ(progress.last_end, RunEnd::interrupted);
  EXPECT_EQ(progress.cut_off, 1);
  ASSERT_EQ(progress.completed.size(), 1u);
  RunInfo later = a_run();
  later.clock = {.utc_ns = 1'800'000'000'000'000'000, .monotonic_ns = 40};
  later.program_version = "0.1.1";
  const palpate::data::Run run = store.begin_run(person, later);
  TrialRecord record = a_record(2);
  record.attempt = store.begin_attempt(run, record, 90);
  EXPECT_EQ(record.attempt, 2);
  store.finish_attempt(run, record);
  store.end_run(run, RunEnd::done, 100);
  EXPECT_EQ(store.progress(person, 1).clock.monotonic_ns, a_run().clock.monotonic_ns)
      << "of the first run";

  int cut_off = 0;
  store.for_each_cut_off([&](const StoredTrial& trial) {
    ++cut_off;
    EXPECT_EQ(trial.record.trial, 2);
    EXPECT_EQ(trial.record.attempt, 1);
    EXPECT_EQ(trial.record.onset_ns, 77);
    EXPECT_EQ(trial.record.shape, "cube");
    EXPECT_EQ(trial.record.orientation_wxyz, a_plan(2).orientation_wxyz);
    EXPECT_EQ(trial.run.program_version, "0.1.0");
    EXPECT_TRUE(contains(trial.cut_off_reason, "interrupted"));
  });
  EXPECT_EQ(cut_off, 1);
  std::vector<std::pair<int, std::string>> trials;
  store.for_each_trial([&](const StoredTrial& trial) {
    trials.emplace_back(trial.record.attempt, trial.run.program_version);
  });
  EXPECT_EQ(trials, (std::vector<std::pair<int, std::string>>{{1, "0.1.0"}, {2, "0.1.1"}}));
  const auto runs = store.runs();
  ASSERT_EQ(runs.size(), 2u);
  EXPECT_EQ(runs[0].end, RunEnd::interrupted);
  EXPECT_EQ(runs[1].end, RunEnd::done);
  EXPECT_EQ(store.counts().interrupted_runs, 1);
}

TEST_F(StoreSession, OnlyPausedAndAbortedSessionsResume) {
  Store store = open();
  const Participant person = store.enrol(a_protocol(), "A");
  int session = 0;
  for (const RunEnd end : {RunEnd::paused, RunEnd::aborted, RunEnd::done, RunEnd::withdrawn}) {
    const palpate::data::Run run = store.begin_run(person, a_run(++session));
    store.end_run(run, end, 9);
    EXPECT_EQ(store.progress(person, session).last_end, end);
    if (end == RunEnd::paused || end == RunEnd::aborted) {
      EXPECT_NO_THROW(store.begin_run(person, a_run(session)));
    } else {
      EXPECT_TRUE(
          contains(error_of([&] { store.begin_run(person, a_run(session)); }), to_string(end)));
    }
  }
  EXPECT_TRUE(contains(error_of([&] { store.begin_run(person, a_run(1)); }), "running"));
}

TEST_F(StoreSession, ARunEndsOnceAndTakesNothingAfterwards) {
  Store store = open();
  const Participant person = store.enrol(a_protocol(), "A");
  const palpate::data::Run run = store.begin_run(person, a_run());
  EXPECT_THROW(store.end_run(run, RunEnd::running, 1), StoreRefused);
  EXPECT_THROW(store.end_run(run, RunEnd::interrupted, 1), StoreRefused);
  store.begin_attempt(run, a_plan(1), 1);
  store.end_run(run, RunEnd::aborted, 1);
  EXPECT_EQ(store.counts().cut_off, 1) << "the open attempt";
  EXPECT_THROW(store.end_run(run, RunEnd::done, 1), StoreRefused);
  EXPECT_THROW(store.begin_attempt(run, a_plan(2), 1), StoreRefused);
  EXPECT_THROW(store.finish_attempt(run, a_record(1)), StoreRefused);
  EXPECT_THROW(store.cut_off_attempt(run, "x"), StoreRefused);
}

TEST_F(StoreSession, TrialsHaveOneRecordAndOneOpenAttempt) {
  Store store = open();
  const palpate::data::Run run = store.begin_run(store.enrol(a_protocol(), "A"), a_run());
  show(store, run, 1);
  EXPECT_TRUE(
      contains(error_of([&] { store.begin_attempt(run, a_plan(1), 1); }), "already has a record"));
  EXPECT_THROW(store.finish_attempt(run, a_record(1)), StoreRefused);
  store.begin_attempt(run, a_plan(2), 1);
  EXPECT_TRUE(
      contains(error_of([&] { store.begin_attempt(run, a_plan(3), 1); }), "trial 2 has not ended"));
  store.cut_off_attempt(run, "device fault");
  EXPECT_EQ(store.begin_attempt(run, a_plan(2), 1), 2);
  EXPECT_THROW(store.begin_attempt(run, a_plan(3, 2), 1), StoreRefused)
      << "another session than the run's";
}

TEST_F(StoreSession, RefusesRecordsOfAnotherTrialThanBegun) {
  Store store = open();
  const palpate::data::Run run = store.begin_run(store.enrol(a_protocol(), "A"), a_run());
  store.begin_attempt(run, a_plan(1), 1);
  const auto refused = [&](auto change) {
    TrialRecord record = a_record(1);
    change(record);
    EXPECT_THROW(store.finish_attempt(run, record), StoreRefused);
  };
  refused([](TrialRecord& r) { r.trial = 2; });
  refused([](TrialRecord& r) { r.attempt = 2; });
  refused([](TrialRecord& r) { r.block = 9; });
  refused([](TrialRecord& r) { r.renderer = "point"; });
  refused([](TrialRecord& r) { r.shape = "sphere"; });
  refused([](TrialRecord& r) { r.practice = true; });
  refused([](TrialRecord& r) { r.orientation_wxyz[0] = 0.25; });
  refused([](TrialRecord& r) { r.session = 2; });
  refused([](TrialRecord& r) { r.timed_out = true; });  // with a response
  EXPECT_EQ(store.counts().completed, 0);
  store.finish_attempt(run, a_record(1));
  EXPECT_EQ(store.counts().completed, 1);
}

TEST_F(StoreSession, SimulatedTrialsComeAllOrNone) {
  Store store = open();
  const palpate::data::Run run =
      store.begin_run(store.enrol(a_protocol(), "S1", {}, true, 1), a_run());
  store.record_simulated(run, {a_record(1), a_record(2)});
  EXPECT_TRUE(contains(error_of([&] {
                         store.record_simulated(run, {a_record(3), a_record(2)});
                       }),
                       "trial 2"));
  TrialRecord again = a_record(4);
  again.attempt = 2;
  EXPECT_THROW(store.record_simulated(run, {again}), StoreRefused);
  EXPECT_EQ(store.counts().completed, 2);
  store.record_simulated(run, {});
  store.end_run(run, RunEnd::done, 1);
  EXPECT_THROW(store.record_simulated(run, {a_record(3)}), StoreRefused);
  EXPECT_EQ(store.counts().cut_off, 0);
}

TEST_F(StoreSession, RealParticipantsTrialsAreNotStoredInBulk) {
  Store store = open();
  const palpate::data::Run run = store.begin_run(store.enrol(a_protocol(), "A"), a_run());
  EXPECT_THROW(store.record_simulated(run, {a_record(1)}), StoreRefused);
  EXPECT_EQ(store.counts().completed, 0);
}

TEST_F(StoreSession, ASimulatedSessionKeepsItsObserver) {
  Store store = open();
  const Participant person = store.enrol(a_protocol(), "S1", {}, true, 1);
  RunInfo info = a_run();
  info.observer_sha256 = "one";
  store.end_run(store.begin_run(person, info), RunEnd::paused, 1);
  info.observer_sha256 = "two";
  EXPECT_TRUE(contains(error_of([&] { store.begin_run(person, info); }), "other settings"));
  EXPECT_THROW(store.begin_run(store.enrol(a_protocol(), "A"), info), StoreRefused)
      << "a real one has none";
}

TEST_F(StoreSession, TrialsComeByProtocolNumberSessionAndTrial) {
  Store store = open();
  const Participant late = store.enrol(a_protocol(), "Late", 2);
  const Participant early = store.enrol(a_protocol(), "Early", 1);
  for (const auto& person : {late, early}) {
    for (const int session : {2, 1}) {
      const palpate::data::Run run = store.begin_run(person, a_run(session));
      for (const int trial : {10, 9, 2}) show(store, run, trial);
    }
  }
  std::string order;
  store.for_each_trial([&](const StoredTrial& t) {
    order += t.participant.code + std::to_string(t.record.session) + "." +
             std::to_string(t.record.trial) + " ";
  });
  EXPECT_EQ(order,
            "Early1.2 Early1.9 Early1.10 Early2.2 Early2.9 Early2.10 "
            "Late1.2 Late1.9 Late1.10 Late2.2 Late2.9 Late2.10 ");
  const auto counts = store.counts();
  EXPECT_EQ(counts.sessions, 4);
  EXPECT_EQ(counts.runs, 4);
  EXPECT_EQ(counts.completed, 12);
}

}  // namespace
}  // namespace palpate::data
