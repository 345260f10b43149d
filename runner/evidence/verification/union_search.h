#pragma once
// Randomised search for wrong ticks of contact with unions of convex parts: random clusters, tools
// of one to three segments, slow and fast hands. Every tick is compared with the definition of an
// ideal tool and with the oracle (union_cases.h). For checks, not for the servo. Deterministic:
// walk w of seed s is the same on every machine and in every thread.

#include <cstdint>
#include <vector>

#include "rendering/renderer.h"
#include "runner/evidence/verification/search.h"
#include "runner/evidence/verification/union_walks.h"

namespace palpate::runner::evidence {

/// The coverage of a search and the errors that it found.
struct UnionCounts {
  std::uint64_t walks = 0, ticks = 0;
  std::uint64_t in_contact = 0;  ///< ticks with force
  std::uint64_t several = 0;     ///< those of them with two or more contact places

  // Wrong ticks: all of these must be 0.
  std::uint64_t inside = 0;  ///< ideal tool inside a part by more than 1e-12 of the size
  /// The displacement differs by more than 1e-9 of the size from every non-negative sum of the
  /// normals of touched facets, and no gap holds the tool (UnionCounts::in_gap).
  std::uint64_t not_minimal = 0;
  /// Force is not stiffness times displacement, or the two devices' forces are not the force, by
  /// more than 1e-9 of it.
  std::uint64_t wrong_force = 0;
  /// Torque differs by more than 1e-6 of force times size from that of the shares at their places.
  /// Counted where these are determined: no segment is within 2 degrees of a facet that it touches,
  /// and the force splits in one way only.
  std::uint64_t wrong_torque = 0;
  std::uint64_t off_place = 0;  ///< deepest contact not on its segment, or not on the object
  std::uint64_t not_finite = 0;
  std::uint64_t faulted = 0;  ///< fault bits other than those counted below

  // Not wrong, but counted.
  std::uint64_t lagged = 0;    ///< the ideal tool's orientation is not the virtual one's
  std::uint64_t capped = 0;    ///< contact-capped: the ideal tool stayed in place
  std::uint64_t released = 0;  ///< released from a hook
  /// Balanced exactly on an edge from which it could slide down along the other facet. Happens on
  /// paths along a grid, and at bends of a tool that touch with both segments.
  std::uint64_t on_edge = 0;
  /// Held by facets that it does not touch, but that are within two skins (some 1e-9 of the size):
  /// a gap narrower than that may be open or closed to the ideal tool. Or clamped in a groove so
  /// narrow that each side bears more than 1e5 times the push.
  std::uint64_t in_gap = 0;
  std::uint64_t torques = 0;   ///< torques compared
  std::uint64_t compared = 0;  ///< contact ticks repeated by the oracle from the same last pose
  /// Those of them with a place that differs by more than 1e-9 of the size. Both are ideal tools by
  /// definition.
  std::uint64_t elsewhere = 0;
  double worst_penetration = 0;  ///< sizes of the largest part
  double worst_descent = 0;      ///< sizes; of tools at a minimum, as all must be

  std::vector<SearchFault> faults;  ///< the first, at most SearchCounts::kFaultsKept

  std::uint64_t wrong() const {
    return inside + not_minimal + wrong_force + wrong_torque + off_place + not_finite + faulted;
  }
  /// Adds the other's counts. Summed in the order of walks, the result does not depend on threads.
  UnionCounts& operator+=(const UnionCounts& other);
};

/// One walk by one renderer with side contact. `seed` and `walk` name it in faults.
UnionCounts search_union(const rendering::Renderer& renderer, UnionWalk drawn,
                         std::uint64_t seed = 0, std::uint64_t walk = 0);
/// A random walk of kTicksPerWalk ticks.
UnionCounts search_union(const rendering::Renderer& renderer, std::uint64_t seed,
                         std::uint64_t walk);
/// Walks first_walk, first_walk + 1, ... by the ray renderer: distribute them among threads in any
/// way.
UnionCounts search_unions(std::uint64_t seed, std::uint64_t first_walk, std::uint64_t walks);

}  // namespace palpate::runner::evidence
