#include <gtest/gtest.h>

#include <limits>

#include "runner/session/device_check.h"

namespace palpate::runner::session {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000, kDay = 86'400 * kSecond, kYear = 365 * kDay;
constexpr std::int64_t kNow = 1'780'000'000 * kSecond;  // 2026-05-28

bool says(const ClockEvidence& evidence, const std::string& part) {
  return clock_warning(evidence).find(part) != std::string::npos;
}

TEST(ClockCheck, AConsistentClockIsAccepted) {
  EXPECT_EQ(clock_warning({kNow, {}, {}}), "");
  EXPECT_EQ(clock_warning({kNow, kNow - 1, kNow - kDay}), "");
  EXPECT_EQ(clock_warning({kNow, kNow + kSecond, kNow + kDay / 2}), "") << "set right meanwhile";
  EXPECT_EQ(clock_warning({kNow, kNow - kYear, kNow - 4 * kYear}), "");
}

TEST(ClockCheck, BehindTheNewestRecord) {
  const ClockEvidence evidence{kNow, kNow + 40 * 60 * kSecond, {}};
  EXPECT_TRUE(says(evidence, "says 2026-05-28 20:26 UTC, 40 minutes before the newest record"))
      << clock_warning(evidence);
  EXPECT_TRUE(says({kNow, kNow + 3 * kSecond, {}}, "3 seconds before"));
  EXPECT_TRUE(says({kNow, kNow + kDay, {}}, "1 day before"));
  EXPECT_TRUE(says({kNow, kNow + 7 * kYear, {}}, "7 years before"));
}

TEST(ClockCheck, AClockThatIsYearsOffIsReported) {
  EXPECT_TRUE(says({kNow, kNow - 10 * kYear, kNow}, "10 years after the newest record"));
  EXPECT_TRUE(says({kDay, {}, {}}, "before this program existed"));
  EXPECT_TRUE(says({kNow, {}, kNow + 2 * kYear}, "2 years before the protocol or the program"));
  EXPECT_TRUE(says({kNow, {}, kNow - 9 * kYear}, "9 years after the protocol or the program"));
}

TEST(ClockCheck, DatesOfADamagedFileAreIgnored) {
  using Limits = std::numeric_limits<std::int64_t>;
  EXPECT_TRUE(says({kNow, Limits::max(), {}}, "before the newest record"));
  EXPECT_TRUE(says({kNow, Limits::min(), {}}, "after the newest record"));
  EXPECT_NE(clock_warning({Limits::min(), Limits::max(), Limits::max()}), "");
}

}  // namespace
}  // namespace palpate::runner::session
