#include "runner/sweep/design.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <utility>

#include "data/base/random.h"
#include "data/base/sobol.h"

namespace palpate::runner::sweep {
namespace {

// The purposes of streams of the sweep's seed.
// Sobol's shift has 3 (data/base/sobol.cpp).
enum Use : std::uint64_t { kPermutation = 1, kPlaceWithin = 2 };

/// As even as `wanted` allows, the first parameters first; choices have one for each value.
std::vector<std::int64_t> grid_levels(const std::vector<protocols::SweepParameter>& parameters,
                                      std::int64_t wanted) {
  std::vector<std::int64_t> levels;
  std::int64_t size = 1;
  for (const protocols::SweepParameter& one : parameters) {
    const bool choice = one.distribution == protocols::DistributionKind::choice;
    levels.push_back(choice ? static_cast<std::int64_t>(one.values.size()) : 1);
    if (levels.back() > wanted / size) {
      throw std::invalid_argument("a grid with every value of the choices has more points than " +
                                  std::to_string(wanted));
    }
    size *= levels.back();
  }
  for (bool more = true; more;) {
    more = false;
    for (std::size_t i = 0; i < levels.size(); ++i) {
      if (parameters[i].distribution == protocols::DistributionKind::choice) continue;
      if (levels[i] + 1 > wanted / (size / levels[i])) continue;
      size = size / levels[i] * (levels[i] + 1);
      ++levels[i];
      more = true;
    }
  }
  return levels;
}

}  // namespace

const char* to_string(DesignKind kind) {
  switch (kind) {
    case DesignKind::lhs:
      return "lhs";
    case DesignKind::sobol:
      return "sobol";
    case DesignKind::grid:
      return "grid";
    case DesignKind::saltelli:
      return "saltelli";
  }
  return "";
}

DesignKind design_kind(const std::string& name) {
  for (const DesignKind kind :
       {DesignKind::lhs, DesignKind::sobol, DesignKind::grid, DesignKind::saltelli}) {
    if (name == to_string(kind)) return kind;
  }
  throw std::invalid_argument("no design '" + name + "'; there are: lhs, sobol, grid, saltelli");
}

Design::Design(DesignKind kind, std::int64_t wanted, std::uint64_t seed,
               const std::vector<protocols::SweepParameter>& parameters)
    : kind_(kind), seed_(seed), dimensions_(parameters.size()), size_(wanted) {
  if (wanted < 1) throw std::invalid_argument("a sweep has at least one point");
  for (const protocols::SweepParameter& one : parameters)
    choice_.push_back(one.distribution == protocols::DistributionKind::choice);
  if (kind == DesignKind::grid) {
    levels_ = grid_levels(parameters, wanted);
    size_ = 1;
    for (const std::int64_t levels : levels_) size_ *= levels;
  }
  if (kind == DesignKind::saltelli) {
    const auto each = static_cast<std::int64_t>(dimensions_) + 2;
    size_ = wanted / each * each;
    if (size_ == 0) {
      throw std::invalid_argument(
          "saltelli takes " + std::to_string(each) + " points for each base point with " +
          std::to_string(dimensions_) + " parameters, more than " + std::to_string(wanted));
    }
  }
}

std::vector<double> Design::at(std::int64_t point) const {
  if (point < 1 || point > size_) throw std::out_of_range("a design has no such point");
  const auto index = static_cast<std::uint64_t>(point - 1);
  std::vector<double> out;
  switch (kind_) {
    case DesignKind::lhs:
      for (std::size_t d = 0; d < dimensions_; ++d) {
        const auto count = static_cast<std::uint64_t>(size_);
        const std::uint64_t key = Random(seed_, {kPermutation, d}).next();
        const double within = Random(seed_, {kPlaceWithin, d, index}).unit();
        const auto part = static_cast<double>(permuted(index, count, key));
        out.push_back((part + within) / static_cast<double>(count));
      }
      break;
    case DesignKind::sobol:
      return shifted_sobol(index, dimensions_, seed_);
    case DesignKind::grid: {
      std::uint64_t rest = index;
      for (std::size_t d = 0; d < dimensions_; ++d) {
        const auto levels = static_cast<std::uint64_t>(levels_[d]);
        const auto level = static_cast<double>(rest % levels), count = static_cast<double>(levels);
        rest /= levels;
        out.push_back(choice_[d] || levels == 1 ? (level + 0.5) / count : level / (count - 1));
      }
      break;
    }
    case DesignKind::saltelli: {
      const std::uint64_t each = dimensions_ + 2, role = index % each;
      const std::vector<double> both = shifted_sobol(index / each, 2 * dimensions_, seed_);
      for (std::size_t d = 0; d < dimensions_; ++d) {
        const bool from_b = role == 1 || role == 2 + d;
        out.push_back(both[from_b ? dimensions_ + d : d]);
      }
      break;
    }
  }
  return out;
}

std::uint64_t permuted(std::uint64_t value, std::uint64_t count, std::uint64_t key) {
  if (count < 2) return 0;
  const auto bits = static_cast<unsigned>(std::bit_width(count - 1));
  const unsigned low_bits = bits / 2 + bits % 2, high_bits = bits - bits / 2 - bits % 2;
  do {
    std::uint64_t low = value & ((std::uint64_t{1} << low_bits) - 1), high = value >> low_bits;
    unsigned l = low_bits, h = high_bits;
    for (std::uint64_t round = 0; round < 8; ++round) {
      const std::uint64_t mixed = Random(key, {round, low}).next();
      const std::uint64_t next = (high ^ mixed) & ((std::uint64_t{1} << h) - 1);
      high = low;
      low = next;
      std::swap(l, h);
    }
    value = (high << low_bits) | low;  // eight rounds: the widths are where they were
  } while (value >= count);
  return value;
}

}  // namespace palpate::runner::sweep
