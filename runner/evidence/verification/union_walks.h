#pragma once
// Walks of a tool around an object of several convex parts, for searches and fuzzing. For checks,
// not for the servo. Deterministic: walk w of seed s is the same on every machine and in every
// thread.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "runner/evidence/verification/union_cases.h"

namespace palpate::runner::evidence {

struct UnionWalk {
  OracleParts parts;
  OracleTool tool;  ///< one segment from the tip along +z: the plain stylus, without a tool
  std::vector<OraclePose> path;
  bool coincident = false;  ///< moves exactly along edges and through corners
};

/// A cluster of 3 to 8 parts, a tool of 1 + walk % 3 segments, 0.1 to 5 m/s; or along the axes,
/// exactly through corners; or on a grid.
UnionWalk random_union_walk(std::uint64_t seed, std::uint64_t walk, std::size_t ticks);

/// Turns any bytes into a walk: boxes and wedges of multiples of 10 mm that share faces, edges and
/// corners, or overlap; a tool of 1 to 3 segments between points of the same grid; motions of the
/// tip along the axes by whole millimetres and turns about them by up to a quarter. Everything that
/// can coincide does.
UnionWalk grid_walk(std::span<const std::uint8_t> bytes, std::size_t most_ticks);

/// Whether a tool is just the stylus.
bool is_plain(const OracleTool& tool);

}  // namespace palpate::runner::evidence
