#pragma once
// The mixed model of all answers in reports.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "analysis/report/tables.h"
#include "analysis/statistics/answer_model.h"

namespace palpate::analysis {

nlohmann::ordered_json answer_models_json(const std::vector<AnswerModel>& models);

std::string answer_models_text(const std::vector<AnswerModel>& models);

/// Cells, effects and contrasts of each model. \param label  "SIMULATED PARTICIPANTS" or empty
std::vector<Table> answer_model_tables(const std::vector<AnswerModel>& models,
                                       const std::string& label);

}  // namespace palpate::analysis
