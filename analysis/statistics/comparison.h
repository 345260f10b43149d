#pragma once
// All comparisons of a renderer with the reference, shape by shape.

#include <cstdint>
#include <vector>

#include "analysis/input/trials.h"
#include "analysis/statistics/censored.h"
#include "analysis/statistics/describe.h"
#include "analysis/statistics/paired.h"
#include "analysis/statistics/speed_accuracy.h"

namespace palpate::analysis {

/// Results of one pair of renderers.
struct Comparison {
  RendererPair pair;
  std::vector<PairedShape> shapes;            ///< one for each of table.shapes
  std::vector<SpeedAccuracy> speed_accuracy;  ///< likewise
  std::vector<CensoredEstimate> censored;     ///< likewise; empty without time-outs
};

/// Compares each of renderer_pairs(). Holm's adjustment is over all shapes of all comparisons.
/// \param seed of the bootstrap
std::vector<Comparison> compare_renderers(const TrialTable& table, const Description& description,
                                          const TimeOuts& time_outs, std::uint64_t seed);

}  // namespace palpate::analysis
