#pragma once
// What `palpate stability` found, as text, JSON, figures and a page.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "analysis/figures/figures.h"
#include "analysis/report/tables.h"
#include "runner/stability/boundary.h"
#include "runner/stability/integrators.h"

namespace palpate::runner {

/// One curve of the map: the boundary over stiffness.
struct BoundaryCurve {
  std::string panel, name;  ///< "rates", "0.5 kHz"
  LoopCase loop;
  std::vector<BoundaryPoint> points;
};

/// How far a device of given damping goes, without the passivity controller and with it.
struct ControllerGain {
  LoopCase loop;                 ///< without
  double damping = 0;            ///< N s/m, of each end
  double without = 0, with = 0;  ///< N/m, stiffest that is stable
};

struct StabilityReport {
  std::vector<BoundaryCurve> theory;  ///< heavy ends: the theory's own case
  std::vector<BoundaryCurve> curves;
  std::vector<ControllerGain> gains;
  std::vector<IntegratorRow> integrators;

  /// Worst |measured / theory - 1| of the plain wall with heavy ends.
  double worst_disagreement() const;
  /// Points where the theory promised passivity and the loop was unstable; must be 0.
  int unsafe() const;
  int points() const;
};

/// The answers in sentences.
std::vector<std::string> stability_sentences(const StabilityReport& report);
std::vector<analysis::Table> stability_tables(const StabilityReport& report);
std::string stability_text(const StabilityReport& report);
nlohmann::ordered_json stability_json(const StabilityReport& report);
/// Damping over stiffness, measured beside theory, a panel for each question.
analysis::Figure stability_figure(const StabilityReport& report);
/// Error over run time of the integrators.
analysis::Figure integrator_figure(const StabilityReport& report);
std::string stability_page(const StabilityReport& report);

}  // namespace palpate::runner
