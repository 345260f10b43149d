#include "data/files/utc.h"

#include <gtest/gtest.h>

#include <limits>

namespace palpate::data {
namespace {

TEST(FormatUtc, IsIso8601CutToMicroseconds) {
  EXPECT_EQ(format_utc(0), "1970-01-01T00:00:00.000000Z");
  EXPECT_EQ(format_utc(1'700'000'000'123'456'999), "2023-11-14T22:13:20.123456Z");
  EXPECT_EQ(format_utc(951'782'400'000'000'000), "2000-02-29T00:00:00.000000Z");
}

TEST(FormatUtc, HoldsBeforeTheEpochAndAtRangeEnds) {
  EXPECT_EQ(format_utc(-1), "1969-12-31T23:59:59.999999Z");
  EXPECT_EQ(format_utc(std::numeric_limits<std::int64_t>::max()), "2262-04-11T23:47:16.854775Z");
  EXPECT_EQ(format_utc(std::numeric_limits<std::int64_t>::min()), "1677-09-21T00:12:43.145224Z");
}

TEST(ToUnixNs, MovesBySessionTime) {
  const ClockStamp stamp{.utc_ns = 1'000, .monotonic_ns = 50};
  EXPECT_EQ(to_unix_ns(stamp, 50), 1'000);
  EXPECT_EQ(to_unix_ns(stamp, 57), 1'007);
  EXPECT_EQ(to_unix_ns(stamp, 40), 990);
}

TEST(ToUnixNs, StaysAtTheEndsOfTheRange) {
  using Limits = std::numeric_limits<std::int64_t>;
  EXPECT_EQ(to_unix_ns({.utc_ns = 1'000, .monotonic_ns = 0}, Limits::max()), Limits::max());
  EXPECT_EQ(to_unix_ns({.utc_ns = 0, .monotonic_ns = -1}, Limits::max()), Limits::max());
  EXPECT_EQ(to_unix_ns({.utc_ns = 0, .monotonic_ns = 1}, Limits::min()), Limits::min());
  EXPECT_EQ(to_unix_ns({.utc_ns = -1'000, .monotonic_ns = 0}, Limits::min()), Limits::min());
}

}  // namespace
}  // namespace palpate::data
