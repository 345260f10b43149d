#pragma once
// A std::vector that uses huge pages where it is large: a walk over a mesh of many megabytes
// otherwise has a TLB miss at almost every step.

#include <sys/mman.h>

#include <cstddef>
#include <new>
#include <vector>

namespace palpate::stimuli {

/// Below the size of one huge page it allocates as usual. It only advises the kernel (madvise):
/// without huge pages nothing but speed is lost.
template <class T>
struct LargePageAllocator {
  using value_type = T;
  LargePageAllocator() = default;
  template <class U>
  LargePageAllocator(const LargePageAllocator<U>&) {}

  T* allocate(std::size_t count) {
    const std::size_t bytes = count * sizeof(T);
    void* const memory = ::operator new(bytes, alignment(bytes));
    if (large(bytes)) madvise(memory, bytes, MADV_HUGEPAGE);
    return static_cast<T*>(memory);
  }
  void deallocate(T* memory, std::size_t count) noexcept {
    ::operator delete(memory, alignment(count * sizeof(T)));
  }
  friend bool operator==(const LargePageAllocator&, const LargePageAllocator&) { return true; }

 private:
  static constexpr std::size_t kPage = std::size_t{1} << 21;  // bytes
  static bool large(std::size_t bytes) { return bytes >= kPage; }
  static std::align_val_t alignment(std::size_t bytes) {
    return std::align_val_t{large(bytes) ? kPage : alignof(T)};
  }
};

template <class T>
using LargeArray = std::vector<T, LargePageAllocator<T>>;

}  // namespace palpate::stimuli
