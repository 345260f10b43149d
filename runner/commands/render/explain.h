#pragma once
// `palpate render --explain`: the stages of a tick over a scene, and what each costs.

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "rendering/verification/explain.h"

namespace palpate::runner {

/// A stage with its cost on this machine.
struct StageCost {
  rendering::TickStage stage;
  /// ns for a call, run in isolation over recorded ticks; empty: left out, did not happen, or
  /// cannot be told apart from others.
  std::optional<double> ns;
};

struct Explanation {
  std::string renderer;
  std::size_t objects = 0, parts = 0, surfaces = 0, facets = 0, edges = 0;
  std::optional<double> contact_ns, free_ns;  ///< of a whole tick
  std::optional<double> rest_ns;              ///< of contact_ns: not accounted for by the stages
  std::vector<StageCost> stages;
  std::vector<std::string> notes = {};  ///< on the scene, a sentence each
};

Explanation explain_with_costs(const rendering::Scene& scene, const rendering::Renderer& renderer);

std::string to_text(const Explanation& explanation);
nlohmann::ordered_json to_json(const Explanation& explanation);

}  // namespace palpate::runner
