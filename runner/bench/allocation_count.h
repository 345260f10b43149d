#pragma once

#include <cstdint>

namespace palpate::runner {

/// Heap allocations of this thread so far. Counted by a replaced operator new; without it (under
/// sanitizers, which bring their own) always 0.
std::uint64_t allocations();

/// Whether allocations() counts.
bool counts_allocations();

}  // namespace palpate::runner
