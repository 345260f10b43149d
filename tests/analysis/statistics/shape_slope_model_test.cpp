// The mixed model with effects of participant and shape against closed forms of balanced data.

#include "analysis/statistics/shape_slope_model.h"

#include <gtest/gtest.h>

#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <cstdint>
#include <vector>

#include "data/base/random.h"

namespace palpate::analysis {
namespace {

struct SimulatedSds {
  double level = 0.3, gain = 0.3, shape_level = 0.1, shape_gain = 0.2, residual = 0.4;
};

constexpr std::size_t kShapes = 4, kTrials = 12;

/// [renderer][shape][participant]
ParticipantCells simulated_cells(std::size_t people, const SimulatedSds& sds, std::uint64_t seed) {
  ParticipantCells cells(
      2, std::vector<std::vector<ParticipantCell>>(kShapes, std::vector<ParticipantCell>(people)));
  for (std::size_t p = 0; p < people; ++p) {
    Random random(seed, {0x55, p});
    const double level = sds.level * random.normal(), gain = sds.gain * random.normal();
    for (std::size_t s = 0; s < kShapes; ++s) {
      const double own = level + sds.shape_level * random.normal();
      const double own_gain = -0.2 + gain + sds.shape_gain * random.normal();
      for (std::size_t r = 0; r < 2; ++r) {
        std::vector<double> times;
        double sum = 0;
        for (std::size_t i = 0; i < kTrials; ++i) {
          times.push_back(1 + own + (r == 0 ? -0.5 : 0.5) * own_gain +
                          sds.residual * random.normal());
          sum += times.back();
        }
        ParticipantCell& cell = cells[r][s][p];
        cell.n_used = kTrials;
        cell.mean_log = sum / kTrials;
        for (const double time : times)
          cell.sum_of_squares_log += (time - cell.mean_log) * (time - cell.mean_log);
      }
    }
  }
  return cells;
}

/// Mean squares of participants' gains by shape: between participants, and of the rest.
struct GainSquares {
  double participants = 0, rest = 0;
};

GainSquares squares_of(const ParticipantCells& cells, std::size_t people) {
  std::vector<double> of_people(people, 0), of_shapes(kShapes, 0);
  double all = 0;
  const auto gain = [&](std::size_t s, std::size_t p) {
    return cells[1][s][p].mean_log - cells[0][s][p].mean_log;
  };
  const auto n = static_cast<double>(people);
  for (std::size_t s = 0; s < kShapes; ++s) {
    for (std::size_t p = 0; p < people; ++p) {
      of_people[p] += gain(s, p) / kShapes;
      of_shapes[s] += gain(s, p) / n;
      all += gain(s, p) / (n * kShapes);
    }
  }
  GainSquares out;
  for (const double one : of_people)
    out.participants += kShapes * (one - all) * (one - all) / (n - 1);
  for (std::size_t s = 0; s < kShapes; ++s) {
    for (std::size_t p = 0; p < people; ++p) {
      const double rest = gain(s, p) - of_people[p] - of_shapes[s] + all;
      out.rest += rest * rest / ((n - 1) * (kShapes - 1));
    }
  }
  return out;
}

// Of balanced data REML's variances are those of the analysis of variance, and Satterthwaite's
// degrees of freedom those of 1946.
TEST(ShapeSlopeModel, BalancedDataHaveTheClosedForm) {
  constexpr std::size_t kPeople = 14;
  for (const std::uint64_t seed : {1U, 2U}) {
    const ParticipantCells cells = simulated_cells(kPeople, {}, seed);
    const ShapeSlopeModel model = shape_slope_model(cells);
    ASSERT_TRUE(model.undefined.empty()) << model.undefined;
    EXPECT_TRUE(model.has_shape_gains());
    const GainSquares squares = squares_of(cells, kPeople);
    const double variance =
        (squares.participants + (kShapes - 1) * squares.rest) / (kShapes * kPeople);
    const double first = squares.participants / (kShapes * kPeople),
                 second = (kShapes - 1) * squares.rest / (kShapes * kPeople);
    const double df =
        variance * variance /
        (first * first / (kPeople - 1) + second * second / ((kPeople - 1) * (kShapes - 1)));
    for (std::size_t s = 0; s < kShapes; ++s) {
      double mean = 0;
      for (std::size_t p = 0; p < kPeople; ++p)
        mean += (cells[1][s][p].mean_log - cells[0][s][p].mean_log) / kPeople;
      const ModelEstimate& found = model.contrasts[s];
      EXPECT_NEAR(*found.estimate, mean, 1e-9);
      EXPECT_NEAR(*found.se, std::sqrt(variance), 1e-5);
      EXPECT_NEAR(*found.df_satterthwaite, df, 0.02);
    }
  }
}

TEST(ShapeSlopeModel, GainsAreTakenOutBeforeLevels) {
  SimulatedSds sds;
  sds.shape_level = sds.shape_gain = 0;
  bool none = false;
  for (std::uint64_t seed = 1; seed < 30 && !none; ++seed) {
    const ShapeSlopeModel model = shape_slope_model(simulated_cells(8, sds, seed));
    if (model.taken_out.size() < 2) continue;
    none = true;
    EXPECT_EQ(model.taken_out[0], "participants' gains do not differ between shapes");
    EXPECT_EQ(model.shape_gain_sd, 0);
    EXPECT_EQ(model.shape_level_sd, 0);
    EXPECT_FALSE(model.has_shape_gains());
  }
  EXPECT_TRUE(none);
}

TEST(ShapeSlopeModel, SmallDataAreRefusedWithTheReason) {
  EXPECT_EQ(shape_slope_model(simulated_cells(2, {}, 1)).undefined,
            "fewer than three participants with both renderers");
  ParticipantCells cells = simulated_cells(6, {}, 1);
  for (auto& renderer : cells) {
    for (auto& shape : renderer) {
      for (ParticipantCell& cell : shape) cell.n_used = 1;
    }
  }
  EXPECT_EQ(shape_slope_model(cells).undefined, "too few trials of a shape");
}

// 100 studies of four shapes: 5 % of 400 tests are 20.
TEST(ShapeSlopeModel, TestsKeepTheirLevelWhereGainsDiffer) {
  int significant = 0, tests = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    const ShapeSlopeModel model = shape_slope_model(simulated_cells(8, {}, seed + 500));
    for (const ModelEstimate& one : model.contrasts) {
      const double t = (*one.estimate + 0.2) / *one.se;
      const boost::math::students_t distribution(*one.df_satterthwaite);
      significant += 2 * cdf(complement(distribution, std::abs(t))) < 0.05 ? 1 : 0;
      ++tests;
    }
  }
  EXPECT_EQ(tests, 400);
  EXPECT_LE(significant, 34);
}

}  // namespace
}  // namespace palpate::analysis
