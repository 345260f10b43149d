#pragma once
// Counts heap allocations, to show that a tick does not allocate.

#include <cstdint>

namespace palpate::runner::bench {

/// Heap allocations of this thread so far, counted by a replaced operator new. Always 0 under
/// sanitizers, which have their own operator new.
std::uint64_t allocations();

/// Whether allocations() counts.
bool counts_allocations();

}  // namespace palpate::runner::bench
