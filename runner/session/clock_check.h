#pragma once
// Is the computer's clock to be believed? Every date on record follows it.

#include <cstdint>
#include <optional>
#include <string>

namespace palpate::runner {

/// ns since 1970, UTC.
struct ClockEvidence {
  std::int64_t now_ns = 0;
  std::optional<std::int64_t> newest_record_ns;  ///< of the study
  std::optional<std::int64_t> newest_file_ns;    ///< when the protocol or the program was written
};

/// What speaks against the clock, in words; empty: nothing.
std::string clock_doubt(const ClockEvidence& evidence);

}  // namespace palpate::runner
