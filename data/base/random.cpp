#include "data/base/random.h"

#include <bit>
#include <cmath>
#include <stdexcept>

namespace palpate {
namespace {

// Steele, Lea & Flood 2014, "Fast splittable pseudorandom number generators"; constants of
// Vigna's splitmix64. Advances `state` and returns the next output.
std::uint64_t splitmix64(std::uint64_t& state) {
  state += 0x9e3779b97f4a7c15U;
  std::uint64_t z = state;
  z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9U;
  z = (z ^ (z >> 27U)) * 0x94d049bb133111ebU;
  return z ^ (z >> 31U);
}

}  // namespace

Random::Random(std::uint64_t seed, std::initializer_list<std::uint64_t> stream) {
  // Hash before mixing in each element, so that its position matters and (seed, element) differs
  // from (seed ^ element, 0). Without a stream this is the usual seeding of xoshiro256++.
  for (const std::uint64_t element : stream) seed = splitmix64(seed) ^ element;
  if (stream.size() > 0) seed = splitmix64(seed) ^ stream.size();
  for (std::uint64_t& word : state_) word = splitmix64(seed);
}

std::uint64_t Random::next() {
  const std::uint64_t result = std::rotl(state_[0] + state_[3], 23) + state_[0];
  const std::uint64_t shifted = state_[1] << 17U;
  state_[2] ^= state_[0];
  state_[3] ^= state_[1];
  state_[1] ^= state_[2];
  state_[0] ^= state_[3];
  state_[2] ^= shifted;
  state_[3] = std::rotl(state_[3], 45);
  return result;
}

std::uint64_t Random::below(std::uint64_t bound) {
  if (bound == 0) throw std::invalid_argument("Random::below: the bound must be above 0");
  // Reject the lowest 2^64 mod bound outputs, so that every remainder is equally frequent.
  const std::uint64_t refused = (0 - bound) % bound;
  std::uint64_t bits = next();
  while (bits < refused) bits = next();
  return bits % bound;
}

double Random::unit() { return static_cast<double>(next() >> 11U) * 0x1p-53; }

double Random::normal() {
  if (has_spare_) {
    has_spare_ = false;
    return spare_normal_;
  }
  // Marsaglia & Bray 1964: a point of the unit disc gives two independent normals.
  double x = 0, y = 0, s = 0;
  do {
    x = 2 * unit() - 1;
    y = 2 * unit() - 1;
    s = x * x + y * y;
  } while (s >= 1 || s == 0);
  const double scale = std::sqrt(-2 * std::log(s) / s);
  spare_normal_ = y * scale;
  has_spare_ = true;
  return x * scale;
}

}  // namespace palpate
