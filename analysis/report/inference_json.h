#pragma once
// The inference of an analysis as JSON.

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "analysis/statistics/analysis.h"

namespace palpate::analysis {

using Json = nlohmann::ordered_json;

/// A number that is too large to be one (the percent of a huge log ratio) is null as well.
Json number(const std::optional<double>& value);

/// "status", and where something is missing "reason".
void put_status(Json& out, const std::string& undefined);

/// NAME_low and NAME_high; null where there is no interval.
void put_interval(Json& out, const std::string& name, const std::optional<Interval>& interval);

/// The ends of an interval of log ratios as percent reductions, under NAME_ci95_low and
/// NAME_ci95_high.
void put_reduction_ci95(Json& out, const std::string& name,
                        const std::optional<Interval>& log_ratio);

Json censored_json(const CensoredEstimate& censored);
/// By renderer and shape; participants with time-outs alone are listed.
Json time_outs_json(const Analysis& analysis);
Json anova_json(const RmAnova& anova, const TrialTable& table);
Json mixed_model_json(const Analysis& analysis);
/// By shape.
Json speed_accuracy_json(const Comparison& comparison, const TrialTable& table);
/// What practice does to one comparison, into `out`.
void put_pair_practice(Json& out, const PairPractice& practice, const RendererPair& pair,
                       const TrialTable& table);
/// Learning with each renderer, and the first comparison.
Json practice_json(const Analysis& analysis);

}  // namespace palpate::analysis
