#pragma once
// The parameters of each shape, in one table. Every other function that distinguishes shapes is a
// switch without `default:`, so that the compiler (-Wswitch) reports those that lack a new shape.
// How to add one: README.md.

#include <array>
#include <cstddef>
#include <stdexcept>

#include "stimuli/object_spec.h"

namespace palpate::stimuli {

struct ShapeTraits {
  const char* name;                                   ///< in files
  bool radius = false, height = false, edge = false;  ///< lengths that it has
  bool size = false;                                  ///< three of them
  bool subdivisions = false, segments = false;        ///< how finely it is tessellated
  /// Its surface is known exactly: it has a signed distance and local penetration depths, and the
  /// accuracy study uses it.
  bool analytic = false;
  /// Simulated participants imagine it by a formula (runner/participants/shape_lines.h); others by
  /// distances on a grid.
  bool formula = false;
};

constexpr ShapeTraits traits_of(ShapeKind shape) {
  switch (shape) {
    case ShapeKind::sphere:
      return {.name = "sphere",
              .radius = true,
              .subdivisions = true,
              .analytic = true,
              .formula = true};
    case ShapeKind::cone:
      return {.name = "cone",
              .radius = true,
              .height = true,
              .segments = true,
              .analytic = true,
              .formula = true};
    case ShapeKind::cylinder:
      return {.name = "cylinder",
              .radius = true,
              .height = true,
              .segments = true,
              .analytic = true,
              .formula = true};
    case ShapeKind::cube:
      return {.name = "cube", .edge = true, .analytic = true, .formula = true};
    case ShapeKind::box:
      return {.name = "box", .size = true, .analytic = true};
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
