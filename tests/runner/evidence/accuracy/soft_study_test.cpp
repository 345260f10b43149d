// The rows of soft bodies: each number under its name, errors by their definition, and bounds that
// follow from the references.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <set>
#include <string>
#include <vector>

#include "runner/evidence/accuracy/analytic_stroke.h"
#include "runner/evidence/accuracy/body_study.h"

namespace palpate::runner::evidence {
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
    // Rows of forces alone make no steps, and no step is timed twice.
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
  EXPECT_LT(error_of("cylinder on a slab, 16"), 0.7 * error_of("cylinder on a slab, 8"));
  EXPECT_LT(error_of("rest shape"), 1e-6) << "let go, it comes back";
  EXPECT_LT(error_of("volume"), 0.02)
      << "Poisson's ratio 0.49 lets the volume change by 2 % of strain";
}

/// m/Pa: deflection of the top of a bonded layer under a pressure of cos(k x), by Navier's
/// equations across it. State: the displacements along (of sin) and outwards (of cos), and the
/// stresses on planes of equal depth, along and outwards.
double layer_gives(double k, const LineContact& layer) {
  const double mu = layer.young / (2 + 2 * layer.poisson);
  const double lambda = 2 * mu * layer.poisson / (1 - 2 * layer.poisson), normal = lambda + 2 * mu;
  using State = std::array<double, 4>;
  const auto slope = [&](const State& s) {
    const double out = (s[3] - lambda * k * s[0]) / normal;  // d w / dz
    return State{s[2] / mu + k * s[1], out, k * (normal * k * s[0] + lambda * out), -k * s[2]};
  };
  const auto across = [&](State s) {
    const int steps = 400 + static_cast<int>(100 * k * layer.thickness);
    const double h = layer.thickness / steps;
    const auto plus = [](const State& a, double f, const State& b) {
      return State{a[0] + f * b[0], a[1] + f * b[1], a[2] + f * b[2], a[3] + f * b[3]};
    };
    for (int i = 0; i < steps; ++i) {
      const State a = slope(s), b = slope(plus(s, h / 2, a)), c = slope(plus(s, h / 2, b)),
                  d = slope(plus(s, h, c));
      for (std::size_t n = 0; n < 4; ++n) s[n] += h / 6 * (a[n] + 2 * b[n] + 2 * c[n] + d[n]);
    }
    return s;
  };
  // Two tractions at the base, chosen so that the top has no shear and a stress of -1.
  const State one = across({0, 0, 1, 0}), two = across({0, 0, 0, 1});
  const double det = one[2] * two[3] - two[2] * one[3];
  return (one[2] * two[1] - two[2] * one[1]) / det;
}

/// N/m, of a parabola pressed into that layer, by strips of even pressure without tension.
double pressed_strips(const LineContact& layer, double depth, double wide) {
  constexpr int kStrips = 60, kSweeps = 4000;
  const double strip = wide / kStrips, h = 0.02 / wide;
  std::array<double, kStrips> gives{};  // deflection of the middle of a strip this many strips away
  for (int i = 0; i < 20000; ++i) {
    const double k = i > 0 ? h * i : 1e-3 * h, part = i > 0 ? h : h / 2;
    const double thick = k * layer.thickness;
    const double modulus = layer.young / (1 - layer.poisson * layer.poisson);
    const double give = thick < 8 ? layer_gives(k, layer) : 2 / (modulus * k);
    const double wave = 2 * std::sin(k * strip / 2) / k;
    for (std::size_t n = 0; n < kStrips; ++n)
      gives[n] +=
          part / std::numbers::pi * give * wave * std::cos(k * strip * static_cast<double>(n));
  }
  std::vector<double> pressure(kStrips);
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    for (std::size_t i = 0; i < kStrips; ++i) {
      const double x = (static_cast<double>(i) + 0.5) * strip - wide / 2;
      double gap = x * x / (2 * layer.radius) - depth;
      for (std::size_t j = 0; j < kStrips; ++j) gap += gives[i > j ? i - j : j - i] * pressure[j];
      pressure[i] = std::max(0.0, pressure[i] - gap / gives[0]);
    }
  }
  return strip * std::accumulate(pressure.begin(), pressure.end(), 0.0);
}

TEST(LineContact, IsWhatStripsOfPressureOnALayerGive) {
  for (const double poisson : {0.0, 0.3}) {
    const LineContact layer{.poisson = poisson};
    const double depth = line_depth(layer, 0.008);
    const double strips = pressed_strips(layer, depth, 0.022);
    EXPECT_NEAR(line_force(layer, depth) / strips, 1, 0.01) << poisson;
  }
}

}  // namespace soft_rows
}  // namespace
}  // namespace palpate::runner::evidence
