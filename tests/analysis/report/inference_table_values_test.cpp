// Cells of the tables of inferential statistics against values computed here from the trials by
// their definitions.
//
// The study is balanced, so that the REML estimates have closed forms: with K trials for each
// participant and renderer, S the sample covariance matrix of participants' means with each
// renderer and sigma^2 the pooled residual variance within participants, renderers and shapes
// (two-way additive), the covariance matrix of random effects is S - sigma^2 / K I.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "analysis/input/trials.h"
#include "analysis/report/tables.h"
#include "analysis/statistics/analysis.h"
#include "analysis/text.h"
#include "data/base/random.h"

namespace palpate::analysis {
namespace {
namespace table_values {

constexpr std::size_t kParticipants = 12, kShapes = 2, kRepetitions = 12;
constexpr std::size_t kTrials = kShapes * kRepetitions;  // K
constexpr double kT975 = 2.200985;  // quantile of Student's t with 11 degrees of freedom
const std::array<std::string, kShapes> kShapeNames{"cone", "cube"};

using Values = std::vector<double>;

double mean_of(const Values& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

double covariance_of(const Values& a, const Values& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - mean_of(a)) * (b[i] - mean_of(b));
  return sum / static_cast<double>(a.size() - 1);
}

double sd_of(const Values& values) { return std::sqrt(covariance_of(values, values)); }

/// Log times, all correct: log_times[renderer][shape][participant][repetition]. Odd participants
/// have the renderers in reverse order; shapes alternate.
struct Study {
  std::vector<std::string> renderers;
  std::vector<std::vector<std::vector<Values>>> log_times;
  /// Wrong answers of each cell are the first wrong[renderer][shape][participant] trials.
  std::vector<std::vector<std::vector<std::size_t>>> wrong;

  explicit Study(std::vector<std::string> names, bool all_correct = true)
      : renderers(std::move(names)),
        log_times(renderers.size(), {kShapes, std::vector<Values>(kParticipants)}),
        wrong(renderers.size(), {kShapes, std::vector<std::size_t>(kParticipants)}) {
    constexpr std::uint64_t kSeed = 71;
    Random random(kSeed);
    for (std::size_t p = 0; p < kParticipants; ++p) {
      const double intercept = 0.4 * random.normal();
      for (std::size_t r = 0; r < renderers.size(); ++r) {
        const double gain = static_cast<double>(r) * (0.2 * random.normal() - 0.1);
        for (std::size_t s = 0; s < kShapes; ++s) {
          for (std::size_t i = 0; i < kRepetitions; ++i) {
            log_times[r][s][p].push_back(2 + intercept + gain +
                                         0.3 * static_cast<double>(s * (r + 1)) -
                                         0.01 * static_cast<double>(i) + 0.25 * random.normal());
          }
          if (!all_correct) wrong[r][s][p] = (p * (r + 2) + s) % 4;
        }
      }
    }
  }

  Analysis analysis() const {
    TrialTableBuilder builder;
    for (std::size_t p = 0; p < kParticipants; ++p) {
      const std::string name = "P" + std::to_string(p);
      int trial = 0;
      for (std::size_t turn = 0; turn < renderers.size(); ++turn) {
        const std::size_t r = p % 2 == 0 ? turn : renderers.size() - 1 - turn;
        for (std::size_t i = 0; i < kRepetitions; ++i) {
          for (std::size_t s = 0; s < kShapes; ++s) {
            StudyTrial raw;
            raw.participant = name;
            raw.renderer = renderers[r];
            raw.shape = kShapeNames[s];
            raw.correct = i >= wrong[r][s][p];
            raw.response = kShapeNames[*raw.correct ? s : 1 - s];
            raw.trial = ++trial;
            raw.response_time = std::exp(log_times[r][s][p][i]);
            builder.add(raw);
          }
        }
      }
    }
    return analyze(builder.finish({}), {}, "test");
  }

