#pragma once
// What the hand did in a trial, as one number for each measure.

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/movement/coverage.h"
#include "analysis/movement/signal.h"
#include "stimuli/vec.h"

namespace palpate::analysis {

// What a hand does while it touches: episodes, stops, strokes, and the exploratory procedures
// (Lederman & Klatzky 1987; that position and force tell them apart: Jansen et al. 2013).

/// Contact with gaps of less than 50 ms joined, then without those of less than 20 ms.
std::vector<Stretch> contact_episodes(const std::vector<bool>& contact, double rate);

/// Slower than 5 mm/s for 50 ms or more, in contact. (Grunwald et al. 2014; our threshold.)
std::vector<Stretch> stops(const std::vector<bool>& contact, const std::vector<double>& speed,
                           double rate);

/// Movements in contact of 50 ms or more, between stops and turns. A turn: the way of the next 50
/// ms goes off that of the last 50 ms by more than 90 degrees; so a circle is one stroke.
/// (Drewing et al. 2011; our limits.)
std::size_t strokes(const std::vector<bool>& contact, const std::vector<Stretch>& stops,
                    const std::vector<Vec3>& path, double rate);

enum class Procedure { stationary, pressure, lateral, contour };
inline constexpr std::size_t kProcedures = 4;

/// What tells procedures apart, of a tick in contact.
struct ContactMotion {
  double tangential_speed = 0;  ///< m/s
  double normal_force = 0;      ///< N
  bool on_edge = false;
};

/// Of one window: contour on an edge for at least half of the ticks and 10 mm/s or faster along the
/// surface; lateral off edges and as fast; pressure slower, with a range of normal force above 0.3
/// of its mean; else stationary.
Procedure procedure_of(const std::vector<ContactMotion>& window);

/// The procedure of each window of 100 ms without a gap in the contact.
/// \param motion  a value a tick
std::vector<Procedure> procedures(const std::vector<bool>& contact,
                                  const std::vector<ContactMotion>& motion, double rate);

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
