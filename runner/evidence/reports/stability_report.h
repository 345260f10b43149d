#pragma once
// The results of `palpate stability`, as text, JSON, figures and an HTML page.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "analysis/figures/figures.h"
#include "runner/evidence/stability/boundary.h"
#include "runner/evidence/stability/integrators.h"
#include "runner/evidence/stability/soft_rest.h"

namespace palpate::runner::evidence {

/// One curve of the map: the boundary over stiffness.
struct BoundaryCurve {
  std::string panel, name;  ///< "rates", "0.5 kHz"
  LoopCase loop;
  std::vector<BoundaryPoint> points;
};

/// Largest stable stiffness of a device, without and with the passivity controller.
struct ControllerGain {
  LoopCase loop;                 ///< without the controller
  double damping = 0;            ///< N s/m, of each end
  double without = 0, with = 0;  ///< N/m, largest stable stiffness
};

struct StabilityReport {
  std::vector<BoundaryCurve> theory;  ///< heavy ends, as the theory assumes
  std::vector<BoundaryCurve> curves;
  std::vector<ControllerGain> gains;
  std::vector<IntegratorRow> integrators;

  /// Largest |measured / theory - 1| of the plain wall with heavy ends.
  double worst_disagreement() const;
  /// Points that are unstable although the theory promises passivity; must be 0.
  int unsafe() const;
  int points() const;
};

/// The map of boundaries, and that of soft bodies.
analysis::Figure stability_figure(const StabilityReport& report);
analysis::Figure soft_map_figure(const std::vector<SoftSwing>& map);

/// The conclusions in sentences, the tables, and how to read them.
std::string stability_text(const StabilityReport& report);
/// The same as a page, with the figures.
std::string stability_page(const StabilityReport& report);
/// Every number.
nlohmann::ordered_json stability_json(const StabilityReport& report);

}  // namespace palpate::runner::evidence
