// A session is refused if what was seen in the newest one was later than people are sure to miss.

#include <gtest/gtest.h>

#include "protocols/parse.h"
#include "runner/station/lag_check.h"
#include "runner/usage_error.h"
#include "tests/data/store/store_fixture.h"

namespace palpate::runner::commands {
namespace {

protocols::Protocol seen(bool accepted) {
  const std::string lag = accepted ? R"(, "lag": "accepted")" : "";
  return protocols::parse_protocol_text(
      R"({"version": 2, "name": "s", "renderers": ["point"], "view": {"screen_m":
      [[-0.2, 0.2, -0.1], [0.2, 0.2, -0.1], [-0.2, 0.2, 0.1]], "eye_m": [0, -0.3, 0])" +
          lag + R"(}, "stimuli": [{"name": "a", "shape": "cube", "edge_m": 0.05,
      "seen": {"what": "object"}}], "blocks": [{"name": "b", "task": "rate", "stimuli": ["a"],
      "repetitions": 1}]})",
      "s.json");
}

/// A session with a trial whose frames were so late. \param lag  s; negative: nothing was seen
void add_session(data::Store& store, int session, double lag) {
  data::RunInfo info = data::testing::a_run(session);
  info.clock.utc_ns += session * 1'000'000'000LL;
  const data::Run run = store.begin_run(store.enrol(data::testing::a_protocol(), "P1"), info);
  data::TrialRecord record = data::testing::a_record(1, session);
  record.task.task = "rate";
  record.task.block_name = "b";
  record.attempt = store.begin_attempt(run, record, record.onset_ns - 1);
  record.task.intervals = {{}};
  if (lag >= 0) record.task.seen = {100, 2, lag, lag + 0.001};
  store.finish_attempt(run, record);
}

TEST(SeenLag, NewestSessionDecides) {
  const palpate::testing::TemporaryFolder folder;
  data::Store store = data::Store::open(folder / "s.db", data::Store::Mode::write_or_create);
  EXPECT_EQ(station::check_seen_lag(store, seen(false)), "");
  add_session(store, 1, 0.012);
  EXPECT_EQ(station::check_seen_lag(store, seen(false)), "");
  add_session(store, 2, 0.05);
  EXPECT_THROW(station::check_seen_lag(store, seen(false)), UsageError);
  EXPECT_EQ(station::check_seen_lag(store, seen(true)), R"({"seen_lag_accepted_s":0.05})");
  add_session(store, 3, -1);  // nothing was seen: the one before tells
  EXPECT_THROW(station::check_seen_lag(store, seen(false)), UsageError);
  add_session(store, 4, 0.01);
  EXPECT_EQ(station::check_seen_lag(store, seen(false)), "");
}

TEST(SeenLag, IsKeptAsItWasMeasured) {
  const palpate::testing::TemporaryFolder folder;
  data::Store store = data::Store::open(folder / "s.db", data::Store::Mode::write_or_create);
  add_session(store, 1, 0.0123456789);
  store.for_each_trial([](const data::StoredTrial& trial) {
    ASSERT_TRUE(trial.record.task.seen);
    EXPECT_EQ(trial.record.task.seen->frames, 100);
    EXPECT_EQ(trial.record.task.seen->dropped, 2);
    EXPECT_EQ(trial.record.task.seen->lag, 0.0123456789);
    EXPECT_EQ(trial.record.task.seen->lag_p99, 0.0123456789 + 0.001);
  });
}

}  // namespace
}  // namespace palpate::runner::commands
