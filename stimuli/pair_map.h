#pragma once
// A hash table from pairs of indices to an index, in two flat arrays: a mesh of a million triangles
// has two million edges, and a node for each would cost more than the rest of its construction.

#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace palpate::stimuli {

/// Open addressing with linear probing; keys are unordered pairs. Grows by itself.
class PairMap {
 public:
  static constexpr std::uint32_t kNone = 0xffffffff;

  /// `expected`: how many pairs will be kept (a guess; it only saves time).
  explicit PairMap(std::size_t expected) { resize(std::bit_ceil(2 * expected + 16)); }

  /// The value kept for {a, b}, a new one being kNone. a and b must not both be kNone.
  std::uint32_t& operator()(std::uint32_t a, std::uint32_t b) {
    if (2 * count_ >= slots_.size()) grow();
    Slot& slot = find(key_of(a, b));
    if (slot.key == kEmpty) {
      slot.key = key_of(a, b);
      ++count_;
    }
    return slot.value;
  }

 private:
  static constexpr std::uint64_t kEmpty = ~std::uint64_t{0};
  struct Slot {
    std::uint64_t key = kEmpty;
    std::uint32_t value = kNone;
  };

  static std::uint64_t key_of(std::uint32_t a, std::uint32_t b) {
    const std::uint64_t low = a < b ? a : b, high = a < b ? b : a;
    return high << 32U | low;
  }

  Slot& find(std::uint64_t key) {
    std::uint64_t hash = (key ^ key >> 32U) * 0x9e3779b97f4a7c15U;
    hash = (hash ^ hash >> 29U) * 0xbf58476d1ce4e5b9U;
    std::size_t at = hash >> shift_;
    while (slots_[at].key != key && slots_[at].key != kEmpty) {
      at = at + 1 == slots_.size() ? 0 : at + 1;
    }
    return slots_[at];
  }

  void resize(std::size_t size) {
    slots_.assign(size, Slot{});
    shift_ = 64U - static_cast<unsigned>(std::countr_zero(size));
  }

  void grow() {
    std::vector<Slot> old(std::move(slots_));
    resize(2 * old.size());
    for (const Slot& slot : old) {
      if (slot.key != kEmpty) find(slot.key) = slot;
    }
  }

  std::vector<Slot> slots_;
  std::size_t count_ = 0;
  unsigned shift_ = 0;
};

}  // namespace palpate::stimuli
