#include "runner/sweep/sobol_sequence.h"

#include <boost/random/sobol.hpp>
#include <stdexcept>
#include <string>

namespace palpate::runner {

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

}  // namespace palpate::runner
