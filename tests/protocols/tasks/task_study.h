#pragma once
// A study of three blocks, and its trials with answers that depend on the trial alone.

#include <cstdint>
#include <nlohmann/json.hpp>
#include <vector>

#include "data/base/random.h"
#include "protocols/parse.h"
#include "protocols/session_plan.h"

namespace palpate::protocols {

/// Constant stimuli, two staircases that are mixed, and detection of a layer.
inline nlohmann::json task_study() {
  return nlohmann::json::parse(
      R"({"version": 2, "name": "s", "renderers": ["point", "ray"], "seed": 5,
    "stimuli": [{"name": "soft", "shape": "sphere", "radius_m": 0.03, "stiffness_n_per_m": 300},
                {"name": "lump", "shape": "sphere", "radius_m": 0.03, "stiffness_n_per_m": 100,
                 "layers": [{"depth_m": 0.004, "stiffness_n_per_m": 300}]}],
    "blocks": [
      {"name": "constant", "task": "compare", "stimuli": ["soft"], "standard": "soft",
       "renderers": ["ray"], "level": {"path": "/stiffness_n_per_m"},
       "procedure": {"kind": "constant", "levels": [200, 250, 350, 400], "repetitions": 6},
       "order": {"max_run": 2}},
      {"name": "stairs", "task": "compare", "intervals": 3, "stimuli": ["soft"],
       "standard": "soft", "renderers": ["ray"], "level": {"path": "/stiffness_n_per_m"},
       "procedure": [
         {"kind": "staircase", "start": 500, "min": 300, "max": 600, "steps": [50, 25], "down": 2,
          "stop": {"reversals": 6, "trials": 30}},
         {"kind": "staircase", "start": 400, "min": 300, "max": 600, "steps": [50, 25], "down": 3,
          "stop": {"reversals": 6, "trials": 30}}]},
      {"name": "lumps", "task": "detect", "stimuli": ["lump"], "catch_trials": 0.25,
       "level": {"path": "/layers/0/depth_m"},
       "procedure": {"kind": "constant", "levels": [0.002, 0.004, 0.008], "repetitions": 3}}
    ]})");
}

inline Protocol parsed(const nlohmann::json& document) {
  return parse_protocol_text(document.dump(), "study.json");
}

/// Answers that depend on the trial alone.
inline TrialOutcome answer_to(const Trial& trial) {
  constexpr std::uint64_t kSeed = 99;
  Random random(kSeed, {static_cast<std::uint64_t>(trial.trial)});
  const bool success = random.unit() < (trial.level.value_or(400) > 380 ? 0.9 : 0.4);
  return {success, success, random.unit() > 0.05};
}

inline std::vector<Trial> worked_off(SessionPlan plan) {
  std::vector<Trial> trials;
  while (!plan.finished()) {
    trials.push_back(plan.next());
    plan.answered(answer_to(trials.back()));
  }
  return trials;
}

}  // namespace palpate::protocols
