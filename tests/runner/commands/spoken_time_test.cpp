// "today 09:30", "yesterday 15:02": by the local calendar, compared with <chrono>'s.

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <string>

#include "runner/station/admission.h"
#include "tests/data/store/store_fixture.h"

namespace palpate::runner::commands {
namespace {
namespace spoken_times {

using std::chrono::days;
using std::chrono::sys_days;

constexpr std::int64_t kHour = 3'600'000'000'000;  // ns

/// The local day, without the time of day.
sys_days day_of(std::int64_t utc_ns) {
  const std::time_t seconds = utc_ns / 1'000'000'000;
  std::tm at{};
  localtime_r(&seconds, &at);
  return std::chrono::year(at.tm_year + 1900) /
         std::chrono::month(static_cast<unsigned>(at.tm_mon) + 1) /
         std::chrono::day(static_cast<unsigned>(at.tm_mday));
}

class SpokenTime : public ::testing::Test {
 protected:
  SpokenTime() {
    if (const char* const before = std::getenv("TZ")) before_ = before;
  }
  ~SpokenTime() override {
    before_.empty() ? ::unsetenv("TZ") : ::setenv("TZ", before_.c_str(), 1);
    ::tzset();
  }
  static void stand_in(const char* rules) {
    ::setenv("TZ", rules, 1);
    ::tzset();
  }
  std::string before_;
};

TEST_F(SpokenTime, SaysTodayYesterdayOrADate) {
  stand_in("UTC0");
  const std::int64_t now = 1'772'323'200'000'000'000 + kHour / 2;  // 2026-03-01 00:30
  EXPECT_EQ(station::spoken_time(now, now), "today 00:30");
  EXPECT_EQ(station::spoken_time(now - kHour / 2, now), "today 00:00");
  EXPECT_EQ(station::spoken_time(now - kHour, now), "yesterday 23:30");
  EXPECT_EQ(station::spoken_time(now - 24 * kHour, now), "yesterday 00:30");
  EXPECT_EQ(station::spoken_time(now - 25 * kHour, now), "2026-02-27 23:30");
  EXPECT_EQ(station::spoken_time(now + 24 * kHour, now), "2026-03-02 00:30")
      << "a clock that was set back";
}

/// Central Europe: a day of 23 hours in March, one of 25 in October; and half an hour's change.
TEST_F(SpokenTime, FollowsTheCalendarAcrossChangesOfClocks) {
  for (const char* const rules :
       {"CET-1CEST,M3.5.0,M10.5.0/3", "UTC0", "LHST-10:30LHDT-11,M10.1.0,M4.1.0",
        "EST5EDT,M3.2.0,M11.1.0", "XXX3YYY,M3.5.0/0,M10.5.0/0"}) {
    stand_in(rules);
    // From 2025-12-30 over a year, at odd hours.
    for (std::int64_t at = 1'767'052'800; at < 1'767'052'800 + 372LL * 86400;
         at += 5 * 3600 + 1740) {
      const std::int64_t now = at * 1'000'000'000;
      for (const std::int64_t ago : {0, 1, 12, 23, 24, 25, 36, 47, 48, 49}) {
        const std::int64_t then = now - ago * kHour;
        const std::string said = station::spoken_time(then, now);
        const days apart = day_of(now) - day_of(then);
        const std::string word = said.substr(0, said.find(' '));
        if (apart == days(0)) {
          ASSERT_EQ(word, "today") << rules << " " << at << " " << ago;
        } else if (apart == days(1)) {
          ASSERT_EQ(word, "yesterday") << rules << " " << at << " " << ago;
        } else {
          ASSERT_EQ(word.size(), 10U) << rules << " " << at << " " << ago << said;
        }
      }
    }
  }
}

}  // namespace spoken_times
TEST(WithdrawalTime, IsTheWithdrawalsNotTheSessions) {
  const palpate::testing::TemporaryFolder folder;
  data::Store store = data::Store::open(folder / "s.db", data::Store::Mode::write_or_create);
  constexpr std::int64_t kHour_ns = 3'600'000'000'000, kBegan_ns = 946'717'200'000'000'000;
  data::RunInfo info = data::testing::a_run();
  info.clock = {kBegan_ns, 5};
  const data::Run run = store.begin_run(store.enrol(data::testing::a_protocol(), "W1"), info);
  store.add_note(run, 5 + kHour_ns, "tired");
  store.add_note(run, 5 + 3 * kHour_ns, "ended: the participant withdrew");
  store.end_run(run, data::RunEnd::withdrawn, 5 + 3 * kHour_ns);
  EXPECT_EQ(station::withdrawn_when(store, "W1"),
            station::spoken_time(kBegan_ns + 3 * kHour_ns, kBegan_ns + 1000 * kHour_ns));
}

}  // namespace
}  // namespace palpate::runner::commands
