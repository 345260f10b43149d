#include "data/files/utc.h"

#include <array>
#include <chrono>
#include <limits>

namespace palpate::data {

std::string format_utc(std::int64_t unix_ns) {
  using namespace std::chrono;
  const sys_time<nanoseconds> instant{nanoseconds{unix_ns}};
  const auto cut = floor<microseconds>(instant);
  const auto day = floor<days>(cut);
  const year_month_day date{day};
  const hh_mm_ss<microseconds> time{cut - day};
  std::array<char, 40> text{};
  char* at = text.data();
  const auto put = [&at](std::int64_t value, int digits, char after) {
    for (int i = digits - 1; i >= 0; --i, value /= 10) at[i] = static_cast<char>('0' + value % 10);
    at[digits] = after;
    at += digits + 1;
  };
  put(static_cast<int>(date.year()), 4, '-');  // 1677 to 2262: the range of 64 bits of nanoseconds
  put(static_cast<unsigned>(date.month()), 2, '-');
  put(static_cast<unsigned>(date.day()), 2, 'T');
  put(time.hours().count(), 2, ':');
  put(time.minutes().count(), 2, ':');
  put(time.seconds().count(), 2, '.');
  put(time.subseconds().count(), 6, 'Z');
  return {text.data(), at};
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

}  // namespace palpate::data
