#include "analysis/statistics/mixed_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "analysis/statistics/rm_anova.h"
#include "data/base/random.h"

namespace palpate::analysis {
namespace {

using Json = nlohmann::json;

const std::vector<std::string> kTwo{"point", "ray"}, kShapes{"sphere", "cone"};

ParticipantCell cell_of(const std::vector<double>& logs) {
  ParticipantCell cell;
  cell.n_trials = cell.n_correct = cell.n_used = logs.size();
  if (logs.empty()) return cell;
  cell.mean_log = mean(logs);
  for (const double log : logs) {
    cell.sum_of_squares_log += (log - cell.mean_log) * (log - cell.mean_log);
    cell.mean += std::exp(log) / static_cast<double>(logs.size());
  }
  return cell;
}

/// Log times of two renderers and two shapes with the sds given.
ParticipantCells participant_cells_of(std::size_t n, std::size_t repetitions, double intercept,
                                      double slope, double residual, std::uint64_t seed) {
  Random random(seed);
  ParticipantCells participants(2, {2, std::vector<ParticipantCell>(n)});
  for (std::size_t p = 0; p < n; ++p) {
    const double a = intercept * random.normal(), b = slope * random.normal();
    for (std::size_t r = 0; r < 2; ++r) {
      for (std::size_t s = 0; s < 2; ++s) {
        std::vector<double> logs(repetitions);
        for (double& log : logs) log = 2 + a + (r == 1 ? b - 0.2 : 0) + residual * random.normal();
        participants[r][s][p] = cell_of(logs);
      }
    }
  }
  return participants;
}

void expect_estimate(const Json& expected, const ModelEstimate& found, const std::string& place) {
  const auto near = [&](const char* key, const std::optional<double>& value, double relative) {
    if (!expected.contains(key)) return;
    ASSERT_TRUE(value) << place << " " << key << " " << found.undefined;
    const double e = expected[key];
    EXPECT_NEAR(*value, e, relative * std::max(std::fabs(e), 1e-3)) << place << " " << key;
  };
  near("estimate", found.estimate, 1e-5);
  near("se", found.se, 1e-4);
  near("df_satterthwaite", found.df_satterthwaite, 5e-3);
  near("t", found.t, 1e-4);
  near("p", found.p, 1e-2);
  near("p_holm", found.p_holm, 1e-2);
}

TEST(ThreeRenderers, AgreesWithR) {
  const std::vector<std::string> renderers{"point", "ray", "tube"};
  const std::vector<std::string> shapes{"sphere", "cone", "cylinder"};
  const Json all = Json::parse(
      std::ifstream(PALPATE_SOURCE_DIR "/tests/analysis/fixtures/three_renderers.json"));
  ParticipantCells participants(3, {3, std::vector<ParticipantCell>(10)});
  for (std::size_t p = 0; p < 10; ++p) {
    const std::string name = p == 9 ? "D10" : "D0" + std::to_string(p + 1);
    for (std::size_t r = 0; r < 3; ++r) {
      for (std::size_t s = 0; s < 3; ++s) {
        std::string key = name;
        key += "." + shapes[s] + "." + renderers[r];
        const Json& logs = all["trials"][key];
        participants[r][s][p] = cell_of(logs.is_array() ? logs.get<std::vector<double>>()
                                                        : std::vector<double>{logs.get<double>()});
      }
    }
  }

  const RmAnova anova = rm_anova(participants);
  for (const AnovaEffect& effect : anova.effects) {
    const Json& expected = all["rm_anova"]["effects"][effect.name];
    EXPECT_NEAR(*effect.f, expected["F"].get<double>(), 1e-8 * *effect.f) << effect.name;
    EXPECT_NEAR(*effect.p, expected["p"].get<double>(), 1e-6) << effect.name;
    const Json& sphericity = expected["sphericity"];
    EXPECT_NEAR(*effect.sphericity.gg_epsilon, sphericity["gg_epsilon"].get<double>(), 1e-8);
    EXPECT_NEAR(*effect.sphericity.mauchly_w, sphericity["mauchly_W"].get<double>(), 1e-8);
    EXPECT_NEAR(*effect.sphericity.hf_epsilon_raw, sphericity["hf_epsilon_raw"].get<double>(),
                1e-8);
  }

  const MixedModel model = mixed_model(participants, renderers, shapes);
  const Json& expected = all["mixed_model"];
  EXPECT_EQ(model.undefined, "");
  EXPECT_EQ(model.singular, "");
  EXPECT_NEAR(*model.log_likelihood_reml, expected["logLik_REML"].get<double>(), 1e-4);
  EXPECT_NEAR(*model.residual_sd, expected["residual_sd"].get<double>(), 1e-4);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(model.random_sds[i], expected["random_sds"][i].get<double>(), 1e-4) << i;
    EXPECT_NEAR(*model.random_correlations[i], expected["random_correlations"][i].get<double>(),
                1e-3);
  }
  ASSERT_EQ(model.fixed_effects.size(), 9U);
  for (const FixedEffect& effect : model.fixed_effects) {
    ASSERT_TRUE(expected["fixed_effects"].contains(effect.name)) << effect.name;
    EXPECT_NEAR(*effect.value.estimate, expected["fixed_effects"][effect.name].get<double>(), 1e-5);
    expect_estimate(expected["fixed_effects_tests"][effect.name], effect.value, effect.name);
  }
  for (std::size_t r = 1; r < 3; ++r) {
    for (std::size_t s = 0; s < 3; ++s) {
      expect_estimate(expected["contrasts"][renderers[r]][shapes[s]], model.contrasts[r - 1][s],
                      renderers[r] + " " + shapes[s]);
    }
  }
}

TEST(MixedModel, ConvergesWhereverTheVariancesLie) {
  for (const double intercept : {0.0, 1e-3, 0.3, 3.0}) {
    for (const double slope : {0.0, 1e-3, 0.2, 2.0}) {
      for (const double residual : {1e-3, 0.4, 50.0}) {
        for (std::uint64_t seed = 1; seed <= 5; ++seed) {
          const std::size_t n = 2 + seed * seed;
          const MixedModel model = mixed_model(
              participant_cells_of(n, seed, intercept, slope, residual, seed), kTwo, kShapes);
          EXPECT_EQ(model.undefined, "")
              << intercept << " " << slope << " " << residual << " " << seed;
          for (const FixedEffect& effect : model.fixed_effects) {
            EXPECT_TRUE(std::isfinite(*effect.value.estimate));
            EXPECT_TRUE(effect.value.p || !effect.value.undefined.empty());
          }
        }
      }
    }
  }
}

/// Two participants with gaps: some variances are so badly known that no interval is finite.
TEST(MixedModel, SaysOfEveryEstimateWithoutAnIntervalWhy) {
  int few = 0, defined = 0;
  const auto look = [&](const ModelEstimate& one) {
    ASSERT_TRUE(one.estimate && one.se);
    EXPECT_EQ(one.undefined.empty(), one.t && one.p && one.ci95) << one.undefined;
    EXPECT_EQ(one.ci95.has_value(), one.p.has_value());
    if (one.ci95) {
      ++defined;
      EXPECT_TRUE(std::isfinite(one.ci95->low) && std::isfinite(one.ci95->high));
      EXPECT_LE(one.ci95->low, *one.estimate);
      EXPECT_GE(one.ci95->high, *one.estimate);
    } else if (one.df_satterthwaite && *one.df_satterthwaite < 1e-3) {
      ++few;
      EXPECT_EQ(one.undefined, "too few degrees of freedom");
    }
  };
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    Random random(seed, {7});
    const auto drawn = [&random] { return std::pow(10.0, -4 + 5 * random.unit()); };
    const double intercept = drawn(), slope = drawn(), residual = drawn();
    ParticipantCells cells = participant_cells_of(2, 2, intercept, slope, residual, seed);
    for (int gap = 0; gap < 2; ++gap)
      cells[random.below(2)][random.below(2)][random.below(2)] = ParticipantCell{};
    const MixedModel model = mixed_model(cells, kTwo, kShapes);
    for (const FixedEffect& effect : model.fixed_effects) look(effect.value);
    for (const auto& renderer : model.contrasts)
      for (const ModelEstimate& contrast : renderer)
        if (contrast.estimate) look(contrast);
  }
  EXPECT_GT(few, 0);
  EXPECT_GT(defined, 100);
}

