// All numbers of the analysis against R (fixtures/make_fixtures.R).

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "analysis/report/report.h"
#include "analysis/statistics/analysis.h"
#include "data/base/random.h"

namespace palpate::analysis {
namespace {

using Json = nlohmann::json;

const std::string kFixtures = PALPATE_SOURCE_DIR "/tests/analysis/fixtures/";

Json load(const std::string& name) {
  return Json::parse(std::ifstream(kFixtures + name + ".json"));
}

/// Largest difference from R. Closed forms: rounding. Mixed model: R's optimum and derivatives are
/// numerical, its degrees of freedom second differences.
double tolerance(const std::string& place, double expected) {
  const auto ends = [&](const char* end) { return place.ends_with(end); };
  const double size = std::fabs(expected);
  if (place.find("mixed_model") == std::string::npos) {
    const bool is_p = ends("/p") || ends("_p") || ends("p_holm") || ends("_p_box");
    return (is_p ? 1e-6 : 1e-8) * std::max(size, 1e-4);
  }
  if (ends("logLik_REML")) return 1e-4;
  if (ends("df_satterthwaite")) return 5e-3 * size;
  if (ends("_sd")) return 1e-3 * size;
  if (ends("_correlation")) return 1e-3;
  if (ends("/p") || ends("p_holm")) return 1e-2 * size + 1e-9;
  if (ends("/se") || ends("/t")) return 1e-4 * std::max(size, 1e-3);
  if (ends("_low") || ends("_high")) return 2e-3 * std::max(size, 1e-2);
  return 1e-5 * std::max(size, 1e-3);
}

/// Every value of the oracle must be present and agree; other values are ignored.
void expect_agrees(const Json& expected, const Json& actual, const std::string& place) {
  if (expected.is_object()) {
    ASSERT_TRUE(actual.is_object()) << place;
    for (const auto& [key, value] : expected.items()) {
      ASSERT_TRUE(actual.contains(key)) << place << "/" << key;
      expect_agrees(value, actual[key], place + "/" + key);
    }
    const std::string status = expected.value("status", "");
    if (status == "undefined" || status == "singular") {
      EXPECT_FALSE(actual.value("reason", "").empty()) << place;
    }
  } else if (expected.is_number()) {
    ASSERT_TRUE(actual.is_number()) << place << " is " << actual;
    const double e = expected, a = actual;
    EXPECT_LE(std::fabs(a - e), tolerance(place, e))
        << place << ": expected " << e << ", found " << a;
  } else {
    EXPECT_EQ(expected, actual) << place;
  }
}

class Oracle : public ::testing::TestWithParam<const char*> {};

TEST_P(Oracle, AgreesWithR) {
  const std::string name = GetParam();
  const Analysis analysis = analyze(read_trials_csv(kFixtures + name + ".csv"), {}, "test");
  const Json expected = load(name), actual = Json::parse(report_json(analysis));
  expect_agrees(expected, actual, name);
  for (const char* section : {"accuracy", "confusion", "times"}) {
    EXPECT_EQ(expected[section].size(), actual[section].size()) << section;
    for (const auto& [renderer, shapes] : expected[section].items()) {
      EXPECT_EQ(shapes.size(), actual[section][renderer].size()) << section << " " << renderer;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Fixtures, Oracle,
                         ::testing::Values("full", "nine_columns", "gaps", "one_person",
                                           "two_people", "one_renderer", "no_variance", "balanced",
                                           "uneven", "singular_correlation", "singular_no_slope",
                                           "singular_alike", "no_residual", "one_shape",
                                           "single_trials", "four_people", "between_people"),
                         [](const auto& param) { return std::string(param.param); });

TEST(WilcoxonOracle, AgreesWithAllSignsWrittenOut) {
  for (const Json& set : load("wilcoxon")) {
    const Wilcoxon test = wilcoxon(set["differences"].get<std::vector<double>>());
    ASSERT_EQ(test.undefined, "") << set["differences"];
    EXPECT_DOUBLE_EQ(*test.positive_rank_sum, set["V"].get<double>()) << set["differences"];
    EXPECT_EQ(test.n_nonzero, set["n_nonzero"].get<std::size_t>()) << set["differences"];
    EXPECT_NEAR(*test.p, set["p"].get<double>(), 1e-12) << set["differences"];
  }
}

TEST(BootstrapOracle, SameResamplesGiveTheSameInterval) {
  for (const Json& set : load("bca")) {
    auto means = set["means"].get<std::vector<double>>();
    const Bootstrap found = bca_interval(set["differences"].get<std::vector<double>>(), means);
    ASSERT_EQ(found.undefined, "");
    const Json& expected = set["expected"];
    EXPECT_NEAR(*found.bias_correction, expected["z0"].get<double>(), 1e-10);
    EXPECT_NEAR(*found.acceleration, expected["a"].get<double>(), 1e-10);
    EXPECT_NEAR(found.log_ratio_ci95->low, expected["low"].get<double>(), 1e-10);
    EXPECT_NEAR(found.log_ratio_ci95->high, expected["high"].get<double>(), 1e-10);
  }
}

TEST(BootstrapOracle, OwnResamplesComeCloseToMany) {
  for (const Json& set : load("bca")) {
    constexpr std::uint64_t kSeed = 1;
    Random random(kSeed);
    const Bootstrap found = bootstrap_mean(set["differences"].get<std::vector<double>>(), random);
    ASSERT_EQ(found.undefined, "");
    EXPECT_EQ(found.resamples, 9999U);
    const auto near = [&](double found_end, int i) {
      EXPECT_NEAR(found_end, set["limit"][i].get<double>(), 5 * set["scatter"][i].get<double>());
    };
    near(found.log_ratio_ci95->low, 0);
    near(found.log_ratio_ci95->high, 1);
  }
}

}  // namespace
}  // namespace palpate::analysis
