#pragma once
// The inference of an analysis as JSON.

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "analysis/analysis.h"

namespace palpate {

using Json = nlohmann::ordered_json;

/// A number that is too large to be one (the percent of a huge log ratio) is null as well.
Json number(const std::optional<double>& value);

/// "status", and where something is missing "reason".
void put_status(Json& out, const std::string& undefined);

Json anova_json(const RmAnova& anova, const TrialTable& table);
Json mixed_model_json(const Analysis& analysis);
/// By shape.
Json speed_accuracy_json(const Comparison& comparison, const TrialTable& table);
/// What practice does to one comparison, into `out`.
void put_pair_practice(Json& out, const PairPractice& practice, const RendererPair& pair,
                       const TrialTable& table);
/// Learning with each renderer, and the first comparison.
Json practice_json(const Analysis& analysis);

}  // namespace palpate
