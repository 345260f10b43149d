#pragma once
// Inferential statistics as JSON; the keys are described in analysis/README.md.

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "analysis/statistics/analysis.h"

namespace palpate::analysis {

using Json = nlohmann::ordered_json;

/// null for a missing or infinite value, as the percent change of a huge log ratio.
Json number(const std::optional<double>& value);

/// Sets "status" to "ok" or "undefined", in the latter case also "reason".
void put_status(Json& out, const std::string& undefined);

/// Sets NAME_low and NAME_high; null without an interval.
void put_interval(Json& out, const std::string& name, const std::optional<Interval>& interval);

/// The ends of an interval of log ratios as percent reductions, under NAME_ci95_low and
/// NAME_ci95_high.
void put_reduction_ci95(Json& out, const std::string& name,
                        const std::optional<Interval>& log_ratio);

Json censored_json(const CensoredEstimate& censored);
/// By renderer and shape; lists the participants who have time-outs.
Json time_outs_json(const Analysis& analysis);
Json anova_json(const RmAnova& anova, const TrialTable& table);
Json mixed_model_json(const Analysis& analysis);
Json shape_slope_json(const Analysis& analysis);
/// Change of accuracy and of time by shape.
Json speed_accuracy_json(const Comparison& comparison, const TrialTable& table);
/// Adds the practice effects of a comparison to `out`.
void put_pair_practice(Json& out, const PairPractice& practice, const RendererPair& pair,
                       const TrialTable& table);
/// Learning with each renderer, and the practice effects of the first comparison.
Json practice_json(const Analysis& analysis);

}  // namespace palpate::analysis
