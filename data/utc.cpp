#include "data/utc.h"

#include <array>
#include <chrono>
#include <cstdio>
#include <limits>

namespace palpate {

std::string format_utc(std::int64_t unix_ns) {
  using namespace std::chrono;
  const sys_time<nanoseconds> instant{nanoseconds{unix_ns}};
  const auto cut = floor<microseconds>(instant);
  const auto day = floor<days>(cut);
  const year_month_day date{day};
  const hh_mm_ss<microseconds> time{cut - day};
  std::array<char, 40> text{};
  const int length = std::snprintf(
      text.data(), text.size(), "%04d-%02u-%02uT%02d:%02d:%02d.%06dZ",
      static_cast<int>(date.year()), static_cast<unsigned>(date.month()),
      static_cast<unsigned>(date.day()), static_cast<int>(time.hours().count()),
      static_cast<int>(time.minutes().count()), static_cast<int>(time.seconds().count()),
      static_cast<int>(time.subseconds().count()));
  return {text.data(), static_cast<std::size_t>(length)};
}

std::int64_t to_unix_ns(const ClockStamp& clock, std::int64_t monotonic_ns) {
  using Limits = std::numeric_limits<std::int64_t>;
  std::int64_t since = 0, sum = 0;
  if (__builtin_sub_overflow(monotonic_ns, clock.monotonic_ns, &since)) {
    return monotonic_ns < 0 ? Limits::min() : Limits::max();
  }
  if (__builtin_add_overflow(clock.utc_ns, since, &sum)) {
    return since < 0 ? Limits::min() : Limits::max();
  }
  return sum;
}

}  // namespace palpate
