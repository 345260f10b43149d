#pragma once
// What each shape needs, in one place. A function that tells shapes apart otherwise is a switch
// without `default:`, so that the compiler (-Wswitch) names every one that does not know a new
// shape. README.md: how to add one.

#include <array>
#include <cstddef>
#include <stdexcept>

#include "stimuli/object_spec.h"

namespace palpate::stimuli {

struct ShapeNeeds {
  const char* name;                                   ///< in files
  bool radius = false, height = false, edge = false;  ///< lengths that it has
  bool subdivisions = false, segments = false;        ///< how finely it is tessellated
  /// Its surface is known exactly: signed distance, ways out, the accuracy study and simulated
  /// participants know it.
  bool analytic = false;
};

constexpr ShapeNeeds needs_of(ShapeKind shape) {
  switch (shape) {
    case ShapeKind::sphere:
      return {.name = "sphere", .radius = true, .subdivisions = true, .analytic = true};
    case ShapeKind::cone:
      return {.name = "cone", .radius = true, .height = true, .segments = true, .analytic = true};
    case ShapeKind::cylinder:
      return {
          .name = "cylinder", .radius = true, .height = true, .segments = true, .analytic = true};
    case ShapeKind::cube:
      return {.name = "cube", .edge = true, .analytic = true};
    case ShapeKind::mesh:
      return {.name = "mesh"};
    case ShapeKind::compound:
      return {.name = "compound"};
  }
  throw std::invalid_argument("no such shape");
}

/// All shapes, in order of declaration; `compound` is the last one.
inline constexpr auto kShapes = [] {
  std::array<ShapeKind, static_cast<std::size_t>(ShapeKind::compound) + 1> all{};
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<ShapeKind>(i);
  return all;
}();

}  // namespace palpate::stimuli
