#pragma once
// Measures the run time of a renderer's tick on this machine.

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace palpate::runner::evidence {

inline constexpr int kTickRounds = 5;

/// One row: a scene, a renderer and a state of contact. Every tick is timed separately, in
/// kTickRounds rounds of the same path; all values include `empty_loop_ns`, the cost of reading the
/// time.
struct TickCost {
  std::string mesh;
  std::size_t triangles = 0;         ///< of one object
  std::string renderer;              ///< point or ray
  std::string state;                 ///< contact, free (1 to 2 mm off the object), first_contact
  bool cold = false;                 ///< before each tick, the near caches forgot the last one
  std::size_t ticks = 0;             ///< ticks timed, all in that state
  double median_ns = 0, p99_ns = 0;  ///< each from the round in which it is lowest
  double p99_highest_ns = 0;         ///< from the round in which it is highest
  double max_ns = 0;                 ///< of all rounds
  std::size_t allocations = 0;       ///< on the heap, in all timed ticks
  double empty_loop_ns = 0;
  double target_ns = 0;  ///< design target for the judged value; 0: none
  bool target_is_p99 = false;
  std::size_t parts = 1, near_parts = 1;  ///< convex parts; near_parts: within the tool's reach
  std::size_t segments = 1;               ///< of the tool
  std::size_t elements = 0;               ///< of a soft body; 0: it is rigid

  double net_ns() const { return median_ns - empty_loop_ns; }
  /// Without the empty tick: the median, or the 99th percentile if the target is for that.
  double judged_ns() const { return (target_is_p99 ? p99_ns : median_ns) - empty_loop_ns; }
};

struct TickCostSettings {
  std::size_t ticks = 200'000;    ///< ticks of a row, in all its rounds
  std::size_t approaches = 1000;  ///< first contacts in a round, each in a new trial
  bool with_million = true;       ///< a mesh of 1,310,720 triangles, which takes seconds to make
};

/// A path at 0.1 m/s over icospheres of 30 mm radius (20 to 327,680 triangles), the paper's other
/// three shapes, one of 1,000 spheres, concave balls (1,280 to 1,310,720 triangles), and
/// objects of ten near spheres with a tool of three segments, and plates with textures, fields and
/// knocks. Penetration depth 1 to 2 mm; the
/// ray's contact moves between the tip and the side. 1,000 ticks precede each row, except for first
/// contacts, which start a new trial 10 mm away, from a random direction. Each row warm, and cold:
/// fewer ticks, and before each the near caches are cleared. \param done  called after each
/// row with the number of rows so far and in total
std::vector<TickCost> measure_tick_costs(const TickCostSettings& settings,
                                         const std::function<void(std::size_t, std::size_t)>& done);

}  // namespace palpate::runner::evidence
