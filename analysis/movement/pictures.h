#pragma once
// Data of movement figures beyond the measures: map of contact, growth of coverage, and a typical
// trial of each kind.

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "analysis/movement/comparison.h"
#include "analysis/movement/coverage.h"
#include "analysis/movement/measures.h"

namespace palpate::analysis {

/// Map of an object's surface as seen from its middle; each cell spans an equal solid angle:
/// columns by the angle about z, rows by height over distance.
struct SurfaceMap {
  static constexpr std::size_t kColumns = 24, kRows = 12, kCells = kColumns * kRows;
  /// 0 to kColumns, 0 to kRows. \param from_middle  m
  static std::array<double, 2> place_of(const Vec3& from_middle);
  static std::size_t cell_of(const Vec3& from_middle);
};

/// One trial's contribution to the figures.
struct TrialTally {
  static constexpr double kStep = 0.25;      ///< s
  static constexpr std::size_t kSteps = 81;  ///< up to 20 s
  /// Share of the ticks in contact, by cell of the map; empty: no contact, or no surface.
  std::vector<float> contact;
  std::vector<float> coverage;  ///< after each step; a trial that has ended keeps its last value
};
TrialTally tally_of(const MovementTrial& trial, const TouchedSurface& surface);

/// Shape of an object: points on it, and its sharp edges. Its frame, m.
struct ShapeOutline {
  std::vector<Vec3> places;
  std::vector<std::array<Vec3, 2>> edges;
  Vec3 middle() const;
};

struct CoverageCurve {
  std::size_t participants = 0;
  std::vector<double> mean;    ///< over participants' means, after each step; empty: none
  double median_duration = 0;  ///< s: half of the trials have ended by then
};

/// Averages over trials, each with the same weight.
struct ContactMap {
  std::size_t trials = 0;
  /// Contact time per surface area in a cell; 1: uniform contact.
  std::vector<double> density;
};

struct TypicalTrial {
  std::size_t row = 0;  ///< of the table
  std::string name;     ///< "P03/1/12"
  MovementTrial trial;
};

/// Vectors by renderer and shape, as in TrialTable.
struct MovementPictures {
  std::vector<ShapeOutline> outlines;  ///< by shape; empty: no rigid surface
  std::vector<std::vector<CoverageCurve>> coverage;
  std::vector<std::vector<ContactMap>> contact;
  std::vector<TypicalTrial> typical;  ///< at most one for each shape and renderer, in this order
};

/// The correct answer whose duration is nearest to the median of all measured trials of its shape
/// and renderer; rows of the table, by shape, then renderer.
std::vector<std::size_t> typical_rows(const MovementTable& table);
/// Fills in coverage and contact. \param tallies  of each row of the table
void add_up(const MovementTable& table, const std::vector<TrialTally>& tallies,
            MovementPictures& pictures);

}  // namespace palpate::analysis
