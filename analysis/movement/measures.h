#pragma once
// Movements of the hand in a trial, as one number for each measure.

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/movement/coverage.h"
#include "analysis/movement/signal.h"
#include "stimuli/vec.h"

namespace palpate::analysis {

/// Contact episodes: gaps under 50 ms are joined, then episodes under 20 ms dropped.
std::vector<Stretch> contact_episodes(const std::vector<bool>& contact, double rate);

/// Slower than 5 mm/s for 50 ms or more, in contact. (Grunwald et al. 2014; our threshold.)
std::vector<Stretch> stops(const std::vector<bool>& contact, const std::vector<double>& speed,
                           double rate);

/// Movements in contact of 50 ms or more, between stops and turns. A turn: the direction of the
/// next 50 ms differs from that of the last 50 ms by more than 90 degrees, so a circle is one
/// stroke. (Drewing et al. 2011; our limits.)
std::size_t strokes(const std::vector<bool>& contact, const std::vector<Stretch>& stops,
                    const std::vector<Vec3>& path, double rate);

/// Exploratory procedures (Lederman & Klatzky 1987), classified by position and force as in Jansen
/// et al. 2013.
enum class Procedure { stationary, pressure, lateral, contour };
inline constexpr std::size_t kProcedures = 4;

/// Features of a tick in contact that distinguish procedures.
struct ContactMotion {
  double tangential_speed = 0;  ///< m/s
  double normal_force = 0;      ///< N
  bool on_edge = false;
};

/// Classifies one window. Contour: on an edge for at least half of the ticks, and 10 mm/s or faster
/// along the surface. Lateral: off edges, as fast. Pressure: slower, with a range of normal force
/// above 0.3 of its mean. Otherwise static.
Procedure procedure_of(const std::vector<ContactMotion>& window);

/// The procedure of each window of 100 ms without a gap in the contact.
/// \param motion  one value per tick
std::vector<Procedure> procedures(const std::vector<bool>& contact,
                                  const std::vector<ContactMotion>& motion, double rate);

/// The scale on which a measure is averaged and compared over participants.
enum class MeasureScale {
  log,       ///< natural logarithm; a value of 0 is missing
  count,     ///< natural logarithm of 1 + value
  logit,     ///< of a share, limited to 0.005 to 0.995
  identity,  ///< untransformed
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
  double cutoff = 20;  ///< Hz, of the low-pass filter of the path
};

/// One value per tick, from time zero to the answer, in the frame of the object, at rest or moving.
struct MovementTrial {
  double rate = 1000;  ///< Hz
  std::vector<Vec3> tip;
  std::vector<bool> contact;
  std::vector<Vec3> point, normal, force;  ///< of the deepest contact; unused in free space
  std::vector<bool> on_edge;               ///< empty: edges unknown
  /// Ends of the part of the segment that touches the surface, in contact; empty: the point alone.
  std::vector<std::array<Vec3, 2>> touched;
  /// Indices at which the record continues after a gap, ascending; no derivative is taken across a
  /// gap.
  std::vector<std::size_t> breaks;
};

/// The stretches without a gap.
std::vector<Stretch> pieces_of(const MovementTrial& trial);

/// The filtered path; each piece is filtered separately.
struct SmoothPath {
  std::vector<Vec3> place, velocity;
  std::vector<double> speed;
  std::vector<Stretch> movements;
};
SmoothPath smooth_path(const MovementTrial& trial, const MovementSettings& settings);
/// Share of the surface touched so far, after each tick in contact.
std::vector<double> coverage_by_tick(const MovementTrial& trial, const TouchedSurface& surface);

/// A value for each of measure_definitions(); none: undefined.
using MeasureValues = std::array<std::optional<double>, kMeasures>;

/// \param surface  of the object; null: no rigid surface
MeasureValues measure(const MovementTrial& trial, const TouchedSurface* surface,
                      const MovementSettings& settings);

}  // namespace palpate::analysis
