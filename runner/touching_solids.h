#pragma once
// Which fixed objects of a scene touch each other, so that a tool that slides from one to the next
// must be held by one ideal tool.

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "rendering/scene.h"
#include "stimuli/vec.h"

namespace palpate::runner {

/// The surface of an object where it stands. World frame, m.
struct StandingSurface {
  std::vector<std::array<Vec3, 3>> triangles;
  Vec3 low, high;    ///< of their box
  double error = 0;  ///< m, of its corners, as numbers of files and poses are rounded
};

StandingSurface standing(std::span<const stimuli::SurfaceShell> shells);

/// Whether two surfaces meet or cross within their errors. One that lies wholly inside the other
/// does not: it is felt where the tool gets to it.
bool touch(const StandingSurface& a, const StandingSurface& b);

/// The numbers 0 to count - 1 in sets that are connected by touching; each set and the sets are in
/// ascending order.
/// \param touches  of two different numbers, the smaller one first
template <class Touches>
std::vector<std::vector<int>> connected(int count, const Touches& touches) {
  std::vector<int> first(static_cast<std::size_t>(count));  // of its set
  std::vector<std::vector<int>> sets(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    first[static_cast<std::size_t>(i)] = i;
    sets[static_cast<std::size_t>(i)] = {i};
    for (int k = 0; k < i; ++k) {
      const int one = first[static_cast<std::size_t>(k)],
                other = first[static_cast<std::size_t>(i)];
      if (one == other || !touches(k, i)) continue;
      auto &into = sets[static_cast<std::size_t>(std::min(one, other))],
           &from = sets[static_cast<std::size_t>(std::max(one, other))];
      for (const int member : from) first[static_cast<std::size_t>(member)] = std::min(one, other);
      into.insert(into.end(), from.begin(), from.end());
      from.clear();
    }
  }
  std::erase_if(sets, [](const std::vector<int>& set) { return set.empty(); });
  for (std::vector<int>& set : sets) std::sort(set.begin(), set.end());
  return sets;
}

}  // namespace palpate::runner
