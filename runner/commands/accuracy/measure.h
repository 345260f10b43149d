#pragma once
// What `palpate accuracy` measures. Shows its progress on a terminal.

#include <cstdint>

#include "runner/commands/accuracy/report.h"

namespace palpate::runner {

/// The randomised search, at least `ticks` ticks; the walks are distributed among threads, the sums
/// do not depend on how.
rendering::SearchCounts search_in_threads(std::uint64_t ticks, std::uint64_t seed, int jobs);

/// The same over unions of convex parts and tools.
rendering::UnionCounts search_unions_in_threads(std::uint64_t ticks, std::uint64_t seed, int jobs);

/// Fills in everything, by report.settings: errors and run times, first contacts, unions, extreme
/// cases, short searches.
/// \param quick  without the extreme case whose mesh takes seconds to build
/// \param seed   of the searches
void measure_accuracy(AccuracyReport& report, bool quick, int jobs, std::uint64_t seed);

}  // namespace palpate::runner
