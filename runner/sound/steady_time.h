#pragma once

#include <chrono>
#include <cstdint>

namespace palpate::runner::sound {

/// ns, of the clock that never jumps.
inline std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

}  // namespace palpate::runner::sound
