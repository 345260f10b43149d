#pragma once
// The work-precision study: the error of every method against its run time, over every tessellation
// of the analytic shapes.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "runner/evidence/accuracy/methods.h"
#include "stimuli/shapes.h"

namespace palpate::runner::evidence {

struct AccuracySettings {
  int paths = 4;             ///< for each shape and probe; seeds 1, 2, ...
  int contact_ticks = 1000;  ///< of each path
  double length = 0.12;      ///< m, of the stylus
  int most_triangles = 327680;
  /// Budget of visited facets and edges for the exact polyhedron and the methods that scan. If all
  /// ticks would exceed it, every n-th tick is compared.
  double visits = 2e8;
  int timings = 3;  ///< repetitions; the fastest counts
};

/// One method on one tessellation with one probe.
struct AccuracyRow {
  std::string shape;  ///< "sphere", "cone", "cylinder", "cube"
  int triangles = 0;
  std::size_t facets = 0, edges = 0;  ///< after merging coplanar triangles
  int subdivisions = 0;               ///< sphere
  int segments = 0;                   ///< cone, cylinder
  std::string probe;                  ///< "ray", "point"
  std::string method;
  double ns_per_tick = 0;
  ErrorSummary shape_errors;       ///< against the analytic shape
  ErrorSummary polyhedron_errors;  ///< against the exact polyhedron
};

/// The tessellations of one shape, coarse to fine; default sizes (30 mm, 60 mm).
std::vector<stimuli::ObjectSpec> tessellations(stimuli::ShapeKind shape, int most_triangles);
int triangles_of(const stimuli::ObjectSpec& spec);

/// \param now       a clock, ns
/// \param progress  called with the fraction done before each row
std::vector<AccuracyRow> accuracy_study(const AccuracySettings& settings,
                                        const std::function<double()>& now,
                                        const std::function<void(double)>& progress);

/// Limits that 99.9 % of the errors of a renderer's whole ticks must keep.
struct ErrorLimits {
  double position;   ///< m, of the surface along the normal
  double direction;  ///< rad, of the force
};
constexpr double kNoLimit = 1e9;

/// Triangles of the coarsest tessellation that, like all finer ones, keeps both renderers within
/// the limits without a lost contact; 0 if none is fine enough.
int triangles_for(const std::vector<AccuracyRow>& rows, const std::string& shape,
                  const ErrorLimits& limits);

}  // namespace palpate::runner::evidence
