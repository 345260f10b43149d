#pragma once
// Walks of a tool about an object of several convex parts, for searches and fuzzing.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "rendering/scene.h"
#include "rendering/verification/union_cases.h"

namespace palpate::rendering {

struct UnionWalk {
  OracleParts parts;
  OracleTool tool;  ///< one segment from the tip along +z: the plain stylus, without a tool
  std::vector<OraclePose> path;
  bool coincident = false;  ///< it goes exactly along edges and through corners
};

/// A cluster of 3 to 8 parts, a tool of 1 + walk % 3 segments, 0.1 to 5 m/s; or along the axes,
/// exactly through corners; or on a grid.
UnionWalk random_union_walk(std::uint64_t seed, std::uint64_t walk, std::size_t ticks);

/// Any bytes are a walk: boxes and wedges of multiples of 10 mm that share faces, edges and
/// corners, or overlap; a tool of 1 to 3 segments between points of the same grid; motions of
/// the tip along the axes by whole millimetres and turns about them by up to a quarter. What can
/// coincide does.
UnionWalk grid_walk(std::span<const std::uint8_t> bytes, std::size_t most_ticks);

/// The scene of a walk: one object of that stiffness.
Scene union_scene(const UnionWalk& walk, double stiffness);
/// The stylus of a walk at a pose; `state` gets the tool's +x as measured.
LineProbe union_probe(const UnionWalk& walk, const OraclePose& pose, RenderState& state);
/// Whether a tool is the stylus alone.
bool is_plain(const OracleTool& tool);

}  // namespace palpate::rendering
