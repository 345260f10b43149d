// The mixed model of answers to levels, against R's glmer (fixtures/make_answers.R) and
// against simulated people.

#include "analysis/statistics/probit_mixed_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <fstream>
#include <nlohmann/json.hpp>
#include <vector>

#include "data/base/random.h"

namespace palpate::analysis {
namespace {

using Json = nlohmann::json;

Json studies_fixture() {
  std::ifstream file(PALPATE_SOURCE_DIR "/tests/analysis/fixtures/answers.json");
  return Json::parse(file)["studies"];
}

std::vector<LevelAnswers> answers_of(const Json& study) {
  std::vector<LevelAnswers> out;
  for (std::size_t i = 0; i < study["place"].size(); ++i)
    out.push_back({study["participant"][i], study["cell"][i], study["place"][i], study["trials"][i],
                   study["successes"][i]});
  return out;
}

double error_of(const ProbitMixedModel& model, Eigen::Index coefficient) {
  return std::sqrt(model.covariance(coefficient, coefficient));
}

TEST(ProbitMixedModel, AgreesWithGlmer) {
  std::size_t number = 0;
  for (const Json& study : studies_fixture()) {
    SCOPED_TRACE(number++);
    const ProbitMixedModel model = fit_probit_mixed(answers_of(study), study["cells"]);
    ASSERT_EQ(model.undefined, "");
    EXPECT_NEAR(model.log_likelihood, study["log_likelihood"], 1e-5);
    const Json& spread = study["variances"];
    const double level = spread[0], shared = spread[1], slope = spread[2];
    EXPECT_EQ(model.singular, level * slope - shared * shared < 1e-8);
    EXPECT_NEAR(model.spread(0, 0), spread[0], 1e-4);
    EXPECT_NEAR(model.spread(0, 1), spread[1], 1e-4);
    EXPECT_NEAR(model.spread(1, 1), spread[2], 1e-4);
    for (Eigen::Index cell = 0; cell < study["cells"]; ++cell) {
      const Json& expected = study["figures"][static_cast<std::size_t>(cell)];
      EXPECT_NEAR(model.coefficients[2 * cell], expected["intercept"], 1e-5);
      EXPECT_NEAR(model.coefficients[2 * cell + 1], expected["slope"], 1e-5);
      EXPECT_NEAR(error_of(model, 2 * cell), expected["intercept_se"], 1e-4);
      EXPECT_NEAR(error_of(model, 2 * cell + 1), expected["slope_se"], 1e-4);
    }
  }
}

TEST(ProbitMixedModel, DoesNotDependOnTheUnitOfLevels) {
  const Json study = studies_fixture()[3];
  std::vector<LevelAnswers> answers = answers_of(study);
  const ProbitMixedModel model = fit_probit_mixed(answers, study["cells"]);
  for (LevelAnswers& one : answers) one.place = 300 + 40 * one.place;
  const ProbitMixedModel scaled = fit_probit_mixed(answers, study["cells"]);
  EXPECT_NEAR(scaled.log_likelihood, model.log_likelihood, 1e-7);
  for (Eigen::Index c = 0; c < 3; ++c) {
    const double pse = -model.coefficients[2 * c] / model.coefficients[2 * c + 1];
    EXPECT_NEAR(-scaled.coefficients[2 * c] / scaled.coefficients[2 * c + 1], 300 + 40 * pse, 1e-4);
    EXPECT_NEAR(scaled.coefficients[2 * c + 1], model.coefficients[2 * c + 1] / 40, 1e-8);
    EXPECT_NEAR(error_of(scaled, 2 * c + 1), error_of(model, 2 * c + 1) / 40, 1e-7);
  }
  EXPECT_NEAR(scaled.spread(1, 1), model.spread(1, 1) / 1600, 1e-8);
}

TEST(ProbitMixedModel, RefitFindsTheSameMaximum) {
  for (const Json& study : studies_fixture()) {
    const std::vector<LevelAnswers> answers = answers_of(study);
    const ProbitMixedModel model = fit_probit_mixed(answers, study["cells"]);
    const ProbitMixedModel again = refit_probit_mixed(answers, study["cells"], model);
    EXPECT_NEAR(again.log_likelihood, model.log_likelihood, 1e-7);
    EXPECT_LT((again.coefficients - model.coefficients).norm(), 1e-4);
  }
}

/// Means over simulated studies: the model is recovered, with the errors that it states.
TEST(ProbitMixedModel, RecoversSimulatedPeople) {
  const Json study = studies_fixture()[7];
  const std::vector<LevelAnswers> answers = answers_of(study);
  ProbitMixedModel truth = fit_probit_mixed(answers, 2);
  truth.spread << 0.4, 0.1, 0.1, 0.1;
  constexpr int kStudies = 300;
  int held = 0;
  double sum = 0;
  for (int i = 0; i < kStudies; ++i) {
    Random random(7, {static_cast<std::uint64_t>(i)});
    const ProbitMixedModel found = fit_probit_mixed(simulate_answers(answers, truth, random), 2);
    ASSERT_EQ(found.undefined, "");
    sum += found.coefficients[1] - truth.coefficients[1];
    if (std::abs(found.coefficients[1] - truth.coefficients[1]) < 1.96 * error_of(found, 1)) ++held;
  }
  EXPECT_NEAR(sum / kStudies, 0, 0.02);
  EXPECT_GT(held, 0.91 * kStudies);
  EXPECT_LT(held, 0.985 * kStudies);
}

TEST(ProbitMixedModel, SaysWhyThereIsNoFit) {
  EXPECT_NE(fit_probit_mixed({{0, 0, 0, 5, 1}, {0, 0, 1, 5, 4}}, 1).undefined.find("participant"),
            std::string::npos);
  EXPECT_NE(fit_probit_mixed({{0, 0, 1, 5, 1}, {1, 0, 1, 5, 4}}, 1).undefined.find("two levels"),
            std::string::npos);
  std::vector<LevelAnswers> step;
  for (std::size_t p = 0; p < 6; ++p) {
    for (int i = 0; i < 6; ++i)
      step.push_back({p, 0, static_cast<double>(i), 10, i < 3 ? 0.0 : 10.0});
  }
  EXPECT_NE(fit_probit_mixed(step, 1).undefined.find("one step"), std::string::npos);
}

TEST(ProbitMixedModel, PeopleAlikeAreSingular) {
  std::vector<LevelAnswers> alike;
  for (std::size_t p = 0; p < 8; ++p) {
    for (int i = 0; i < 5; ++i)
      alike.push_back({p, 0, static_cast<double>(i), 10, std::vector{1.0, 3.0, 5.0, 7.0, 9.0}[i]});
  }
  const ProbitMixedModel model = fit_probit_mixed(alike, 1);
  ASSERT_EQ(model.undefined, "");
  EXPECT_TRUE(model.singular);
  EXPECT_NEAR(-model.coefficients[0] / model.coefficients[1], 2, 1e-6);
}

}  // namespace
}  // namespace palpate::analysis
