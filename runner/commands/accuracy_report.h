#pragma once
// What `palpate accuracy` found, as text, JSON, a Vega figure and a page.

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "rendering/accuracy_study.h"
#include "rendering/paper_first_contact.h"
#include "rendering/search.h"

namespace palpate {

/// First contacts of one shape at several speeds of the hand.
struct FirstContactStudy {
  std::string shape;
  std::vector<FirstContactLoss> speeds;
};

struct AccuracyReport {
  AccuracySettings settings;
  std::vector<AccuracyRow> rows;
  std::vector<FirstContactStudy> first_contacts;
  double paper_test_ns = 0, exact_test_ns = 0;  ///< of a first contact with a cube, all tried
  std::optional<SearchCounts> search;
  std::uint64_t search_seed = 0;
};

/// What a hand can feel, and what a device resolves.
constexpr Demand kHand{1e-3, 0.17453292519943295};  ///< 1 mm, 10 degrees
constexpr Demand kDevice{3e-5, kNoDemand};          ///< 0.03 mm

/// "sphere: ...", the tessellation a lab should choose, a sentence for each shape.
std::vector<std::string> recommendations(const AccuracyReport& report);

std::string accuracy_text(const AccuracyReport& report);
std::string search_text(const SearchCounts& counts, std::uint64_t seed);
nlohmann::ordered_json accuracy_json(const AccuracyReport& report);
/// The work-precision figure: error over nanoseconds a tick, a panel for each shape; Vega 5.
nlohmann::ordered_json accuracy_figure(const AccuracyReport& report);

}  // namespace palpate