TEST(MixedModel, RefusesWhatWouldTakeHours) {
  const auto reason = [](std::size_t n_renderers, std::size_t n_shapes) {
    ParticipantCells participants(n_renderers, {n_shapes, std::vector<ParticipantCell>(3)});
    std::vector<std::string> renderers, shapes;
    for (std::size_t r = 0; r < n_renderers; ++r) {
      renderers.push_back("r" + std::to_string(r));
      for (auto& shape : participants[r]) {
        for (ParticipantCell& cell : shape) cell = cell_of({1.0, 2.0});
      }
    }
    for (std::size_t s = 0; s < n_shapes; ++s) shapes.push_back("s" + std::to_string(s));
    return mixed_model(participants, renderers, shapes).undefined;
  };
  EXPECT_EQ(reason(9, 2), "too many renderers and shapes for this model");
  EXPECT_EQ(reason(5, 200), "too many renderers and shapes for this model");
  EXPECT_EQ(reason(8, 2), "");
}

TEST(MixedModel, DoesNotDependOnTheUnitOfTime) {
  ParticipantCells participants = participant_cells_of(8, 4, 0.3, 0.2, 0.4, 3);
  const MixedModel before = mixed_model(participants, kTwo, kShapes);
  for (auto& renderer : participants) {
    for (auto& shape : renderer) {
      for (ParticipantCell& cell : shape) cell.mean_log += std::log(1000.0);
    }
  }
  const MixedModel after = mixed_model(participants, kTwo, kShapes);
  EXPECT_NEAR(*after.log_likelihood_reml, *before.log_likelihood_reml, 1e-9);
  for (std::size_t s = 0; s < 2; ++s) {
    EXPECT_NEAR(*after.contrasts[0][s].estimate, *before.contrasts[0][s].estimate, 1e-10);
    EXPECT_NEAR(*after.contrasts[0][s].se, *before.contrasts[0][s].se, 1e-9);
  }
}

