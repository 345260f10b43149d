#pragma once
// Sobol's sequence: points that fill a cube evenly, however many of them there are.

#include <cstddef>
#include <cstdint>
#include <vector>

namespace palpate {

constexpr std::size_t kMostSobolDimensions = 3667;

/// Point `index` (from 0: the origin) of Sobol's sequence in [0, 1)^dimensions, as 64 binary digits
/// each, in the order of Antonov & Saleev (1979) with the direction numbers new-joe-kuo-6.21201
/// (Joe & Kuo 2008), which Boost.Random brings. \throws std::invalid_argument: no dimension, or
/// more than kMostSobolDimensions
std::vector<std::uint64_t> sobol_digits(std::uint64_t index, std::size_t dimensions);

/// The point after a digital shift from the seed, in [0, 1)^dimensions.
std::vector<double> shifted_sobol(std::uint64_t index, std::size_t dimensions, std::uint64_t seed);

}  // namespace palpate
