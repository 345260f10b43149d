// The rates at which soft bodies may be stepped: the map in rendering/README.md, and the cost of a
// step.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>

#include "rendering/bodies/soft/soft_build.h"

namespace palpate::rendering {
namespace {
namespace soft_rates {

constexpr std::array kRates{62.5, 125.0, 250.0, 500.0, 1000.0};  // Hz

/// The lowest rate at which a material comes to rest. \param young  Pa. \param damping  s
double lowest(double young, double damping) {
  for (const double rate : kRates) {
    if (coupling_is_stable({.young = young, .damping = damping}, rate)) return rate;
  }
  return std::numeric_limits<double>::infinity();
}

TEST(SoftRates, EqualMapInReadme) {
  std::ifstream in(PALPATE_SOURCE_DIR "/rendering/README.md");
  const std::string readme{std::istreambuf_iterator<char>(in), {}};
  struct Row {
    const char* text;
    double young, damped, undamped;  // Pa, Hz
  };
  for (const Row& row :
       {Row{"| 1 kPa | refused | refused | refused | at rest |", 1e3, 500, 500},
        Row{"| 10 kPa | refused | refused | at rest | at rest |", 1e4, 250, 250},
        Row{"| 100 kPa | refused | at rest; with less damping than 10 ms refused | at rest |", 1e5,
            125, 250},
        Row{"| 1 MPa, 10 MPa | at rest | at rest | at rest | at rest |", 1e6, 62.5, 62.5},
        Row{"| 1 MPa, 10 MPa | at rest | at rest | at rest | at rest |", 1e7, 62.5, 62.5}}) {
    EXPECT_NE(readme.find(row.text), std::string::npos) << row.text;
    EXPECT_EQ(lowest(row.young, 0.01), row.damped) << row.young << " Pa";
    EXPECT_EQ(lowest(row.young, 0.00999), row.undamped) << row.young << " Pa";
    EXPECT_EQ(lowest(row.young, 0), row.undamped) << row.young << " Pa";
  }
  // Every higher rate is stable, too.
  for (const double young : {1e3, 1e4, 1e5, 1e6}) {
    for (const double rate : kRates)
      EXPECT_EQ(coupling_is_stable({.young = young, .damping = 0.01}, rate),
                rate >= lowest(young, 0.01));
  }
}

TEST(SoftRates, LimitsAreTenTwentyAndAThousandKilopascal) {
  const auto just_below = [](double limit) { return std::nextafter(limit, 0); };
  EXPECT_EQ(lowest(just_below(1e4), 0.01), lowest(1e3, 0.01));
  EXPECT_EQ(lowest(just_below(2e4), 0.01), lowest(1e4, 0.01));
  EXPECT_EQ(lowest(2e4, 0.01), lowest(1e5, 0.01));
  EXPECT_EQ(lowest(just_below(1e6), 0.01), lowest(1e5, 0.01));
  EXPECT_EQ(lowest(just_below(1e6), 0), lowest(1e5, 0));
}

/// Steps take at most a quarter of their time, and would take more at twice the rate.
TEST(SoftRates, HasHighestRateUsingAQuarterOfTime) {
  for (const double young : {2e4, 3e6}) {
    for (int resolution = 2; resolution <= (young < 1e5 ? 8 : 10); ++resolution) {
      stimuli::ObjectSpec spec;
      spec.shape = stimuli::ShapeKind::cube;
      spec.edge = 0.05;
      spec.soft = stimuli::Soft{.young = young, .points = {}, .resolution = resolution};
      const auto object = build_soft_object(spec, Pose{}, {});
      const SoftBody& body = *object->body;
      const double cost = step_cost(body.mesh().hexahedra.size(), body.mesh().tetrahedra.size(),
                                    body.factor_entries());
      const double step = body.settings().step;
      EXPECT_TRUE(std::ranges::count(kRates, 1 / step) == 1) << 1 / step;
      EXPECT_LE(cost, step / 4) << resolution;
      if (step > 0.001) {
        EXPECT_GT(cost, step / 8) << resolution;
      }
    }
  }
}

}  // namespace soft_rates
}  // namespace
}  // namespace palpate::rendering
