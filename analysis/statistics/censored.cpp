#include "analysis/statistics/censored.h"

#include <algorithm>
#include <array>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <utility>

#include "analysis/statistics/normal_tail.h"

namespace palpate::analysis {
namespace {

void find_most_affected(const std::vector<ParticipantCell>& participants, TimeOutCell& cell) {
  std::map<std::size_t, std::size_t> by_participant;
  for (const TimeOutGroup& group : cell.groups) {
    by_participant[group.participant] += group.n;
    if (!group.has_limit()) continue;
    cell.lowest_limit = std::min(cell.lowest_limit.value_or(group.limit), group.limit);
    cell.highest_limit = std::max(cell.highest_limit.value_or(group.limit), group.limit);
  }
  for (const auto& [participant, n] : by_participant) {
    const double proportion =
        static_cast<double>(n) / static_cast<double>(participants[participant].n_trials);
    if (cell.most_affected && proportion <= cell.largest_proportion) continue;
    cell.most_affected = participant;
    cell.largest_proportion = proportion;
  }
}

constexpr int kMostSteps = 100;
constexpr double kClose = 1e-13;      // relative gain in likelihood of a Newton step at convergence
constexpr double kEndless = 1e8;      // 1 / residual sd: the fit is exact
constexpr double kLongestRatio = 50;  // |log ratio|: the estimate diverges

/// One participant's trials with one renderer.
struct Cell {
  double n = 0, mean = 0, squares = 0;              ///< of the logs of times
  std::vector<std::pair<double, double>> censored;  ///< log limit, trials

  bool empty() const { return n == 0 && censored.empty(); }
};

/// A participant's cells: [0] reference, [1] renderer.
using ParticipantData = std::array<Cell, 2>;

/// Parameters of Olsen (1978), in which the log likelihood is concave: precision = 1 / residual sd;
/// intercepts and slope (log ratio) are multiplied by it.
struct Parameters {
  std::vector<double> intercepts;
  double slope = 0, precision = 1;
};

/// Gradient and negative second derivatives by one participant's intercept a, the slope b and the
/// precision g.
struct Curvature {
  double a = 0, b = 0, g = 0, aa = 0, ab = 0, ag = 0, bb = 0, bg = 0, gg = 0;
};

/// Adds a cell's derivatives. \return its log likelihood
double add_cell(const Cell& cell, double intercept, const Parameters& at, bool renderer,
                Curvature& out) {
  const double centre = intercept + (renderer ? at.slope : 0), g = at.precision;
  const double sum = cell.n * cell.mean;
  const double about_0 = cell.squares + sum * cell.mean;  // sum of squared logs
  const double rest = g * cell.mean - centre;
  double value = cell.n * (std::log(g) - kLogRoot2Pi - cell.mean) -
                 0.5 * (cell.n * rest * rest + g * g * cell.squares);
  double by_centre = cell.n * rest, by_g = cell.n / g - (g * about_0 - centre * sum);
  double centre_centre = cell.n, centre_g = -sum, g_g = cell.n / (g * g) + about_0;
  for (const auto& [limit, n] : cell.censored) {
    const double z = g * limit - centre;
    const NormalTail tail = upper_tail(z);
    const double bend = n * tail.hazard * (tail.hazard - z);
    value += n * tail.log;
    by_centre += n * tail.hazard;
    by_g -= n * tail.hazard * limit;
    centre_centre += bend;
    centre_g -= bend * limit;
    g_g += bend * limit * limit;
  }
  out.a += by_centre;
  out.g += by_g;
  out.aa += centre_centre;
  out.ag += centre_g;
  out.gg += g_g;
  if (renderer) {
    out.b += by_centre;
    out.ab += centre_centre;
    out.bb += centre_centre;
    out.bg += centre_g;
  }
  return value;
}

/// Log likelihood and its derivatives at given parameters, by participant.
struct Evaluation {
  double log_likelihood = 0;
  std::vector<Curvature> participants;
};

Evaluation evaluate(const std::vector<ParticipantData>& participants, const Parameters& at) {
  Evaluation out;
  out.participants.resize(participants.size());
  for (std::size_t p = 0; p < participants.size(); ++p) {
    for (const bool renderer : {false, true}) {
      out.log_likelihood += add_cell(participants[p][renderer ? 1 : 0], at.intercepts[p], at,
                                     renderer, out.participants[p]);
    }
  }
  return out;
}

/// Information on slope and precision with the intercepts profiled out (Schur complement).
struct Reduced {
  double b = 0, g = 0, bb = 0, bg = 0, gg = 0;

