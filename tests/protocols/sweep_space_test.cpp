#include "protocols/sweep_space.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>

#include "protocols/parse.h"

namespace palpate::protocols {
namespace {

namespace fs = std::filesystem;

const std::string kSpaces = PALPATE_SOURCE_DIR "/tests/protocols/spaces/";

std::vector<fs::path> spaces(const std::string& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".json") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

TEST(SweepSpace, AcceptsGoodFilesAndThePublishedOnes) {
  for (const std::string& folder :
       {kSpaces + "good", std::string(PALPATE_SOURCE_DIR "/protocols/spaces")}) {
    EXPECT_FALSE(spaces(folder).empty());
    for (const fs::path& file : spaces(folder)) {
      std::ostringstream whole;
      whole << std::ifstream(file).rdbuf();
      SweepSpace space;
      EXPECT_NO_THROW(space = parse_sweep_space(file.string())) << file;
      EXPECT_EQ(space.source_text, whole.str()) << "kept with the study, byte for byte";
    }
  }
}

TEST(SweepSpace, NamesEveryFaultOfBadFiles) {
  EXPECT_GE(spaces(kSpaces + "bad").size(), 15u);
  for (const fs::path& file : spaces(kSpaces + "bad")) {
    std::vector<std::string> expected, found;
    std::ifstream lines(fs::path(file).replace_extension(".faults"));
    for (std::string line; std::getline(lines, line);) expected.push_back(line);
    try {
      parse_sweep_space(file.string());
      ADD_FAILURE() << file << " is accepted";
    } catch (const InputError& error) {
      for (const Fault& fault : error.faults()) found.push_back(fault.location);
    }
    std::sort(expected.begin(), expected.end());
    std::sort(found.begin(), found.end());
    EXPECT_EQ(found, expected) << file;
  }
}

SweepParameter with_limits(DistributionKind kind, double low, double high) {
  SweepParameter one;
  one.distribution = kind;
  one.low = low;
  one.high = high;
  return one;
}

TEST(SweepSpace, SharesBecomeValues) {
  const SweepParameter uniform = with_limits(DistributionKind::uniform, -2, 6);
  EXPECT_EQ(uniform.value_at(0), -2.0);
  EXPECT_EQ(uniform.value_at(0.25), 0.0);
  EXPECT_EQ(uniform.value_at(1), 6.0);
  const SweepParameter log_uniform = with_limits(DistributionKind::log_uniform, 0.01, 1);
  EXPECT_DOUBLE_EQ(log_uniform.value_at(0.5).get<double>(), 0.1);
  EXPECT_EQ(log_uniform.value_at(1), 1.0);
}

// A share of a normal distribution truncated at both ends, by numerical integration.
TEST(SweepSpace, NormalDistributionsAreTruncated) {
  for (const auto& [low, high] : {std::pair(5.0, 30.0), std::pair(14.0, 15.5),
                                  std::pair(35.0, 60.0), std::pair(-40.0, -25.0)}) {
    SweepParameter one = with_limits(DistributionKind::normal, low, high);
    one.mean = 15;
    one.sd = 4;
    const auto density = [&](double x) {
      return std::exp(-std::pow((x - one.mean) / one.sd, 2) / 2);
    };
    constexpr int kSteps = 200000;
    const double step = (high - low) / kSteps;
    double whole = 0;
    for (int i = 0; i < kSteps; ++i) whole += density(low + (i + 0.5) * step);
    EXPECT_EQ(one.value_at(0), low);
    EXPECT_NEAR(one.value_at(1).get<double>(), high, 1e-9 * std::abs(high));
    double below = 0;
    int i = 0;
    for (const double share : {0.01, 0.25, 0.5, 0.9, 0.999}) {
      const auto value = one.value_at(share).get<double>();
      for (; low + (i + 0.5) * step < value && i < kSteps; ++i)
        below += density(low + (i + 0.5) * step);
      EXPECT_NEAR(below / whole, share, 2e-4) << low << " " << share;
    }
  }
}

/// The share below z of a standard normal distribution truncated at `low` and `high`, from
/// logarithms of the density at steps of its own width, so that no tail is too far.
double cut_share(double low, double high, double z) {
  const double peak = low > 0 ? low : high < 0 ? high : 0;
  const auto density = [&](double x) { return std::exp((peak - x) * (peak + x) / 2); };
  // Beyond 40 widths of the peak the density is zero.
  const double width = 40 / std::max(1.0, std::abs(peak));
  const double from = std::max(low, peak - width), to = std::min(high, peak + width);
  constexpr int kSteps = 100000;
  const double step = (to - from) / kSteps;
  double below = 0, whole = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double x = from + (i + 0.5) * step;
    whole += density(x);
    below += density(x) * std::clamp((z - x) / step + 0.5, 0.0, 1.0);
  }
  return below / whole;
}

TEST(SweepSpace, FarTailsOfNormalDistributionsAreRight) {
  for (const auto& [low, high] :
       {std::pair(36.9, 60.0), std::pair(20.0, 20.01), std::pair(8.0, 1e6), std::pair(-3.0, 1e300),
        std::pair(5.0, 5 + 1e-9), std::pair(0.0, 1e-12), std::pair(-1e-13, 1e-13)}) {
    SweepParameter above = with_limits(DistributionKind::normal, low, high);
    SweepParameter below = with_limits(DistributionKind::normal, -high, -low);
    for (const double share : {0.0, 1e-9, 0.001, 0.1, 0.3, 0.5, 0.8, 0.97, 1 - 1e-9, 1.0}) {
      const auto value = above.value_at(share).get<double>();
      EXPECT_NEAR(cut_share(low, high, value), share, 2e-5) << low << " " << share;
      EXPECT_NEAR(cut_share(-high, -low, below.value_at(1 - share).get<double>()), 1 - share, 2e-5);
    }
  }
  // The last share below 1 does not give the limit.
  const SweepParameter wide = with_limits(DistributionKind::normal, -1, 1000);
  EXPECT_NEAR(wide.value_at(1 - 0x1p-53).get<double>(), 8.2, 0.2);
}

// A uniform logarithm: equal shares are equal ratios, whatever the ratio of the limits.
TEST(SweepSpace, LogUniformLimitsMayBeManyDecadesApart) {
  for (const double low : {1e-3, 1e-300, 1e-310}) {
    const SweepParameter one = with_limits(DistributionKind::log_uniform, low, 1e12);
    for (const double share : {0.0, 0.01, 0.25, 0.5, 0.75, 0.99, 1.0}) {
      const double decades = std::log10(one.value_at(share).get<double>());
      EXPECT_NEAR((decades - std::log10(low)) / (12 - std::log10(low)), share, 1e-9) << low;
    }
  }
}

TEST(SweepSpace, ChoicesHaveEqualParts) {
  SweepParameter one;
  one.distribution = DistributionKind::choice;
  one.values = {1, "two", false};
  EXPECT_EQ(one.value_at(0), 1);
  EXPECT_EQ(one.value_at(0.333), 1);
  EXPECT_EQ(one.value_at(0.334), "two");
  EXPECT_EQ(one.value_at(0.99), false);
  EXPECT_EQ(one.value_at(1), false);
}

}  // namespace
}  // namespace palpate::protocols
