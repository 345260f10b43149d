#include "analysis/report/hypotheses.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "protocols/parse.h"

namespace palpate::analysis {
namespace {

constexpr const char* kAnalysis = R"({"version": 1, "simulated": true, "warnings": ["x", 3],
  "counts": {"accuracy": 0.75},
  "paired_by_shape": {
    "cone": {"status": "ok", "n_pairs": 7, "mean_log_ratio": -0.3, "percent_reduction_geometric": 26,
      "t_test": {"t": -4.0, "df": 6, "p": 0.007, "p_holm": 0.02, "percent_reduction_ci95_low": 12,
                 "percent_reduction_ci95_high": 38},
      "effect_size": {"dz": -1.5, "hedges_gz": null}, "wilcoxon": {"p": 0.03}},
    "my-cube": {"percent_reduction_geometric": 3, "t_test": {"p_holm": null}}},
  "mixed_model": {"contrasts_ray_minus_point": {"cone": {"p_holm": 0.01, "percent_reduction": 25}}},
  "rm_anova": {"effects": {"renderer:shape": {"p": 0.5, "F": 2}}}})";

Verdict verdict(const std::string& corroborated, const std::string& refuted) {
  return judge({"H1", "text", corroborated, refuted}, named_results(kAnalysis, 0.05)).verdict;
}

std::string faults_of(const std::string& text, const NamedResults& known = {}) {
  try {
    read_hypotheses(text, "h.json", known);
  } catch (const protocols::InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Hypotheses, NumbersHaveTheirKeysAndShortNames) {
  const NamedResults results = named_results(kAnalysis, 0.05);
  EXPECT_EQ(results.at("paired_by_shape.cone.t_test.p_holm"), 0.02);
  EXPECT_EQ(results.at("paired.cone.p_holm"), 0.02);
  EXPECT_EQ(results.at("paired.cone.p"), 0.007);
  EXPECT_EQ(results.at("paired.cone.reduction"), 26);
  EXPECT_EQ(results.at("paired.cone.ci95_low"), 12);
  EXPECT_EQ(results.at("paired.cone.ci95_high"), 38);
  EXPECT_EQ(results.at("paired.cone.n_pairs"), 7);
  EXPECT_EQ(results.at("paired.cone.wilcoxon_p"), 0.03);
  EXPECT_TRUE(std::isnan(results.at("paired.cone.hedges_gz")));
  EXPECT_TRUE(std::isnan(results.at("paired.my-cube.p_holm")));
  EXPECT_EQ(results.at("model.cone.p_holm"), 0.01);
  EXPECT_EQ(results.at("anova.renderer:shape.p"), 0.5);
  EXPECT_EQ(results.at("simulated"), 1);
  EXPECT_EQ(results.at("alpha"), 0.05);
  EXPECT_FALSE(results.contains("warnings.1"));
  EXPECT_FALSE(results.contains("paired.cone.nonsense"));
}

TEST(Hypotheses, VerdictsFollowTheirConditions) {
  EXPECT_EQ(verdict("paired.cone.p_holm < 0.05 && paired.cone.reduction > 0",
                    "paired.cone.ci95_high < 5"),
            Verdict::corroborated);
  EXPECT_EQ(verdict("paired.cone.reduction < 0", "paired.cone.ci95_high > 5"), Verdict::refuted);
  EXPECT_EQ(verdict("paired.cone.reduction < 0", "paired.cone.ci95_high < 5"), Verdict::undecided);
  EXPECT_EQ(verdict("paired.cone.p < alpha", "paired.cone.p < 1"), Verdict::undecided) << "both";
  EXPECT_EQ(verdict("'paired.my-cube.p_holm' < 0.05", "counts.accuracy < 0.5"), Verdict::undecided);
  EXPECT_EQ(verdict("counts.accuracy > 0.5", "'paired.my-cube.p_holm' < 0.05"), Verdict::undecided);
  EXPECT_EQ(verdict("'anova.renderer:shape.p' > 0.1", "there.is.no.such > 1 && 1 > 2"),
            Verdict::corroborated);
}

TEST(Hypotheses, ReportsNumbersUsed) {
  const Judgement judgement =
      judge({"H1", "", "paired.cone.p_holm < alpha", "paired.cone.p_holm > 0.5 || none.such > 1"},
            named_results(kAnalysis, 0.05));
  ASSERT_EQ(judgement.numbers.size(), 3U);
  EXPECT_EQ(judgement.numbers[0].first, "paired.cone.p_holm");
  EXPECT_EQ(judgement.numbers[1].first, "alpha");
  EXPECT_TRUE(std::isnan(judgement.numbers[2].second));
}

TEST(Hypotheses, RefusesNamesUnknownToTheAnalysis) {
  const std::string said = faults_of(
      R"([{"id": "H1", "text": "t", "corroborated": "paired.cone.p_hol < 0.05", "refuted": "paired.cube.p > 1"}])",
      named_results(kAnalysis, 0.05));
  EXPECT_NE(said.find("/0/corroborated"), std::string::npos) << said;
  EXPECT_NE(said.find("did you mean paired.cone.p_holm?"), std::string::npos) << said;
  EXPECT_NE(said.find("/0/refuted"), std::string::npos) << said;
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1) << "a line for each fault\n" << said;
}

