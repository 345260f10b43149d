// Ranges, ticks and tick labels of axes, from their definitions.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "analysis/figures/panel_drawing.h"

namespace palpate::analysis {
namespace {

std::vector<std::string> labels_of(const FigureAxis& axis) {
  std::vector<std::string> labels;
  for (const Tick& tick : axis.ticks) labels.push_back(tick.label);
  return labels;
}

/// The number that a label shows; its minus is U+2212.
double value_of(std::string label) {
  const std::string minus = "−";
  if (label.starts_with(minus)) label = "-" + label.substr(minus.size());
  return std::stod(label);
}

/// A step's first digit: 1, 2 or 5 for a round one.
double first_digit(double step) {
  const double digit = step / std::pow(10, std::floor(std::log10(step) + 1e-9));
  return std::round(digit * 1e6) / 1e6;
}

TEST(LinearAxis, EndsAtTicksThatEncloseTheRange) {
  const std::vector<std::pair<double, double>> ranges{
      {0, 1}, {0, 7.3}, {-3, 4}, {-0.0021, 0.0034}, {12, 985}, {-150, 60}, {0, 0.99}, {1e-5, 3e-5}};
  for (const auto& [low, high] : ranges) {
    const FigureAxis axis = linear_axis(low, high, "time (s)");
    EXPECT_EQ(axis.title, "time (s)");
    ASSERT_GE(axis.ticks.size(), 4U);
    EXPECT_LE(axis.ticks.size(), 11U) << low << " to " << high;
    const double step = axis.ticks[1].at - axis.ticks[0].at;
    EXPECT_TRUE(first_digit(step) == 1 || first_digit(step) == 2 || first_digit(step) == 5) << step;
    EXPECT_EQ(axis.low, axis.ticks.front().at);
    EXPECT_NEAR(axis.high, axis.ticks.back().at, 1e-9 * step);
    EXPECT_LE(axis.low, low + 1e-6 * step);
    EXPECT_GT(axis.low, low - step);
    EXPECT_GE(axis.high, high - 1e-6 * step);
    EXPECT_LT(axis.high, high + step);
    for (std::size_t i = 0; i < axis.ticks.size(); ++i) {
      const double at = axis.ticks[i].at;
      EXPECT_NEAR(at, axis.low + static_cast<double>(i) * step, 1e-9 * step);
      EXPECT_NEAR(at / step, std::round(at / step), 1e-6) << "a multiple of the step";
      EXPECT_NEAR(value_of(axis.ticks[i].label), at, 1e-9 * step) << "labels are exact";
    }
  }
}

TEST(LinearAxis, HasAboutFiveSteps) {
  using Labels = std::vector<std::string>;
  EXPECT_EQ(labels_of(linear_axis(0, 100, "")), (Labels{"0", "20", "40", "60", "80", "100"}));
  EXPECT_EQ(labels_of(linear_axis(-1, 1, "")), (Labels{"−1.0", "−0.5", "0.0", "0.5", "1.0"}));
  EXPECT_EQ(labels_of(linear_axis(0, 4, "")), (Labels{"0", "1", "2", "3", "4"}));
  EXPECT_EQ(labels_of(linear_axis(0, 0.02, "")),
            (Labels{"0.000", "0.005", "0.010", "0.015", "0.020"}));
}

TEST(LinearAxis, HasAWidthForOneValue) {
  for (const double value : {0.0, 3.0, -2.5}) {
    const FigureAxis axis = linear_axis(value, value, "");
    EXPECT_LE(axis.low, value);
    EXPECT_GT(axis.high, value);
  }
}

TEST(LogAxis, HasTicksAtOneTwoAndFive) {
  const FigureAxis axis = log_axis(std::log10(0.015), std::log10(6000), "time");
  EXPECT_TRUE(axis.grid);
  EXPECT_FALSE(axis.names);
  EXPECT_EQ(axis.low, std::log10(0.015));
  EXPECT_EQ(axis.high, std::log10(6000));
  for (const Tick& tick : log_axis(-1, 1.3, "").ticks) {
    EXPECT_NEAR(std::pow(10, tick.at), value_of(tick.label), 1e-9 * value_of(tick.label));
  }
  using Labels = std::vector<std::string>;
  EXPECT_EQ(labels_of(log_axis(0, 1, "")), (Labels{"1", "2", "5", "10"})) << "ends included";
  EXPECT_EQ(labels_of(log_axis(-1.9, 1.5, "")),
            (Labels{"0.02", "0.05", "0.1", "0.2", "0.5", "1", "2", "5", "10", "20"}));
  EXPECT_EQ(labels_of(log_axis(3.5, 5.5, "")),
            (Labels{"5000", "10000", "20000", "50000", "10⁵", "2·10⁵"}));
  EXPECT_EQ(labels_of(log_axis(-4.8, -2.9, "")),
            (Labels{"2·10⁻⁵", "5·10⁻⁵", "10⁻⁴", "2·10⁻⁴", "5·10⁻⁴", "0.001"}));
}

TEST(LogAxis, HasFewerTicksOverManyDecades) {
  EXPECT_EQ(labels_of(log_axis(-1, 3, "")),
            (std::vector<std::string>{"0.1", "1", "10", "100", "1000"}));
  EXPECT_EQ(log_axis(0, 3.5, "").ticks.size(), 11U) << "3.5 decades still have 2 and 5";
  std::vector<double> at;
  for (const Tick& tick : log_axis(0, 20, "").ticks) at.push_back(tick.at);
  EXPECT_EQ(at, (std::vector<double>{0, 3, 6, 9, 12, 15, 18}));
  EXPECT_EQ(log_axis(-12, 12, "").ticks.front().label, "10⁻¹²");
  EXPECT_EQ(log_axis(0, 9, "").ticks.size(), 10U) << "nine decades have every power";
}

TEST(LogAxis, EnclosesASingleValue) {
  for (const double value : {0.0, 1.0, -2.0}) {
    const FigureAxis axis = log_axis(value, value, "");
    EXPECT_LT(axis.low, value);
    EXPECT_GT(axis.high, value);
    ASSERT_EQ(axis.ticks.size(), 1U);
    EXPECT_EQ(axis.ticks[0].at, value);
  }
}

TEST(DecadesAxis, EndsAtPowersOfTen) {
  const auto ends = [](double low, double high) {
    const FigureAxis axis = decades_axis(low, high, "");
    return std::pair(axis.low, axis.high);
  };
  EXPECT_EQ(ends(0.3, 40), std::pair(-1.0, 2.0));
  EXPECT_EQ(ends(1, 100), std::pair(0.0, 2.0)) << "whole powers stay";
  EXPECT_EQ(ends(10, 10), std::pair(1.0, 2.0)) << "one decade at least";
  EXPECT_EQ(decades_axis(1, 10, "error (m)").title, "error (m)");
}

TEST(NamesAxis, PutsANameInEachSlotsMiddle) {
  const FigureAxis axis = names_axis({"cone", "cube", "plate"}, 2, "shape");
  EXPECT_TRUE(axis.names);
  EXPECT_FALSE(axis.grid);
  EXPECT_EQ(axis.title, "shape");
  EXPECT_EQ(axis.low, 0);
  EXPECT_EQ(axis.high, 2);
  ASSERT_EQ(axis.ticks.size(), 2U);
  EXPECT_EQ(axis.ticks[0].at, 0.5);
  EXPECT_EQ(axis.ticks[1].at, 1.5);
  EXPECT_EQ(axis.ticks[1].label, "cube");
  EXPECT_EQ(names_axis({}, 0, "").high, 1) << "low < high without names too";
}

}  // namespace
}  // namespace palpate::analysis
