#pragma once
// A sweep's analysis as text, JSON and an HTML page.

#include <string>
#include <vector>

#include "analysis/report/tables.h"
#include "analysis/statistics/sweep_analysis.h"

namespace palpate::analysis {

/// Gains over the space, what each depends on, why points failed.
std::vector<Table> sweep_tables(const SweepAnalysis& analysis);
/// In how many settings the pattern holds, in a sentence; what was run where none was asked for.
std::string sweep_answer(const SweepAnalysis& analysis);

/// In how many settings the pattern holds, and what its interval is about; "" without a pattern.
std::string pattern_note(const SweepAnalysis& analysis);
/// Whether chance is a part of a total index. \return "" where it is not
std::string chance_note(const Drivers& drivers);

std::string sweep_text(const SweepAnalysis& analysis);
std::string sweep_json(const SweepAnalysis& analysis);
std::string sweep_html(const SweepAnalysis& analysis);

}  // namespace palpate::analysis
