#pragma once

#include <cstddef>
#include <cstdint>

#include "stimuli/random.h"

namespace palpate::protocols {

/// Of a track among several that are mixed. \param seed  of InterleavedTracks
inline std::uint64_t track_seed(std::uint64_t seed, std::size_t track) {
  return stimuli::Random(seed, {0x17, track}).next();
}

}  // namespace palpate::protocols
