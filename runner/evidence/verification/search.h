#pragma once
// Randomised search for wrong ticks: random convex solids of all sizes, random paths, every tick
// compared with the brute-force reference. For checks, not for the servo. Deterministic: walk w of
// seed s is the same on every machine and in every thread.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "rendering/renderer.h"
#include "rendering/scene.h"

namespace palpate::runner::evidence {

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

}  // namespace palpate::runner::evidence
