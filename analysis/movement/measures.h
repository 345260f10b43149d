#pragma once
// What the hand did in a trial, as one number for each measure.

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "analysis/movement/contacts.h"
#include "analysis/movement/coverage.h"
#include "stimuli/vec.h"

namespace palpate::analysis {

/// How a measure is averaged and compared over participants.
enum class MeasureScale {
  log,       ///< natural logarithm; a value of 0 is missing
  count,     ///< natural logarithm of the value and 1
  logit,     ///< of a share, held from 0.005 to 0.995
  identity,  ///< as it is
};

struct MeasureDefinition {
  const char* name;
  const char* unit;  ///< "1": none
  MeasureScale scale;
  const char* meaning;
};

inline constexpr std::size_t kMeasures = 38;
/// In the order of the columns of movement.csv.
const std::array<MeasureDefinition, kMeasures>& measure_definitions();
std::size_t measure_named(const char* name);

struct MovementSettings {
  double cutoff = 20;  ///< Hz, of the low pass of the path
};

/// A value a tick, from time zero to the answer; the frame of the object, where it stands or moves.
struct MovementTrial {
  double rate = 1000;  ///< Hz
  std::vector<Vec3> tip;
  std::vector<bool> contact;
  std::vector<Vec3> point, normal, force;  ///< of the deepest contact; in free space not used
  std::vector<bool> on_edge;               ///< empty: the object's edges are not known
  /// Ends of the part of the segment that touches the surface, in contact; empty: the point alone.
  std::vector<std::array<Vec3, 2>> touched;
  /// Indexes at which the record goes on after a gap, ascending: nothing is derived across one.
  std::vector<std::size_t> breaks;
};

/// The stretches without a gap.
std::vector<Stretch> pieces_of(const MovementTrial& trial);

/// The path as it is measured: each piece on its own.
struct SmoothPath {
  std::vector<Vec3> place, velocity;
  std::vector<double> speed;
  std::vector<Stretch> movements;
};
SmoothPath smooth_path(const MovementTrial& trial, const MovementSettings& settings);
/// The places that have touched by each tick in contact: share of the surface, a value for each.
std::vector<double> coverage_by_tick(const MovementTrial& trial, const TouchedSurface& surface);

/// A value for each of measure_definitions(); none where it is not defined.
using MeasureValues = std::array<std::optional<double>, kMeasures>;

/// \param surface  of the object; null: it has none that can be counted on
MeasureValues measure(const MovementTrial& trial, const TouchedSurface* surface,
                      const MovementSettings& settings);

}  // namespace palpate::analysis
