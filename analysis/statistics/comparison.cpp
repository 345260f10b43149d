#include "analysis/statistics/comparison.h"

#include <cmath>
#include <utility>

namespace palpate::analysis {

namespace {

/// A trade-off needs evidence of a loss: point estimates of opposite sign come in half of all cells
/// without any effect. \param change of accuracy, renderer minus reference
std::string read(double percent_change_time, double change, const TTest& test,
                 std::size_t participants) {
  const bool renderer_is_faster = percent_change_time < 0;
  if (const auto& ends = test.log_ratio_ci95) {
    const bool faster_loses = renderer_is_faster ? ends->high < 0 : ends->low > 0;
    return percent_change_time != 0 && faster_loses ? "trade-off possible" : "none shown";
  }
  // Without variance there is no interval; equal accuracies of everybody are no loss.
  return participants > 1 && change == 0 ? "none shown" : "";
}

}  // namespace

std::vector<SpeedAccuracy> speed_accuracy(const TrialTable& table, const Description& description,
                                          const RendererPair& pair,
                                          const std::vector<PairedShape>& shapes) {
  std::vector<SpeedAccuracy> out(table.shapes.size());
  for (std::size_t s = 0; s < out.size(); ++s) {
    SpeedAccuracy& one = out[s];
    if (!pair.in_data()) {
      one.test.undefined = "only one renderer in the data";
      continue;
    }
    const std::size_t reference = *pair.reference_at, renderer = *pair.renderer_at;
    one.accuracy_reference = description.accuracy[reference][s].mean_of_participant_accuracies;
    one.accuracy_renderer = description.accuracy[renderer][s].mean_of_participant_accuracies;
    std::vector<double> changes;
    for (std::size_t p = 0; p < table.participants.size(); ++p) {
      const ParticipantCell& a = description.participant_cells[reference][s][p];
      const ParticipantCell& b = description.participant_cells[renderer][s][p];
      if (a.n_trials == 0 || b.n_trials == 0) continue;
      changes.push_back(static_cast<double>(b.n_correct) / static_cast<double>(b.n_trials) -
                        static_cast<double>(a.n_correct) / static_cast<double>(a.n_trials));
    }
    one.n_pairs = changes.size();
    one.test = t_test(changes);
    if (changes.empty()) {
      one.test.undefined = "no participant has trials with both renderers";
    } else {
      one.accuracy_change = mean(changes);
    }
    if (shapes[s].mean_log_ratio)
      one.percent_change_time = 100 * std::expm1(*shapes[s].mean_log_ratio);
    if (one.percent_change_time && one.accuracy_change) {
      one.reading = read(*one.percent_change_time, *one.accuracy_change, one.test, changes.size());
    }
  }
  return out;
}

std::vector<Comparison> compare_renderers(const TrialTable& table, const Description& description,
                                          const TimeOuts& time_outs, std::uint64_t seed) {
  std::vector<Comparison> all;
  for (const RendererPair& pair : renderer_pairs(table.renderers)) {
    Comparison one{pair, compare_by_shape(table, description, pair), {}, {}, {}};
    one.speed_accuracy = speed_accuracy(table, description, pair, one.shapes);
    one.censored = censored_by_shape(description, time_outs, pair);
    one.accuracy = compare_accuracy(table, pair);
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
