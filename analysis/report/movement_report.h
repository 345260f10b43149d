#pragma once
// The measures of movement as text, JSON and a page.

#include <string>
#include <vector>

#include "analysis/movement/comparison.h"
#include "analysis/movement/pictures.h"
#include "analysis/report/tables.h"

namespace palpate::analysis {

struct MovementAnalysis {
  MovementTable table;
  std::vector<MeasureComparison> measures;
  std::vector<AdjustedGain> gains;
  std::string program_version;
};

/// Runs every analysis on the table.
MovementAnalysis analyze_movement(MovementTable table, const std::string& program_version);

/// At most 100 columns; labelled if participants are simulated.
std::string movement_text(const MovementAnalysis& analysis);
/// Every number, setting and definition.
std::string movement_json(const MovementAnalysis& analysis);
/// A self-contained page with the figures and their description in words.
std::string movement_html(const MovementAnalysis& analysis, const MovementPictures& pictures);

}  // namespace palpate::analysis
