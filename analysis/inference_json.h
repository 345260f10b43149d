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
Json mixed_model_json(const MixedModel& model, const TrialTable& table);
Json speed_accuracy_json(const std::vector<SpeedAccuracy>& shapes, const TrialTable& table);
Json practice_json(const Practice& practice, const TrialTable& table);

}  // namespace palpate
