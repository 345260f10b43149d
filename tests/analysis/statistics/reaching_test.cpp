#include "analysis/statistics/reaching.h"

#include <gtest/gtest.h>

#include <cmath>

namespace palpate::analysis {
namespace {

std::vector<ReachPoint> course(double start, double end, double trials, int count) {
  std::vector<ReachPoint> out;
  for (int i = 0; i < count; ++i)
    out.push_back({static_cast<double>(i), end + (start - end) * std::exp(-i / trials)});
  return out;
}

TEST(Learning, ExponentialIsFoundAgain) {
  for (const double trials : {1.0, 6.0, 25.0}) {
    const LearningFit fit = fit_learning(course(0.02, 0.004, trials, 60));
    EXPECT_EQ(fit.undefined, "");
    EXPECT_NEAR(fit.trials, trials, 1e-4 * trials);
    EXPECT_NEAR(fit.start, 0.02, 1e-6);
    EXPECT_NEAR(fit.end, 0.004, 1e-6);
    EXPECT_NEAR(fit.residual_sd, 0, 1e-7);
  }
}

TEST(Learning, TrialsLeftOutDoNotMoveIt) {
  std::vector<ReachPoint> points = course(0.02, 0.004, 8, 60);
  std::erase_if(points, [](const ReachPoint& one) { return std::fmod(one.trial, 5) == 2; });
  EXPECT_NEAR(fit_learning(points).trials, 8, 1e-3);
}

TEST(Learning, SaysWhyThereIsNoCourse) {
  EXPECT_EQ(fit_learning(course(1, 0, 3, 5)).undefined, "fewer than 8 trials");
  std::vector<ReachPoint> flat = course(1, 1, 3, 40);
  EXPECT_EQ(fit_learning(flat).undefined, "no course over the trials");
  for (std::size_t i = 0; i < flat.size(); ++i) flat[i].value = i % 2 == 0 ? 1 : -1;
  EXPECT_EQ(fit_learning(flat).undefined, "no course over the trials");
  std::vector<ReachPoint> line;
  for (int i = 0; i < 40; ++i) line.push_back({static_cast<double>(i), 1.0 * i});
  EXPECT_EQ(fit_learning(line).undefined, "learnt more slowly than the trials show");
}

}  // namespace
}  // namespace palpate::analysis
