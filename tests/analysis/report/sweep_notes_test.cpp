// Notes below the tables of a sweep's report.

#include <gtest/gtest.h>

#include <sstream>
#include <string>

#include "analysis/report/report.h"
#include "analysis/statistics/sweep_analysis.h"
#include "tests/analysis/sweep_table_fixture.h"

namespace palpate::analysis {
namespace {
namespace sweep_notes {

using namespace palpate::analysis::testing;

std::string in_one_line(const std::string& text) {
  std::istringstream words(text);
  std::string out;
  for (std::string word; words >> word;) out += (out.empty() ? "" : " ") + word;
  return out;
}

/// x2 is the same everywhere, but in the failed points.
SweepAnalysis with_a_constant_parameter() {
  std::vector<std::vector<double>> points;
  for (int i = 0; i < 12; ++i) points.push_back({0.1 * ((7 * i) % 12), 3, 0.01 * i * i});
  return analyze_sweep(table_of("latin-hypercube", points,
                                [](const std::vector<double>& x) {
                                  return Outcome{x[0] + 0.1 * x[2], 0.01};
                                }),
                       "", "test");
}

TEST(SweepNotes, SayWhyAParameterHasNoCorrelation) {
  const SweepAnalysis analysis = with_a_constant_parameter();
  const std::string text = in_one_line(sweep_text(analysis));
  EXPECT_NE(text.find("x2: none, the parameter is the same at all points with an output."),
            std::string::npos)
      << text;
  EXPECT_EQ(text.find("x1: none"), std::string::npos);
  EXPECT_EQ(text.find("x3: none"), std::string::npos);
}

}  // namespace sweep_notes
}  // namespace
}  // namespace palpate::analysis
