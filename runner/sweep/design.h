#pragma once
// Where in the unit cube the points of a sweep lie. A point follows from the design, the seed and
// its number alone, so that any machine can compute any of them.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "protocols/sweep_space.h"

namespace palpate::runner::sweep {

enum class DesignKind {
  lhs,  ///< Latin hypercube (McKay, Beckman & Conover 1979): of every parameter, one point in each
        ///< of as many equally likely parts as there are points
  sobol,  ///< Sobol's sequence with a digital shift from the seed
  grid,  ///< all combinations of equally spaced shares, both ends included; every value of a choice
  /// Sobol's sequence in twice the dimensions, halves A and B (Saltelli et al. 2010): for each of
  /// the base points A, B, and A with parameter i of B for each i, one after the other
  saltelli,
};
const char* to_string(DesignKind kind);
/// \throws std::invalid_argument naming those that there are
DesignKind design_kind(const std::string& name);

class Design {
 public:
  /// \param wanted  points at most; grid and saltelli round down to a possible number.
  /// \throws std::invalid_argument if that is 0
  Design(DesignKind kind, std::int64_t wanted, std::uint64_t seed,
         const std::vector<protocols::SweepParameter>& parameters);

  std::int64_t size() const { return size_; }
  /// \param point  from 1 to size(). \return a share in [0, 1] for each parameter
  std::vector<double> at(std::int64_t point) const;

 private:
  DesignKind kind_;
  std::uint64_t seed_;
  std::size_t dimensions_;
  std::int64_t size_;
  std::vector<std::int64_t> levels_;  ///< of a grid
  std::vector<bool> choice_;
};

/// The image of `value` under a permutation of 0 .. count - 1 that `key` selects: a Feistel
/// network, walked until it is back in the range (Black & Rogaway 2002). No table of `count`
/// entries.
std::uint64_t permuted(std::uint64_t value, std::uint64_t count, std::uint64_t key);

}  // namespace palpate::runner::sweep
