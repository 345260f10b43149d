#pragma once
// Statistical power by simulation: studies are drawn from the mixed model and tested as in an
// analysis.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "analysis/statistics/analysis.h"

namespace palpate::analysis {

/// The model from which studies are drawn. Natural logs of s; standard deviations >= 0.
struct StudyModel {
  std::vector<std::string> shapes;
  std::vector<double> log_ratios;  ///< effect of each shape, renderer - reference; 0: none
  double gain_sd = 0;              ///< of participants' gains, common to all shapes (random slope)
  double shape_gain_sd = 0;        ///< of gains beyond that, participant x shape
  double intercept_sd = 0;         ///< of participants; does not affect paired tests
  double correlation = 0;          ///< of intercepts and gains, -1 to 1
  double residual_sd = 0;          ///< of single trials
  double proportion_used = 1;  ///< of trials with a usable time: answered, correct, not too fast
};

/// Size of a study.
struct StudyDesign {
  std::size_t participants = 0;
  std::size_t trials = 0;  ///< of each shape with each renderer
};

/// Test of a study.
enum class StudyTest {
  paired,  ///< paired t-tests, Holm over the shapes: the primary inference
  model    ///< contrasts of the mixed model, fitted to every study, Holm over the shapes
};

/// Settings of a simulation.
struct PowerSettings {
  double alpha = 0.05;
  std::size_t studies = 10'000;
  std::uint64_t seed = 2000;
  std::size_t jobs = 1;  ///< threads; the result does not depend on it
  StudyTest test = StudyTest::paired;
  /// Called with the number of studies done, on the calling thread.
  std::function<void(std::size_t)> progress;
};

/// Numbers of studies with significant results.
struct Power {
  std::size_t studies = 0;
  std::vector<std::size_t> found;  ///< by shape; for a shape with an effect, only in its direction
  std::size_t all = 0;             ///< studies significant for every shape with an effect
  std::size_t any = 0;             ///< studies significant for at least one of them

  /// n / studies.
  double proportion(std::size_t n) const {
    return static_cast<double>(n) / static_cast<double>(studies);
  }
};

/// Study i is drawn from random stream i of the seed, so the result does not depend on `jobs`.
Power simulate_power(const StudyModel& model, const StudyDesign& design,
                     const PowerSettings& settings);

struct ModelTrial {
  std::size_t shape = 0;       ///< index into StudyModel::shapes
  bool with_renderer = false;  ///< the renderer with the planned effect; false: the reference
};

struct ModelAnswer {
  bool usable = true;     ///< correct answer with a usable time; false: wrong answer
  std::size_t other = 0;  ///< wrong answer: shapes after the right one, from 1
  double time = 0;        ///< s
};

/// Single trials of one participant from the same model, in the order of a schedule: simulated data
/// with the planned effect, or with none (without_effect). Intercept and gains are drawn first.
/// \param typical_time  s, geometric mean over participants with the reference; the model has none
std::vector<ModelAnswer> draw_answers(const StudyModel& model, double typical_time,
                                      const std::vector<ModelTrial>& trials, Random& random);

/// The same model without an effect for any shape.
StudyModel without_effect(StudyModel model);

}  // namespace palpate::analysis
