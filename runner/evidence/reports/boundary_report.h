#pragma once
// The results of `palpate stability SCENE.json`, as text, JSON, figure and page.

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "analysis/figures/figures.h"
#include "runner/evidence/stability/scene_boundary.h"

namespace palpate::runner::evidence {

/// A device on which a scene may buzz.
struct BuzzingDevice {
  std::string name;
  LoopSettings ends = {};  ///< damping, friction and resolution of each end; rate and delay
  double delay = 0;        ///< s, from a reading to its force
  bool measured = false;   ///< the delay was
};

struct BoundaryReport {
  std::string scene, renderer;
  SceneBoundary boundary;
  std::optional<BuzzingDevice> device;
};

std::string boundary_text(const BoundaryReport& report);
nlohmann::ordered_json boundary_json(const BoundaryReport& report);
/// Damping over rate, a line for each delay, a panel for each place.
analysis::Figure boundary_figure(const BoundaryReport& report);
std::string boundary_page(const BoundaryReport& report);

}  // namespace palpate::runner::evidence
