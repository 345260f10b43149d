#pragma once
// UTC time stamps of exports and messages, and the session clock converted to UTC.

#include <cstdint>
#include <string>

#include "data/record.h"

namespace palpate::data {

/// "2024-05-01T09:30:00.123456Z": ISO 8601 in UTC, cut (not rounded) to microseconds.
/// \param unix_ns since 1970-01-01T00:00:00Z; any value, also before.
std::string format_utc(std::int64_t unix_ns);

/// Converts a time of the session clock to ns since 1970. Saturates at the range of 64 bits: the
/// values may come from a damaged file.
std::int64_t to_unix_ns(const ClockStamp& clock, std::int64_t monotonic_ns);

}  // namespace palpate::data
