#pragma once
// Randomised search for wrong ticks of contact with unions of convex parts: random clusters, tools
// of one to three segments, slow and fast hands; every tick held against the definition of an ideal
// tool and against the oracle (union_oracle.h). For checks, not for the servo. Deterministic: walk
// w of seed s is the same on every machine and in every thread.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "rendering/renderer.h"
#include "rendering/scene.h"
#include "rendering/verification/search.h"
#include "rendering/verification/union_cases.h"

namespace palpate::rendering {

// Walks of a tool about an object of several convex parts, for searches and fuzzing.

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

/// What a search covered, and what it found wrong.
struct UnionCounts {
  std::uint64_t walks = 0, ticks = 0;
  std::uint64_t in_contact = 0;  ///< ticks with force
  std::uint64_t several = 0;     ///< of those: at two contact places or more

  // Wrong ticks; all of these must be 0.
  std::uint64_t inside = 0;  ///< ideal tool inside a part by more than 1e-12 of the size
  /// The displacement is no sum of non-negative multiples of the normals of facets that are
  /// touched, by more than 1e-9 of the size; nor does a gap hold it (UnionCounts::in_gap).
  std::uint64_t not_minimal = 0;
  /// Force is not stiffness times displacement, or the two devices' forces are not the force, by
  /// more than 1e-9 of it.
  std::uint64_t wrong_force = 0;
  /// Torque is not that of the shares at their places, where these are determined (no segment
  /// within 2 degrees of a facet that it touches, one way to split the force), by more than 1e-6 of
  /// force times size.
  std::uint64_t wrong_torque = 0;
  std::uint64_t off_place = 0;  ///< deepest contact not on its segment, or not on the object
  std::uint64_t not_finite = 0;
  std::uint64_t faulted = 0;  ///< fault bits other than those counted below

  // Not wrong, but counted.
  std::uint64_t lagged = 0;    ///< the ideal tool's orientation is not the virtual one's
  std::uint64_t capped = 0;    ///< contact-capped: it stayed where it was
  std::uint64_t released = 0;  ///< released from a hook
  /// Balanced on an edge exactly, from where it could slide down along its other facet. Paths on a
  /// grid lead there, and bends of a tool that touch with both segments.
  std::uint64_t on_edge = 0;
  /// Held by facets that are not touched, but within two skins (some 1e-9 of the size), which the
  /// ideal tool keeps from what it rests on: a gap that is narrower may be open or closed to it. Or
  /// clamped in a groove so narrow that each side holds more than 1e5 times what pushes it in.
  std::uint64_t in_gap = 0;
  std::uint64_t torques = 0;   ///< torques that were compared
  std::uint64_t compared = 0;  ///< contact ticks repeated by the oracle from the same last pose
  /// Of those: elsewhere by more than 1e-9 of the size. Both are ideal tools by definition.
  std::uint64_t elsewhere = 0;
  double worst_penetration = 0;  ///< sizes of the largest part
  double worst_descent = 0;      ///< sizes; of those at a minimum, as all must be

  std::vector<SearchFault> faults;  ///< the first ones, at most SearchCounts::kFaultsKept

  std::uint64_t wrong() const {
    return inside + not_minimal + wrong_force + wrong_torque + off_place + not_finite + faulted;
  }
  /// Adds another's. Summed in the order of walks, the result does not depend on threads.
  UnionCounts& operator+=(const UnionCounts& other);
};

/// One walk by one renderer with side contact. `seed` and `walk` name it in faults.
UnionCounts search_union(const Renderer& renderer, UnionWalk drawn, std::uint64_t seed = 0,
                         std::uint64_t walk = 0);
/// A random one, of kTicksPerWalk ticks.
UnionCounts search_union(const Renderer& renderer, std::uint64_t seed, std::uint64_t walk);
/// Walks first_walk, first_walk + 1, ... by the ray renderer: distribute them among threads in any
/// way.
UnionCounts search_unions(std::uint64_t seed, std::uint64_t first_walk, std::uint64_t walks);

}  // namespace palpate::rendering
