#pragma once
// How often a study would find an effect: many studies drawn from the mixed model, each tested as
// analyze tests it.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace palpate::analysis {

/// What studies are drawn from. Natural log of seconds; standard deviations >= 0.
struct StudyModel {
  std::vector<std::string> shapes;
  std::vector<double> log_ratios;  ///< the wanted effect of each shape, ray - point; 0: none
  double gain_sd = 0;              ///< of participants' gains, common to all shapes (random slope)
  double shape_gain_sd = 0;        ///< of a participant's gain for a shape beyond that
  double intercept_sd = 0;         ///< of participants; leaves the paired tests alone
  double correlation = 0;          ///< of intercepts and gains, -1 to 1
  double residual_sd = 0;          ///< of single times
  double share_used = 1;           ///< of trials that give a time: answered, right, not too fast
};

struct StudyDesign {
  std::size_t participants = 0;
  std::size_t trials = 0;  ///< of each shape with each renderer
};

enum class StudyTest {
  paired,  ///< paired t-tests, Holm over the shapes: the primary inference
  model    ///< the mixed model's contrasts, Holm over the shapes: fitted to every study
};

struct PowerSettings {
  double alpha = 0.05;
  std::size_t studies = 10'000;
  std::uint64_t seed = 2000;
  std::size_t jobs = 1;  ///< threads; changes nothing but the time it takes
  StudyTest test = StudyTest::paired;
  std::function<void(std::size_t)> progress;  ///< studies done; from the calling thread
};

/// Studies that found what.
struct Power {
  std::size_t studies = 0;
  std::vector<std::size_t> found;  ///< by shape; the right way round where there is an effect
  std::size_t all = 0;             ///< every shape with an effect
  std::size_t any = 0;             ///< at least one of them

  double share(std::size_t n) const {
    return static_cast<double>(n) / static_cast<double>(studies);
  }
};

/// Every study has its own stream of the seed: the same answer whatever the jobs.
Power simulate_power(const StudyModel& model, const StudyDesign& design,
                     const PowerSettings& settings);

}  // namespace palpate::analysis
