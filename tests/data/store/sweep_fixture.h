#pragma once
// A sweep of made-up studies.

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "data/store/sweep_file.h"
#include "tests/data/store/store_fixture.h"

namespace palpate::data::testing {

inline SweepPlan a_sweep_plan(std::int64_t points = 20) {
  SweepPlan plan;
  plan.protocol = R"({"name": "two", "stimuli": [{"radius_m": 0.03}, {"radius_m": 0.02}]})";
  plan.settings = R"({"motor": {"reaction_delay_s": 0.1}})";
  plan.space = R"({"version": 1, "parameters": []})";
  plan.design = "lhs";
  plan.points = points;
  plan.seed = 18'446'744'073'709'551'615U;
  plan.participants = 3;
  plan.program_version = "1.2.3";
  plan.parameters = {"delay", "order"};
  plan.shapes = {"ball", "hat"};
  plan.renderers = {"point", "ray"};
  return plan;
}

/// Values that differ in every field and every point; every third figure is undefined.
inline SweepRow a_sweep_row(std::int64_t point, double change = 0) {
  SweepRow row;
  row.point = point;
  row.seed = 9'000'000'000'000'000'000U + static_cast<std::uint64_t>(point);
  row.order_seed = static_cast<std::uint64_t>(point);
  row.values = {static_cast<double>(point) / 3, std::string("word ") + std::to_string(point % 2)};
  for (std::size_t i = 0; i < figure_columns(a_sweep_plan()).size(); ++i) {
    const double figure = static_cast<double>(point) + std::sqrt(static_cast<double>(i)) + change;
    row.figures.push_back(i % 3 == 2 ? std::nullopt : std::optional(figure));
  }
  return row;
}

inline SweepRow a_failed_row(std::int64_t point) {
  SweepRow row = a_sweep_row(point);
  row.reason = "grip, of \"point\" " + std::to_string(point);
  row.figures.assign(row.figures.size(), std::nullopt);
  return row;
}

inline std::vector<SweepRow> rows_of(SweepFile& file) {
  std::vector<SweepRow> out;
  file.for_each([&](const SweepRow& row) { out.push_back(row); });
  return out;
}

inline bool same(const SweepRow& a, const SweepRow& b) {
  return a.point == b.point && a.seed == b.seed && a.order_seed == b.order_seed &&
         a.reason == b.reason && a.values == b.values && a.figures == b.figures;
}

/// A file with these points of the plan; finished: as after a completed sweep.
inline void make_sweep(const std::string& path, const std::vector<std::int64_t>& points,
                       bool finished = false, const SweepPlan& plan = a_sweep_plan()) {
  SweepFile file = SweepFile::open(path, plan);
  for (const std::int64_t point : points) file.record({a_sweep_row(point)});
  if (finished) file.finish();
}

}  // namespace palpate::data::testing
