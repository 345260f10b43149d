#pragma once
// The patches near a tool on a closed surface (surface_contact.h), to be looked through in every
// tick. Local frame, m.

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <glm/geometric.hpp>
#include <vector>

#include "rendering/surface_patch.h"

#if defined(__AVX__)
#include <immintrin.h>
#endif

namespace palpate::rendering {

/// The longest list of patches; where there are more, each motion queries the tree.
inline constexpr std::size_t kMostPatches = 512;

/// Patches and their planes, as many side by side as the processor takes at once. Translations are
/// relative to the tool where it was listed. Has room for kMostPatches, copies too.
class NearPatches {
 public:
  NearPatches() {
    patches_.reserve(kMostPatches);
    planes_.reserve(kMostPatches / kWidth);
  }
  NearPatches(const NearPatches& other) : NearPatches() { *this = other; }
  NearPatches(NearPatches&&) = default;
  NearPatches& operator=(const NearPatches&) = default;
  NearPatches& operator=(NearPatches&&) = default;
  ~NearPatches() = default;
  std::size_t size() const { return patches_.size(); }
  void clear() {
    patches_.clear();
    planes_.clear();
  }
  /// \param plane  for the tool where it was listed; without a normal: not known
  void add(const SurfacePatch& patch, const PatchPlane& plane) {
    const std::size_t k = patches_.size() % kWidth;
    if (k == 0) planes_.emplace_back();
    patches_.push_back(patch);
    Planes& planes = planes_.back();
    for (int axis = 0; axis < 3; ++axis)
      planes.normal[static_cast<std::size_t>(axis)][k] = plane.normal[axis];
    planes.depth[k] = plane.depth;
  }

  /// Calls visit(patch) for the patches whose plane a straight way may enter, and for those whose
  /// plane is not known. \param from, to  m, translations of the tool \param error  m, of the
  /// planes \param first  the earliest hit so far, which `visit` may change; planes that the way
  /// enters later are mostly left out
  template <class Visit>
  void for_each_entered(const Vec3& from, const Vec3& to, double error, const PatchHit& first,
                        const Visit& visit) const {
    for (std::size_t block = 0; block < planes_.size(); ++block) {
      unsigned bits = planes_[block].entered(from, to, error, first.time);
      const std::size_t begin = block * kWidth, count = std::min(patches_.size() - begin, kWidth);
      bits &= (1U << count) - 1;
      for (; bits != 0; bits &= bits - 1)
        visit(patches_[begin + static_cast<std::size_t>(std::countr_zero(bits))]);
    }
  }

 private:
  static constexpr std::size_t kWidth = 4;
#if defined(__AVX__)
  using Lanes = double __attribute__((vector_size(sizeof(double) * kWidth)));
#else
  using Lanes = std::array<double, kWidth>;
#endif
  struct Planes {
    std::array<Lanes, 3> normal{};
    Lanes depth{};

    /// A bit for each plane that may be entered.
    unsigned entered(const Vec3& from, const Vec3& to, double error, double time) const {
#if defined(__AVX__)
      const Lanes above = height(from), under = -height(to);
      return static_cast<unsigned>(_mm256_movemask_pd(
          reinterpret_cast<__m256d>((above >= -error) & (under >= -error) &
                                    (above - error <= time * (above + under + 2 * error)))));
#else  // narrower vectors are slower than one plane after the other
      unsigned bits = 0;
      for (std::size_t k = 0; k < kWidth; ++k) {
        const Vec3 n(normal[0][k], normal[1][k], normal[2][k]);
        const double above = glm::dot(n, from) - depth[k], under = depth[k] - glm::dot(n, to);
        if (under < -error || above < -error) continue;
        if (above - error <= time * (above + under + 2 * error)) bits |= 1U << k;
      }
      return bits;
#endif
    }
#if defined(__AVX__)
    Lanes height(const Vec3& at) const {
      return normal[0] * at.x + normal[1] * at.y + normal[2] * at.z - depth;
    }
#endif
  };

  std::vector<SurfacePatch> patches_;
  std::vector<Planes> planes_;
};

}  // namespace palpate::rendering
