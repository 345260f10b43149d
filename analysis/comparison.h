#pragma once
// A renderer against the reference, shape by shape.

#include <cstdint>
#include <vector>

#include "analysis/censored.h"
#include "analysis/describe.h"
#include "analysis/paired.h"
#include "analysis/renderers.h"
#include "analysis/speed_accuracy.h"
#include "analysis/time_outs.h"
#include "analysis/trials.h"

namespace palpate {

struct Comparison {
  RendererPair pair;
  std::vector<PairedShape> shapes;            ///< one for each of table.shapes
  std::vector<SpeedAccuracy> speed_accuracy;  ///< likewise
  std::vector<CensoredEstimate> censored;     ///< likewise, or none: nobody timed out
};

/// One for each of renderer_pairs(). Holm's adjustment is over all shapes of all comparisons.
/// \param seed of the bootstrap
std::vector<Comparison> compare_renderers(const TrialTable& table, const Description& description,
                                          const TimeOuts& time_outs, std::uint64_t seed);

}  // namespace palpate
