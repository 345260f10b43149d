#include "analysis/statistics/comparison.h"

#include <utility>

namespace palpate::analysis {

std::vector<Comparison> compare_renderers(const TrialTable& table, const Description& description,
                                          const TimeOuts& time_outs, std::uint64_t seed) {
  std::vector<Comparison> all;
  for (const RendererPair& pair : renderer_pairs(table.renderers)) {
    Comparison one{pair, compare_by_shape(table, description, pair), {}, {}};
    one.speed_accuracy = speed_accuracy(table, description, pair, one.shapes);
    one.censored = censored_by_shape(description, time_outs, pair);
    all.push_back(std::move(one));
  }
  std::vector<PairedShape*> tests;
  tests.reserve(all.size() * table.shapes.size());
  for (Comparison& one : all) {
    for (PairedShape& shape : one.shapes) tests.push_back(&shape);
  }
  bootstrap_all(tests, seed);
  adjust_all(tests);
  return all;
}

}  // namespace palpate::analysis
