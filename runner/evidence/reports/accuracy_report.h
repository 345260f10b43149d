#pragma once
// The results of `palpate accuracy` (accuracy.cpp), as text, tables, JSON, figure and page.

#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "analysis/figures/figures.h"
#include "analysis/report/tables.h"
#include "runner/evidence/accuracy/body_study.h"
#include "runner/evidence/accuracy/paper_first_contact.h"
#include "runner/evidence/accuracy/study.h"
#include "runner/evidence/accuracy/union_study.h"
#include "runner/evidence/scenes/scene_study.h"
#include "runner/evidence/verification/extreme_cases.h"
#include "runner/evidence/verification/search.h"
#include "runner/evidence/verification/union_search.h"
#include "stimuli/shapes.h"

namespace palpate::runner::evidence {

/// First contacts of one shape at several speeds of the hand.
struct FirstContactStudy {
  std::string shape;
  std::vector<evidence::FirstContactLoss> speeds;
};

/// An extreme case by one of the renderers.
struct ExtremeRow {
  std::string name, title, measure, probe;
  evidence::ExtremeResult result;
};

struct AccuracyReport {
  evidence::AccuracySettings settings;
  std::vector<evidence::AccuracyRow> rows;
  std::vector<FirstContactStudy> first_contacts;
  double paper_test_ns = 0, exact_test_ns = 0;  ///< of a test for first contact with a cube
  evidence::UnionSettings union_settings;
  std::vector<evidence::UnionRow> unions;
  std::vector<evidence::SoftRow> soft;
  std::vector<ExtremeRow> extremes;
  std::vector<BodyRow> bodies;
  evidence::BodyTickCost body_tick;
  std::vector<SceneStudy> scenes;  ///< of every kind
  std::optional<evidence::SearchCounts> search;
  std::optional<evidence::UnionCounts> union_search;
  std::uint64_t search_seed = 0;  ///< of both searches
};

/// Errors below the hand's threshold, and below a device's resolution.
constexpr evidence::ErrorLimits kHand{1e-3, 0.17453292519943295};   ///< 1 mm, 10 degrees
constexpr evidence::ErrorLimits kDevice{3e-5, evidence::kNoLimit};  ///< 0.03 mm

/// The shapes that were measured, in order.
std::vector<std::string> measured_shapes(const AccuracyReport& report);
/// Parameters of the shape of this name; default values for an unknown name.
stimuli::ShapeTraits traits_of_shape(const std::string& name);
/// Whether it is a polyhedron: its one tessellation is the shape itself.
bool is_flat_sided(const std::string& shape);

/// Three significant figures, plain where that is short: "0.0345", "1.2e-17".
std::string significant(double value);
/// Percent of all, "0" where there are none.
std::string share(std::size_t part, std::size_t all);
/// "327,680"
std::string thousands(long long n);
/// Writes a text in lines of at most 98 columns, indented, for a terminal.
void put_wrapped(std::ostream& out, const std::string& text);
/// Writes a table for a terminal.
void put_table(std::ostream& out, const analysis::Table& table);

/// "sphere: ...", with the recommended tessellation.
std::string recommendation(const AccuracyReport& report, const std::string& shape);
/// All results, in the order of display.
std::vector<analysis::Table> accuracy_tables(const AccuracyReport& report);

std::string accuracy_text(const AccuracyReport& report);
nlohmann::ordered_json accuracy_json(const AccuracyReport& report);
/// The work-precision figure: error over nanoseconds a tick, two panels for each shape.
analysis::Figure accuracy_figure(const AccuracyReport& report);
/// The whole report as one page.
std::string accuracy_page(const AccuracyReport& report);

}  // namespace palpate::runner::evidence
