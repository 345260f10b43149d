#pragma once
// The results of `palpate accuracy` on scenes (scene_study.h), as text, table, JSON, figure and
// page.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "analysis/figures/figures.h"
#include "analysis/report/tables.h"
#include "runner/evidence/scenes/scene_study.h"

namespace palpate::runner::evidence {

/// A row for each method of each scene.
analysis::Table scene_table(const std::vector<SceneStudy>& studies);
/// The same as a figure; a panel for each scene.
analysis::Figure scene_figure(const std::vector<SceneStudy>& studies);

/// Of one scene.
nlohmann::ordered_json scene_json(const SceneStudy& study);
std::string scene_text(const SceneStudy& study);
std::string scene_page(const SceneStudy& study);

}  // namespace palpate::runner::evidence
