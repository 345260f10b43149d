// The rows of soft bodies: each number under its name, errors by their definition, and bounds that
// follow from what the rows compare with.

#include "rendering/accuracy/soft_study.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

namespace palpate::rendering {
namespace {
namespace soft_rows {

TEST(SoftStudy, RowsSayWhatTheyCompareAndStepsTakeTheirTime) {
  double clock = 0;
  std::vector<double> progress;
  const auto rows = soft_study(
      true, [&clock] { return clock += 1e6; }, [&](double done) { progress.push_back(done); });
  std::set<std::string> names;
  for (const SoftRow& row : rows) {
    EXPECT_TRUE(names.insert(row.name).second && !row.name.empty()) << row.name;
    EXPECT_FALSE(row.truth.empty() || row.unit.empty()) << row.name;
    EXPECT_GT(row.elements, 0U) << row.name;
    EXPECT_GT(row.nodes, row.elements) << row.name << ": hexahedra share their corners";
    EXPECT_GT(row.value, 0) << row.name;
    if (row.reference > 0) {
      EXPECT_NEAR(row.error, std::abs(row.value - row.reference) / row.reference, 1e-12)
          << row.name;
    }
    // Nothing is stepped for forces alone, and no step is timed twice.
    const bool timed =
        row.name != "patch test" && row.name.find("depth") != 0 && row.name.find("rest") != 0;
    EXPECT_EQ(row.step_ns > 0, timed) << row.name;
  }
  EXPECT_TRUE(std::ranges::is_sorted(progress));
  const auto error_of = [&](const std::string& begin) {
    const auto row = std::ranges::find_if(
        rows, [&](const SoftRow& one) { return one.name.rfind(begin, 0) == 0; });
    EXPECT_NE(row, rows.end()) << begin;
    return row == rows.end() ? 1e300 : row->error;
  };
  EXPECT_LT(error_of("patch test"), 1e-9) << "a linear displacement is exact in every element";
  EXPECT_LT(error_of("cantilever, 2 across"), error_of("cantilever, 1 across"));
  EXPECT_LT(error_of("ball on a slab, resolution 8"), error_of("ball on a slab, resolution 4"));
  EXPECT_LT(error_of("rest shape"), 1e-6) << "let go, it comes back";
  EXPECT_LT(error_of("volume"), 0.02)
      << "Poisson's ratio 0.49 lets the volume change by 2 % of strain";
}

}  // namespace soft_rows
}  // namespace
}  // namespace palpate::rendering
