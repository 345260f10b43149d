#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace palpate::runner {

constexpr std::size_t kMostSobolDimensions = 3667;

/// Point `index` (from 0: the origin) of Sobol's sequence in [0, 1)^dimensions, as 64 binary digits
/// each, in the order of Antonov & Saleev (1979) with the direction numbers new-joe-kuo-6.21201
/// (Joe & Kuo 2008), which Boost.Random brings. \throws std::invalid_argument: no dimension, or
/// more than kMostSobolDimensions
std::vector<std::uint64_t> sobol_digits(std::uint64_t index, std::size_t dimensions);

}  // namespace palpate::runner
