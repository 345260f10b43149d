#pragma once
// Randomised search for wrong ticks: random convex solids of all sizes, random paths, every tick
// compared with the brute-force reference. For checks, not for the servo. Deterministic: walk w of
// seed s is the same on every machine and in every thread.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "rendering/renderer.h"
#include "rendering/scene.h"
#include "runner/evidence/verification/union_cases.h"

namespace palpate::runner::evidence {

// Errors of one tick of a renderer over a scene of one convex part, against the brute-force
// reference. For checks, not for the servo.

/// Errors of one tick, each 0 in a correct tick. Lengths in m.
struct TickAudit {
  double depth = 0;       ///< of the virtual probe by the reference; negative: outside
  double missed = 0;      ///< depth of a probe without contact
  double penetrates = 0;  ///< depth of the ideal probe
  double floats = 0;      ///< gap between the ideal probe and the object, in contact
  double shallow = 0;     ///< difference by which a contact is shallower than the reference
  /// Relative error of force, torque and the devices' forces against a spring at the contact. In
  /// free space N and N m.
  double force = 0;
  bool finite = true;  ///< all numbers of the rendering
  /// m, rounding at this size and distance; shorter errors of lengths do not count.
  double tolerance = 0;

  bool good() const {
    return finite && missed <= tolerance && penetrates <= tolerance && floats <= tolerance &&
           shallow <= tolerance && force <= 1e-9;
  }
};

/// \param rounding  fraction of the object's size that counts as rounding. The tolerance also
/// includes rounding due to the distance from the origin and the probe's length.
/// \pre the scene has one part with a plain spring
TickAudit audit_tick(const rendering::Scene& scene, const rendering::Renderer& renderer,
                     const rendering::LineProbe& probe, const rendering::Rendering& rendering,
                     double rounding = 1e-9);

/// Ticks of one walk: one object, one probe, one path.
inline constexpr std::uint64_t kTicksPerWalk = 500;

/// A wrong tick. `palpate accuracy --search` prints it; search_walk(renderer, seed, walk) repeats
/// it.
struct SearchFault {
  std::uint64_t seed = 0, walk = 0, tick = 0;
  std::string what;  ///< renderer, object and error, with numbers
};

/// The coverage of a search and the errors that it found.
struct SearchCounts {
  std::uint64_t walks = 0, ticks = 0;
  std::uint64_t in_contact = 0;  ///< ticks in contact
  std::uint64_t entries = 0;     ///< contacts begun
  /// Ticks from free space repeated in a hundred steps by brute force.
  std::uint64_t walked_finely = 0;
  /// Those of them in which the probe entered through a feature that holds it at all further steps.
  std::uint64_t passages = 0;

  // Wrong ticks: all of these must be 0.
  std::uint64_t missed = 0;  ///< inside by more than 1e-9 of the size, without contact
  /// Passages without contact on the side of entry: a thin plate, passed through.
  std::uint64_t passed_through = 0;
  std::uint64_t phantom = 0;      ///< a contact began where no hundredth of the tick touches
  std::uint64_t penetrating = 0;  ///< ideal probe inside by more than 1e-9 of the size
  std::uint64_t floating = 0;     ///< ideal probe off the surface by more than 1e-9 of size and
                                  ///< probe
  std::uint64_t shallow = 0;      ///< shallower than the penetration depth
  std::uint64_t wrong_force = 0;  ///< force, torque or devices' forces are not those of the contact
  std::uint64_t not_finite = 0;
  std::uint64_t endless = 0;  ///< facet walks that reached their limit of steps
  std::uint64_t faulted = 0;  ///< other fault bits

  /// Not wrong, but counted: entries without a crossing, after which all features were searched.
  std::uint64_t fallbacks = 0;
  /// Not wrong, but counted: passages of a probe that turned by more than 0.1 rad within the tick
  /// (100 rad/s, faster than any hand), held on another side or lost. Such a probe may enter more
  /// than once.
  std::uint64_t turned_elsewhere = 0;
  double worst_penetration = 0;  ///< of the ideal probe, in sizes of the object

  std::vector<SearchFault> faults;  ///< the first, at most kFaultsKept

  static constexpr std::size_t kFaultsKept = 10;
  std::uint64_t wrong() const {
    return missed + passed_through + phantom + penetrating + floating + shallow + wrong_force +
           not_finite + endless + faulted;
  }
  /// Adds the other's counts. Summed in the order of walks, the result does not depend on threads.
  SearchCounts& operator+=(const SearchCounts& other);
};

/// One walk by one renderer.
SearchCounts search_walk(const rendering::Renderer& renderer, std::uint64_t seed,
                         std::uint64_t walk);

/// Walks first_walk, first_walk + 1, ...: every fourth with the point renderer, the others with the
/// ray renderer. Walks are independent: distribute them among threads in any way.
SearchCounts search_walks(std::uint64_t seed, std::uint64_t first_walk, std::uint64_t walks);

// Randomised search for wrong ticks of contact with unions of convex parts: random clusters, tools
// of one to three segments, slow and fast hands. Every tick is compared with the definition of an
// ideal tool and with the oracle (union_cases.h). For checks, not for the servo. Deterministic:
// walk w of seed s is the same on every machine and in every thread.

// Walks of a tool around an object of several convex parts, for searches and fuzzing.

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
