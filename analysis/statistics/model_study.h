#pragma once
// Single trials drawn from the model of a plan, in the order of a schedule: simulated data with the
// planned effect, or with none.

#include <cstddef>
#include <vector>

#include "analysis/statistics/power.h"
#include "data/base/random.h"

namespace palpate::analysis {

struct ModelTrial {
  std::size_t shape = 0;       ///< index into StudyModel::shapes
  bool with_renderer = false;  ///< the renderer with the planned effect; false: the reference
};

struct ModelAnswer {
  bool usable = true;     ///< correct answer with a usable time; false: wrong answer
  std::size_t other = 0;  ///< wrong answer: shapes after the right one, from 1
  double time = 0;        ///< s
};

/// The trials of one participant; intercept and gains are drawn first.
/// \param typical_time  s, geometric mean over participants with the reference; the model has none
std::vector<ModelAnswer> draw_answers(const StudyModel& model, double typical_time,
                                      const std::vector<ModelTrial>& trials, Random& random);

/// The same model without an effect for any shape.
StudyModel without_effect(StudyModel model);

}  // namespace palpate::analysis
