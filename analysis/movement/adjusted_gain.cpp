#include "analysis/movement/adjusted_gain.h"

#include <array>
#include <cmath>
#include <map>

namespace palpate::analysis {
namespace {

/// Of one trial, or a participant's sums.
struct Observation {
  double time = 0, renderer = 0, measure = 0;
};

AdjustedGain gain_of(const std::map<std::uint32_t, std::vector<Observation>>& by_participant) {
  AdjustedGain gain;
  double rr = 0, rm = 0, mm = 0, rt = 0, mt = 0;
  for (const auto& [participant, trials] : by_participant) {
    Observation centre;
    for (const Observation& one : trials) {
      centre.time += one.time;
      centre.renderer += one.renderer;
      centre.measure += one.measure;
    }
    const auto n = static_cast<double>(trials.size());
    if (centre.renderer == 0 || centre.renderer == n) continue;  // without both renderers
    ++gain.n_participants;
    gain.n_trials += trials.size();
    for (const Observation& one : trials) {
      const double t = one.time - centre.time / n, r = one.renderer - centre.renderer / n,
                   m = one.measure - centre.measure / n;
      rr += r * r;
      rm += r * m;
      mm += m * m;
      rt += r * t;
      mt += m * t;
    }
  }
  if (!(rr > 0)) return gain;
  gain.time_difference = rt / rr;
  gain.measure_difference = rm / rr;
  const double determinant = rr * mm - rm * rm;
  if (!(determinant > 1e-9 * rr * mm)) return gain;
  gain.time_difference_at_equal_measure = (mm * rt - rm * mt) / determinant;
  gain.slope = (rr * mt - rm * rt) / determinant;
  return gain;
}

}  // namespace

std::vector<AdjustedGain> adjusted_gains(const MovementTable& table) {
  static constexpr std::array<const char*, 3> kNames = {"coverage_rate", "strokes",
                                                        "contact_share"};
  std::vector<AdjustedGain> gains;
  const std::vector<RendererPair> pairs = renderer_pairs(table.trials.renderers);
  for (std::size_t c = 0; c < pairs.size(); ++c) {
    if (!pairs[c].in_data()) continue;
    for (std::size_t s = 0; s < table.trials.shapes.size(); ++s) {
      for (const char* name : kNames) {
        const std::size_t m = measure_named(name);
        std::map<std::uint32_t, std::vector<Observation>> by_participant;
        for (std::size_t i = 0; i < table.values.size(); ++i) {
          const TrialRow& row = table.trials.rows[i];
          const bool reference = row.renderer == *pairs[c].reference_at;
          if (row.shape != s || (!reference && row.renderer != *pairs[c].renderer_at)) continue;
          const auto value = on_scale(measure_definitions()[m].scale, table.values[i][m]);
          if (!row.correct || !value || !(row.response_time > 0)) continue;
          by_participant[row.participant].push_back(
              {std::log(row.response_time), reference ? 0.0 : 1.0, *value});
        }
        AdjustedGain gain = gain_of(by_participant);
        gain.shape = s;
        gain.comparison = c;
        gain.measure = m;
        gains.push_back(gain);
      }
    }
  }
  return gains;
}

}  // namespace palpate::analysis
