#pragma once
// The results of tasks as tables, and as sentences for a paper.

#include <string>
#include <vector>

#include "analysis/report/tables.h"
#include "analysis/statistics/task_analysis.h"

namespace palpate::analysis {

/// "compare, stiffness, ball": a task, a block and a stimulus; empty ones are left out.
std::string stimulus_of(const std::string& task, const std::string& block,
                        const std::string& shape);

/// The finding in a sentence or two: what differs clearly between renderers (Holm-adjusted
/// p < 0.05) or, with one renderer, between rated stimuli; without any comparison the means.
std::string conclusion(const StudyAnalysis& analysis);

/// The findings: in a study of groups first between them.
std::string headline(const StudyAnalysis& analysis);

/// How functions were fitted.
std::string explanation(const StudyAnalysis& analysis);
/// Notes on what a table without its protocol does not contain: the scale of levels, and whether
/// numbers are steps. "": nothing
std::string scale_note(const StudyAnalysis& analysis);

/// Means over participants with their intervals, and comparisons within participants with their
/// tests; those without rows are left out.
std::vector<Table> group_tables(const StudyAnalysis& analysis);
/// For a paper: a sentence for each comparison between renderers or, with one renderer, between
/// stimuli.
std::vector<std::string> sentences_to_quote(const StudyAnalysis& analysis);

/// The tables of one cell: ratings and their steps, each participant's function, tracks, detection,
/// exponents, settings; those without rows are left out.
std::vector<Table> cell_tables(const TaskCell& cell, const std::string& label);
/// Whether the group's model has the comparison; then the test of individual fits stands beside it.
bool has_model(const StudyAnalysis& analysis, const TaskComparison& one);

/// "JND, ray / point: 0.51, 95 % CI [0.30, 0.86], likelihood ratio 7.2, p = 0.021, n = 8"
std::string group_sentence(const TaskGroupComparison& one);
/// Over all cells: information transfer, confidence.
std::vector<Table> summary_tables(const StudyAnalysis& analysis);

}  // namespace palpate::analysis