  double determinant() const { return bb * gg - bg * bg; }
  /// Newton step of slope and precision.
  std::pair<double, double> solve(double by_b, double by_g) const {
    return {(gg * by_b - bg * by_g) / determinant(), (bb * by_g - bg * by_b) / determinant()};
  }
};

Reduced reduce(const Evaluation& evaluation) {
  Reduced out;
  for (const Curvature& c : evaluation.participants) {
    out.b += c.b - c.ab * c.a / c.aa;
    out.g += c.g - c.ag * c.a / c.aa;
    out.bb += c.bb - c.ab * c.ab / c.aa;
    out.bg += c.bg - c.ab * c.ag / c.aa;
    out.gg += c.gg - c.ag * c.ag / c.aa;
  }
  return out;
}

Parameters first_guess(const std::vector<ParticipantData>& participants) {
  double n = 0, squares = 0;
  Parameters out;
  for (const ParticipantData& participant : participants) {
    double weight = 0, sum = 0;
    for (const Cell& cell : participant) {
      n += cell.n;
      squares += cell.squares;
      weight += cell.n;
      sum += cell.n * cell.mean;
      for (const auto& [limit, count] : cell.censored) {
        weight += count;
        sum += count * limit;
      }
    }
    out.intercepts.push_back(sum / weight);
  }
  out.precision = 1 / std::max(std::sqrt(squares / n), 0.1);
  for (double& intercept : out.intercepts) intercept *= out.precision;
  return out;
}

/// Newton's method with step halving. \return reason if there is no maximum; empty: converged
std::string maximise_likelihood(const std::vector<ParticipantData>& participants, Parameters& at,
                                Evaluation& here) {
  at = first_guess(participants);
  here = evaluate(participants, at);
  for (int step = 0; step < kMostSteps; ++step) {
    const Reduced reduced = reduce(here);
    if (!(reduced.determinant() > 0)) return "effects of renderer and participant are confounded";
    const auto [by_slope, by_precision] = reduced.solve(reduced.b, reduced.g);
    double gain = reduced.b * by_slope + reduced.g * by_precision;
    std::vector<double> by_intercept;
    by_intercept.reserve(participants.size());
    for (const Curvature& c : here.participants) {
      by_intercept.push_back((c.a - c.ab * by_slope - c.ag * by_precision) / c.aa);
      gain += c.a * c.a / c.aa;
    }
    if (gain <= kClose * (1 + std::fabs(here.log_likelihood))) return {};
    double step_length = 1;
    for (;; step_length /= 2) {
      if (step_length < 1e-10)
        return {};  // no higher value along the step: the maximum up to rounding
      Parameters next = at;
      next.slope += step_length * by_slope;
      next.precision += step_length * by_precision;
      for (std::size_t p = 0; p < participants.size(); ++p) {
        next.intercepts[p] += step_length * by_intercept[p];
      }
      if (!(next.precision > 0)) continue;
      Evaluation there = evaluate(participants, next);
      if (!(there.log_likelihood >= here.log_likelihood)) continue;
      at = std::move(next);
      here = std::move(there);
      break;
    }
    if (at.precision > kEndless) return "no variance: the times fit without a residual";
    if (std::fabs(at.slope / at.precision) > kLongestRatio)
      return "the estimate of the difference diverges";
  }
  return "the maximum of the likelihood was not found";
}

void put_errors(const Parameters& at, const Evaluation& maximum, CensoredEstimate& out) {
  const Reduced reduced = reduce(maximum);
  // Delta method: derivatives of log ratio = slope / precision.
  const double by_b = 1 / at.precision, by_g = -at.slope / (at.precision * at.precision);
  const auto [weight_b, weight_g] = reduced.solve(by_b, by_g);
  out.se_model = std::sqrt(by_b * weight_b + by_g * weight_g);
  const auto n = static_cast<double>(maximum.participants.size());
  double squares = 0;
  for (const Curvature& c : maximum.participants) {
    // At the maximum the score of each participant's intercept is 0.
    const double influence = weight_b * c.b + weight_g * c.g;
    squares += influence * influence;
  }
  out.df = n - 1;
  if (n < 2) {
    out.undefined = "one participant, so no variance between participants";
    return;
  }
  out.se_log_ratio = std::sqrt(squares * n / (n - 1));
  if (*out.se_log_ratio <= 1e-10 * std::max(1.0, std::fabs(*out.log_ratio))) {
    out.undefined = "all participants have the same gain (no variance)";
    return;
  }
  const double half = quantile(boost::math::students_t(n - 1), 0.975) * *out.se_log_ratio;
  out.log_ratio_ci95 = Interval{*out.log_ratio - half, *out.log_ratio + half};
}

CensoredEstimate estimate(const std::vector<ParticipantData>& participants,
                          const RendererPair& pair) {
  CensoredEstimate out;
  out.n_participants = participants.size();
  std::array<double, 2> observed{};
  double limits = 0;
  for (const ParticipantData& participant : participants) {
    for (std::size_t r = 0; r < 2; ++r) {
      observed[r] += participant[r].n;
      for (const auto& [limit, n] : participant[r].censored) limits += n;
    }
  }
  out.n_observed = static_cast<std::size_t>(observed[0] + observed[1]);
  out.n_censored = static_cast<std::size_t>(limits);
  if (participants.empty()) {
    out.undefined = "no participant has trials with both renderers and a time";
  } else if (observed[0] == 0 || observed[1] == 0) {
    out.undefined = "no time with " +
                    with_article(observed[0] == 0 ? pair.reference : pair.renderer) +
                    ": how much longer than the limit its trials take is not known";
  }
  if (!out.undefined.empty()) return out;
  Parameters at;
  Evaluation maximum;
  out.undefined = maximise_likelihood(participants, at, maximum);
  if (!out.undefined.empty()) return out;
  out.log_ratio = at.slope / at.precision;
  out.residual_sd = 1 / at.precision;
  out.log_likelihood = maximum.log_likelihood;
  put_errors(at, maximum, out);
  return out;
}

CensoredEstimate estimate_shape(const Description& description, const TimeOuts& time_outs,
                                const RendererPair& pair, std::size_t shape) {
  const std::array<std::size_t, 2> renderers{*pair.reference_at, *pair.renderer_at};
  std::vector<ParticipantData> all(description.participant_cells[0][shape].size());
  for (std::size_t r = 0; r < 2; ++r) {
    for (std::size_t p = 0; p < all.size(); ++p) {
      const ParticipantCell& cell = description.participant_cells[renderers[r]][shape][p];
      all[p][r].n = static_cast<double>(cell.n_used);
      all[p][r].mean = cell.mean_log;
      all[p][r].squares = cell.sum_of_squares_log;
    }
    for (const TimeOutGroup& group : time_outs.cells[renderers[r]][shape].groups) {
      if (!group.has_limit()) {
        CensoredEstimate out;
        out.undefined = "a time-out has no time: its limit is not known";
        return out;
      }
      all[group.participant][r].censored.emplace_back(std::log(group.limit),
                                                      static_cast<double>(group.n));
    }
  }
  std::erase_if(all, [](const ParticipantData& participant) {
    return participant[0].empty() || participant[1].empty() ||
           participant[0].n + participant[1].n == 0;
  });
  return estimate(all, pair);
}

}  // namespace

bool TimeOutGroup::has_limit() const { return std::isfinite(limit) && limit > 0; }

double TimeOutCell::proportion() const {
  return n_trials == 0 ? 0 : static_cast<double>(n_timeouts) / static_cast<double>(n_trials);
}

TimeOuts time_outs(const TrialTable& table, const Description& description) {
  TimeOuts out;
  const std::size_t n_shapes = table.shapes.size();
  out.cells.assign(table.renderers.size(), std::vector<TimeOutCell>(n_shapes));
  using ParticipantAndLimit = std::pair<std::uint32_t, double>;  // participant and limit
  std::vector<std::map<ParticipantAndLimit, std::size_t>> counts(table.renderers.size() * n_shapes);
  for (const TrialRow& row : table.rows) {
    if (!row.timed_out) continue;
    // NaN would break the ordering of the map.
    const double limit = std::isfinite(row.response_time) ? row.response_time : 0;
    ++counts[row.renderer * n_shapes + row.shape][{row.participant, limit}];
  }
  for (std::size_t r = 0; r < out.cells.size(); ++r) {
    for (std::size_t s = 0; s < n_shapes; ++s) {
      TimeOutCell& cell = out.cells[r][s];
      cell.n_trials = description.accuracy[r][s].n_trials;
      for (const auto& [key, n] : counts[r * n_shapes + s]) {
        cell.groups.push_back({key.first, key.second, n});
        cell.n_timeouts += n;
      }
      out.any = out.any || cell.n_timeouts > 0;
      find_most_affected(description.participant_cells[r][s], cell);
    }
  }
  return out;
}

std::vector<CensoredEstimate> censored_by_shape(const Description& description,
                                                const TimeOuts& time_outs,
                                                const RendererPair& pair) {
  if (!pair.in_data()) return {};
  const auto timed_out = [&](std::size_t renderer) {
    return std::ranges::any_of(time_outs.cells[renderer],
                               [](const TimeOutCell& cell) { return cell.n_timeouts > 0; });
  };
  if (!timed_out(*pair.reference_at) && !timed_out(*pair.renderer_at)) return {};
  std::vector<CensoredEstimate> out;
  const std::size_t n_shapes = description.participant_cells[0].size();
  out.reserve(n_shapes);
  for (std::size_t s = 0; s < n_shapes; ++s) {
    out.push_back(estimate_shape(description, time_outs, pair, s));
  }
  return out;
}

}  // namespace palpate::analysis
