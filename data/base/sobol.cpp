#include "data/base/sobol.h"

#include <boost/random/sobol.hpp>
#include <stdexcept>
#include <string>

#include "data/base/random.h"

namespace palpate {
namespace {

constexpr std::uint64_t kShift = 3;  ///< stream of a seed, part of its meaning

double share_of_digits(std::uint64_t digits) {
  return static_cast<double>(digits >> 11U) * 0x1p-53;  // the last digits that a double keeps
}

}  // namespace

std::vector<std::uint64_t> sobol_digits(std::uint64_t index, std::size_t dimensions) {
  if (dimensions < 1 || dimensions > kMostSobolDimensions) {
    throw std::invalid_argument("Sobol's sequence has 1 to " +
                                std::to_string(kMostSobolDimensions) + " dimensions here, not " +
                                std::to_string(dimensions));
  }
  std::vector<std::uint64_t> out(dimensions, 0);
  if (index == 0) return out;  // Boost leaves the origin out
  boost::random::sobol engine(dimensions);
  engine.seed(index - 1);
  for (std::uint64_t& digits : out) digits = engine();
  return out;
}

std::vector<double> shifted_sobol(std::uint64_t index, std::size_t dimensions, std::uint64_t seed) {
  std::vector<double> out;
  const std::vector<std::uint64_t> digits = sobol_digits(index, dimensions);
  for (std::size_t d = 0; d < dimensions; ++d) {
    const std::uint64_t shift = Random(seed, {kShift, d}).next();
    out.push_back(share_of_digits(digits[d] ^ shift));
  }
  return out;
}

}  // namespace palpate
