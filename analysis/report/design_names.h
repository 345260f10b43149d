#pragma once
// Measures, conditions and contrasts of a design in words and in JSON.

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "analysis/statistics/study_design.h"

namespace palpate::analysis {

using OrderedJson = nlohmann::ordered_json;

OrderedJson design_number_json(const std::optional<double>& value);
OrderedJson design_interval_json(const std::optional<Interval>& interval);
/// The group's name; null: the measure has no groups.
OrderedJson design_group_json(const GroupedMeasure& of, std::size_t group);

const std::vector<std::string>& renderers_of_measure(const GroupedMeasure& of);

/// Adds "renderer" and, of crossed factors, "factor" and "level"; null: the mean over all.
void put_condition(const GroupedMeasure& of, const std::optional<DesignCondition>& condition,
                   OrderedJson& out);
OrderedJson contrast_json(const GroupedMeasure& of, const GroupContrast& one);

/// "Thresholds of 'stiffness', ball"
std::string measure_title(const GroupedMeasure& of);

/// On the scale of the figures: of logarithms their exponential.
std::string figure_text(const GroupedMeasure& of, const std::optional<double>& value);
std::string figure_text(const GroupedMeasure& of, const std::optional<Interval>& interval);

/// "ray", "surface rough"; over all: "all cells", "both or all", the one renderer
std::string condition_of(const GroupedMeasure& of, const std::optional<DesignCondition>& condition);

/// "old - young", "old / young", with what is compared; within a group "rough - smooth".
std::string group_contrast_name(const GroupedMeasure& of, const GroupContrast& one);

/// "caption (label)"; without a label the caption.
std::string labelled_caption(const std::string& caption, const std::string& label);

}  // namespace palpate::analysis
