#pragma once
// The results of `palpate stability`, as text, JSON, figures and an HTML page.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "analysis/figures/figures.h"
#include "analysis/report/tables.h"
#include "runner/stability/boundary.h"
#include "runner/stability/integrators.h"
#include "runner/stability/soft_map.h"

namespace palpate::runner::commands {

/// One curve of the map: the boundary over stiffness.
struct BoundaryCurve {
  std::string panel, name;  ///< "rates", "0.5 kHz"
  stability::LoopCase loop;
  std::vector<stability::BoundaryPoint> points;
};

/// Largest stable stiffness of a device, without and with the passivity controller.
struct ControllerGain {
  stability::LoopCase loop;      ///< without the controller
  double damping = 0;            ///< N s/m, of each end
  double without = 0, with = 0;  ///< N/m, largest stable stiffness
};

struct StabilityReport {
  std::vector<BoundaryCurve> theory;  ///< heavy ends, as the theory assumes
  std::vector<BoundaryCurve> curves;
  std::vector<ControllerGain> gains;
  std::vector<stability::IntegratorRow> integrators;

  /// Largest |measured / theory - 1| of the plain wall with heavy ends.
  double worst_disagreement() const;
  /// Points that are unstable although the theory promises passivity; must be 0.
  int unsafe() const;
  int points() const;
};

/// The conclusions in sentences.
std::vector<std::string> stability_sentences(const StabilityReport& report);
std::vector<analysis::Table> stability_tables(const StabilityReport& report);
std::string stability_text(const StabilityReport& report);
nlohmann::ordered_json stability_json(const StabilityReport& report);
/// Damping over stiffness, measured and by theory, a panel for each question.
analysis::Figure stability_figure(const StabilityReport& report);
/// Error over run time of the integrators.
analysis::Figure integrator_figure(const StabilityReport& report);
/// Swing of the force on soft bodies, by modulus, spring and rate, a panel for each tool.
analysis::Figure soft_map_figure(const std::vector<stability::SoftSwing>& map);
std::string stability_page(const StabilityReport& report);

}  // namespace palpate::runner::commands
