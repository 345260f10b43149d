#pragma once
// Plausibility of the computer's clock, which every date on record follows.

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

/// Why the clock seems wrong, in words; empty: it does not.
std::string clock_warning(const ClockEvidence& evidence);

}  // namespace palpate::runner