TEST(MixedModel, NamesWhatLiesOnTheBoundary) {
  const MixedModel flat = mixed_model(participant_cells_of(30, 6, 0.3, 0, 0.4, 2), kTwo, kShapes);
  ASSERT_EQ(flat.undefined, "");
  EXPECT_NE(flat.singular, "");
  const MixedModel full = mixed_model(participant_cells_of(30, 6, 0.3, 0.3, 0.4, 2), kTwo, kShapes);
  EXPECT_EQ(full.singular, "");
}

TEST(MixedModel, SaysWhyThereIsNoFit) {
  const auto reason = [](const ParticipantCells& participants) {
    return mixed_model(participants, kTwo, kShapes).undefined;
  };
  EXPECT_EQ(reason(participant_cells_of(1, 5, 0.3, 0.2, 0.4, 1)),
            "one participant, so no variance between participants");
  EXPECT_EQ(reason(participant_cells_of(5, 3, 0, 0, 0, 1)),
            "no residual variance: participants and shapes explain every time");
  ParticipantCells apart = participant_cells_of(4, 3, 0.3, 0.2, 0.4, 1);
  for (std::size_t p = 0; p < 4; ++p) {
    for (ParticipantCell* cell : {&apart[p % 2][0][p], &apart[p % 2][1][p]}) *cell = {};
  }
  EXPECT_EQ(reason(apart), "no participant has times for both renderers");
  const ParticipantCells empty(2, {2, std::vector<ParticipantCell>(3)});
  EXPECT_EQ(reason(empty), "no trial can be used for times");
  EXPECT_EQ(mixed_model(empty, kTwo, kShapes).contrasts.size(), 1U);
  ParticipantCells one_renderer = participant_cells_of(4, 3, 0.3, 0.2, 0.4, 1);
  one_renderer.pop_back();
  EXPECT_EQ(mixed_model(one_renderer, {"point"}, kShapes).undefined,
            "only one renderer in the data");
}

}  // namespace
}  // namespace palpate::analysis
