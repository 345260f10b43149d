#pragma once
// Own generator, shuffle and distributions: std::shuffle and the std distributions differ between
// standard libraries, but a schedule must be the same on every machine.

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <utility>
#include <vector>

namespace palpate {

/// xoshiro256++ 1.0 (Blackman & Vigna 2019), seeded through splitmix64.
/// Same seed and stream, same numbers, on every compiler. Not for cryptography.
class Random {
 public:
  /// `stream` separates uses of one seed (e.g. {participant, trial}); every element counts.
  explicit Random(std::uint64_t seed, std::initializer_list<std::uint64_t> stream = {});

  std::uint64_t next();                      ///< 64 uniform bits.
  std::uint64_t below(std::uint64_t bound);  ///< Uniform in [0, bound), unbiased; bound > 0.
  double unit();                             ///< Uniform in [0, 1), 53 bits.
  /// Standard normal by Marsaglia's polar method. Uses std::log: repeatable on one machine and
  /// build; not used in schedules.
  double normal();

  /// Fisher-Yates.
  template <class T>
  void shuffle(std::vector<T>& items) {
    for (std::size_t i = items.size(); i > 1; --i) {
      using std::swap;
      swap(items[i - 1], items[below(i)]);
    }
  }

 private:
  std::array<std::uint64_t, 4> state_{};
  double spare_normal_ = 0;
  bool has_spare_ = false;
};

}  // namespace palpate
