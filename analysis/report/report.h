#pragma once
// The report of a study: as text, JSON and HTML.

#include <string>

#include "analysis/input/study_record.h"
#include "analysis/report/tables.h"
#include "analysis/statistics/analysis.h"

namespace palpate::analysis {

struct Drivers;
struct MovementAnalysis;
struct MovementPictures;
struct MovementTable;
struct SweepAnalysis;
struct StudyAnalysis;

/// The analysis for a terminal: the conclusion, then warnings and tables. UTF-8, at most 100
/// columns; long names are shortened, wide tables are split.
std::string report_text(const Analysis& analysis);

/// One of its tables, and a paragraph.
std::string table_text(const Table& table);
std::string paragraph_text(const std::string& text);

/// The analysis as JSON; the keys are described in analysis/README.md. Numbers have 17 significant
/// digits; an undefined one is null beside "status": "undefined" and a "reason".
std::string report_json(const Analysis& analysis);

/// Appends the percent reductions at the top of a report: a row of cards for each comparison, a
/// card for each shape: reduction, interval, p and the paper's percentage.
void put_reduction_cards(std::string& out, const Analysis& analysis);

/// The analysis as one HTML page (HtmlPage): conclusion, warnings, figures, tables and provenance.
std::string report_html(const Analysis& analysis, const StudyRecord& record);

/// The analysis of the tasks of a study of version 2, for a terminal.
std::string task_report_text(const StudyAnalysis& analysis);
/// The same as an HTML page with the figures.
/// \param record  whether the study was checked against its registration
std::string task_report_html(const StudyAnalysis& analysis, const std::string& program_version,
                             const StudyRecord& record = {});
/// Every number, 17 significant digits. An infinite end of an interval is null.
std::string task_report_json(const StudyAnalysis& analysis, const std::string& program_version);

/// Runs every analysis on the table.
MovementAnalysis analyze_movement(MovementTable table, const std::string& program_version);

/// At most 100 columns; labelled if participants are simulated.
std::string movement_text(const MovementAnalysis& analysis);
/// Every number, setting and definition.
std::string movement_json(const MovementAnalysis& analysis);
/// A self-contained page with the figures and their description in words.
std::string movement_html(const MovementAnalysis& analysis, const MovementPictures& pictures);

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
