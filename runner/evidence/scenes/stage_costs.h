#pragma once
// The stages of a tick over a scene, and their costs on this machine: `palpate render --explain`.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "runner/evidence/scenes/feature_costs.h"
#include "runner/evidence/verification/explain.h"

namespace palpate::runner::evidence {

/// A stage with its cost on this machine.
struct StageCost {
  TickStage stage;
  /// ns for a call, run in isolation over recorded ticks; empty: left out, did not happen, or
  /// cannot be separated from others.
  std::optional<double> ns;
};

struct Explanation {
  std::string renderer;
  std::size_t objects = 0, parts = 0, surfaces = 0, facets = 0, edges = 0;
  std::optional<double> contact_ns, free_ns;  ///< of a whole tick
  std::optional<double> rest_ns;              ///< of contact_ns: not accounted for by the stages
  std::vector<StageCost> stages;
  std::vector<std::string> notes = {};     ///< on the scene, a sentence each
  std::vector<FeatureTime> features = {};  ///< that the scene has
  std::vector<FeatureSaved> saved = {};    ///< that it does not need
};

/// Fraction of the whole tick in contact, where the stage is part of it.
std::optional<double> share_of_contact(const Explanation& e, const StageCost& cost);

Explanation explain_with_costs(const rendering::Scene& scene, const rendering::Renderer& renderer);

}  // namespace palpate::runner::evidence