  /// Mean log times of correct trials by participant.
  Values cell_means(std::size_t r, std::size_t s) const {
    Values means;
    for (std::size_t p = 0; p < kParticipants; ++p) {
      means.push_back(
          mean_of(Values(log_times[r][s][p].begin() + static_cast<std::ptrdiff_t>(wrong[r][s][p]),
                         log_times[r][s][p].end())));
    }
    return means;
  }

  /// Participants' differences of mean log times, renderer r - first renderer.
  Values differences(std::size_t r, std::size_t s) const {
    Values out = cell_means(r, s);
    const Values reference = cell_means(0, s);
    for (std::size_t p = 0; p < kParticipants; ++p) out[p] -= reference[p];
    return out;
  }

  /// Participants' means with a renderer, over shapes.
  Values renderer_means(std::size_t r) const {
    Values out = cell_means(r, 0);
    const Values second = cell_means(r, 1);
    for (std::size_t p = 0; p < kParticipants; ++p) out[p] = (out[p] + second[p]) / 2;
    return out;
  }

  /// Pooled over renderers, each with participants + shapes - 1 fixed effects.
  double residual_variance() const {
    double squares = 0;
    for (std::size_t r = 0; r < renderers.size(); ++r) {
      const Values participant = renderer_means(r);
      const double all = mean_of(participant);
      for (std::size_t s = 0; s < kShapes; ++s) {
        const double shape = mean_of(cell_means(r, s));
        for (std::size_t p = 0; p < kParticipants; ++p) {
          for (const double value : log_times[r][s][p]) {
            squares += std::pow(value - participant[p] - shape + all, 2);
          }
        }
      }
    }
    const std::size_t df =
        renderers.size() * (kParticipants * kTrials - kParticipants - kShapes + 1);
    return squares / static_cast<double>(df);
  }