TEST(Hypotheses, ReachAccuracyEquivalenceAndTasksByName) {
  const NamedResults found = named_results(R"({
    "accuracy_comparison": {"primary": {"difference": 0.125, "least_bound": 0.25, "p": null}},
    "paired_by_shape": {"cone": {"t_test": {"least_bound": 0.375, "bf10": 3}}},
    "identification": {"counts": {"accuracy": 0.5}},
    "jnd": {"stiff": {"ratio": 0.75}}, "equivalence": {"jnd": {"stiff": {"least_bound": 0.625}}}})",
                                           0.05);
  EXPECT_EQ(found.at("accuracy.difference"), 0.125);
  EXPECT_EQ(found.at("equivalence.accuracy.least_bound"), 0.25);
  EXPECT_TRUE(std::isnan(found.at("accuracy.p")));
  EXPECT_EQ(found.at("equivalence.cone.least_bound"), 0.375);
  EXPECT_EQ(found.at("paired.cone.bf10"), 3);
  EXPECT_EQ(found.at("counts.accuracy"), 0.5);
  EXPECT_EQ(found.at("identification.counts.accuracy"), 0.5);
  EXPECT_EQ(found.at("jnd.stiff.ratio"), 0.75);
  EXPECT_EQ(found.at("equivalence.jnd.stiff.least_bound"), 0.625);
}

TEST(Hypotheses, EveryFaultOfAFileIsSaid) {
  const std::string good = R"("text": "t", "corroborated": "alpha < 1", "refuted": "alpha > 1")";
  EXPECT_EQ(faults_of(R"([{"id": "H1", )" + good + "}]"), "");
  for (const auto& [text, words] : std::vector<std::pair<std::string, std::string>>{
           {"{}", "expected a list"},
           {"[]", "expected a list"},
           {R"([{"id": "H 1", )" + good + "}]", "letters, digits"},
           {R"([{"id": "H1", )" + good + R"(}, {"id": "H1", )" + good + "}]", "each id once"},
           {R"([{"id": "H1", "more": 1, )" + good + "}]", "/0/more"},
           {R"([{"id": "H1"}])", "/0/refuted"},
           {R"([{"id": "H1", "text": "t", "corroborated": "1 < 2", "refuted": "alpha > 1"}])",
            "always the same"},
           {R"([{"id": "H1", "text": "t", "corroborated": "alpha", "refuted": "alpha > 1"}])",
            "this is a number"},
           {R"([{"id": "H1", "text": 7, "corroborated": "alpha >", "refuted": "alpha > 1"}])",
            "/0/text"},
           {"[1]", "/0"},
           {"[", "line 1"}}) {
    EXPECT_NE(faults_of(text).find(words), std::string::npos) << text << "\n" << faults_of(text);
  }
}

}  // namespace
}  // namespace palpate::analysis