  /// Element of the covariance matrix of the random effects of renderers.
  double psi(std::size_t a, std::size_t b) const {
    return covariance_of(renderer_means(a), renderer_means(b)) -
           (a == b ? residual_variance() / static_cast<double>(kTrials) : 0);
  }
};

std::string percent_text(double value) { return fixed(value, 1) + " %"; }
std::string reduction_text(double log_ratio) {
  return percent_text(100 * (1 - std::exp(log_ratio)));
}
std::string change_text(double value, const std::string& unit) {
  return (value > 0 ? "+" : "") + fixed(value, 1) + unit;
}

std::string row_text(const Table& table, std::size_t row, const std::string& column,
                     std::size_t nth = 0) {
  for (std::size_t c = 0; c < table.header.size(); ++c) {
    if (table.header[c] == column && nth-- == 0) return table.rows.at(row).at(c);
  }
  ADD_FAILURE() << "no column " << column;
  return {};
}

std::string note_with(const Table& table, const std::string& part) {
  for (const std::string& note : table.notes) {
    if (note.find(part) != std::string::npos) return note;
  }
  ADD_FAILURE() << "no note with " << part;
  return {};
}

TEST(MixedModelTableValues, StandardDeviationsEqualBalancedDesign) {
  for (const std::vector<std::string>& renderers :
       {std::vector<std::string>{"point", "ray"}, {"point", "ray", "tube"}}) {
    const Study study(renderers);
    ASSERT_GT(study.psi(0, 0) * study.psi(1, 1), study.psi(0, 1) * study.psi(0, 1))
        << "no boundary";
    const Table table = mixed_model_table(study.analysis());
    const std::string note = note_with(table, "tandard deviations");
    const double intercept = std::sqrt(study.psi(0, 0));
    std::string expected = "intercepts " + fixed(intercept, 3) + ", their slopes for the ray ";
    Values slopes;
    for (std::size_t r = 1; r < renderers.size(); ++r) {
      slopes.push_back(std::sqrt(study.psi(0, 0) + study.psi(r, r) - 2 * study.psi(0, r)));
    }
    expected += fixed(slopes[0], 3);
    if (renderers.size() == 2) {
      const double correlation = (study.psi(0, 1) - study.psi(0, 0)) / (intercept * slopes[0]);
      expected += " (correlation " + fixed(correlation, 2) + ")";
    } else {
      expected += " and tube " + fixed(slopes[1], 3);
    }
    expected += ", residual " + fixed(std::sqrt(study.residual_variance()), 3) + ";";
    EXPECT_NE(note.find(expected), std::string::npos) << expected << "\nin: " << note;
    EXPECT_NE(note.find(std::to_string(renderers.size() * kParticipants * kTrials) + " trials"),
              std::string::npos);
  }
}

TEST(MixedModelTableValues, ContrastsAreDifferencesOfCellMeans) {
  const Study study({"point", "ray", "tube"});
  const Table table = mixed_model_table(study.analysis());
  ASSERT_EQ(table.rows.size(), 2 * kShapes);
  for (std::size_t r = 1; r < 3; ++r) {
    const double slope_variance = study.psi(0, 0) + study.psi(r, r) - 2 * study.psi(0, r);
    const double se =
        std::sqrt((slope_variance + 2 * study.residual_variance() / kRepetitions) / kParticipants);
    for (std::size_t s = 0; s < kShapes; ++s) {
      const std::size_t row = (r - 1) * kShapes + s;
      const double estimate = mean_of(study.differences(r, s));
      EXPECT_EQ(table.rows[row][0], study.renderers[r]);
      EXPECT_EQ(table.rows[row][1], kShapeNames[s]);
      EXPECT_EQ(row_text(table, row, "reduction"), reduction_text(estimate));
      EXPECT_EQ(row_text(table, row, "− point"), fixed(estimate, 4));
      EXPECT_EQ(row_text(table, row, "se"), fixed(se, 4));
      EXPECT_EQ(row_text(table, row, "t"), fixed(estimate / se, 2));
    }
  }
}

TEST(AnovaTableValues, FIsTheSquareOfTheContrastsT) {
  const Study study({"point", "ray"});
  const Table table = anova_table(study.analysis());
  // With two levels each effect is one contrast of the cells a, b (point), c, d (ray) of each
  // participant.
  const Values a = study.cell_means(0, 0), b = study.cell_means(0, 1), c = study.cell_means(1, 0),
               d = study.cell_means(1, 1);
  std::array<Values, 4> scores;  // renderer, shape, interaction, participant; orthonormal
  for (std::size_t p = 0; p < kParticipants; ++p) {
    scores[0].push_back((c[p] + d[p] - a[p] - b[p]) / 2);
    scores[1].push_back((b[p] + d[p] - a[p] - c[p]) / 2);
    scores[2].push_back((a[p] + d[p] - b[p] - c[p]) / 2);
    scores[3].push_back((a[p] + b[p] + c[p] + d[p]) / 2);
  }
  double error = 0;  // sums of squares of participants and of all three error terms
  for (const Values& score : scores) error += covariance_of(score, score) * (kParticipants - 1);
  const std::array<std::string, 3> names{"renderer", "shape", "renderer:shape"};
  ASSERT_EQ(table.rows.size(), names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    const double effect = kParticipants * mean_of(scores[i]) * mean_of(scores[i]);
    EXPECT_EQ(row_text(table, i, "effect"), names[i]);
    EXPECT_EQ(row_text(table, i, "df"), "1");
    EXPECT_EQ(row_text(table, i, "den. df"), "11");
    EXPECT_EQ(row_text(table, i, "F"), fixed(effect / covariance_of(scores[i], scores[i]), 2));
    EXPECT_EQ(row_text(table, i, "η² gen."), fixed(effect / (effect + error), 3));
  }
}

TEST(SpeedAccuracyTableValues, ChangesArePairedOverParticipants) {
  const Study study({"point", "ray"}, false);
  const Table table = speed_accuracy_table(study.analysis());
  ASSERT_EQ(table.rows.size(), kShapes);
  for (std::size_t s = 0; s < kShapes; ++s) {
    std::array<Values, 3> accuracy;  // percent: point, ray, change
    for (std::size_t p = 0; p < kParticipants; ++p) {
      for (std::size_t r = 0; r < 2; ++r) {
        accuracy[r].push_back(100.0 * static_cast<double>(kRepetitions - study.wrong[r][s][p]) /
                              kRepetitions);
      }
      accuracy[2].push_back(accuracy[1][p] - accuracy[0][p]);
    }
    const double change = mean_of(accuracy[2]);
    const double half = kT975 * sd_of(accuracy[2]) / std::sqrt(static_cast<double>(kParticipants));
    EXPECT_EQ(row_text(table, s, "shape"), kShapeNames[s]);
    EXPECT_EQ(row_text(table, s, "time"),
              change_text(100 * std::expm1(mean_of(study.differences(1, s))), " %"));
    EXPECT_EQ(row_text(table, s, "accuracy point"), percent_text(mean_of(accuracy[0])));
    EXPECT_EQ(row_text(table, s, "accuracy ray"), percent_text(mean_of(accuracy[1])));
    EXPECT_EQ(row_text(table, s, "accuracy"), change_text(change, " points"));
    EXPECT_EQ(row_text(table, s, "95 % interval"),
              change_text(change - half, "") + " to " + change_text(change + half, ""));
  }
}

TEST(LearningTableValues, BinsAreEighthsOfEachRenderersTrials) {
  const Study study({"point", "ray"});
  const Table table = learning_table(study.analysis());
  EXPECT_EQ(table.header, (std::vector<std::string>{"renderer", "1/8", "2/8", "3/8", "4/8", "5/8",
                                                    "6/8", "7/8", "8/8"}));
  ASSERT_EQ(table.rows.size(), 2U);
  constexpr std::size_t kBin = kTrials / 8;
  for (std::size_t r = 0; r < 2; ++r) {
    EXPECT_EQ(table.rows[r][0], study.renderers[r]);
    ASSERT_EQ(table.rows[r].size(), 9U);
    const std::array<Values, 2> cells{study.cell_means(r, 0), study.cell_means(r, 1)};
    for (std::size_t bin = 0; bin < 8; ++bin) {
      Values relative;  // to the participant's mean of the shape
      for (std::size_t p = 0; p < kParticipants; ++p) {
        double sum = 0;
        for (std::size_t trial = bin * kBin; trial < (bin + 1) * kBin; ++trial) {
          sum +=
              study.log_times[r][trial % kShapes][p][trial / kShapes] - cells[trial % kShapes][p];
        }
        relative.push_back(sum / kBin);
      }
      const double log_time = mean_of(relative) + mean_of(study.renderer_means(r));
      EXPECT_EQ(table.rows[r][bin + 1], fixed(std::exp(log_time), 2))
          << study.renderers[r] << " " << bin;
    }
  }
}

TEST(RendererOrderTableValues, GainsAreMeansOfEachGroup) {
  const Study study({"point", "ray"});
  const Table table = renderer_order_table(study.analysis());
  ASSERT_EQ(table.rows.size(), kShapes + 1);
  for (std::size_t row = 0; row <= kShapes; ++row) {
    std::array<Values, 2> groups;  // point first: even participants
    for (std::size_t p = 0; p < kParticipants; ++p) {
      const double cone = study.differences(1, 0)[p], cube = study.differences(1, 1)[p];
      groups[p % 2].push_back(row == 0 ? cone : row == 1 ? cube : (cone + cube) / 2);
    }
    const double first = mean_of(groups[0]), second = mean_of(groups[1]);
    EXPECT_EQ(table.rows[row][0], row < kShapes ? kShapeNames[row] : "all shapes");
    EXPECT_EQ(row_text(table, row, "point first"), reduction_text(first));
    EXPECT_EQ(row_text(table, row, "ray first"), reduction_text(second));
    EXPECT_EQ(row_text(table, row, "n", 0), "6");
    EXPECT_EQ(row_text(table, row, "n", 1), "6");
    EXPECT_EQ(row_text(table, row, "difference"),
              change_text(100 * std::expm1(first - second), " %"));
    EXPECT_EQ(row_text(table, row, "balanced"), reduction_text((first + second) / 2));
  }
}

}  // namespace table_values
}  // namespace
}  // namespace palpate::analysis
