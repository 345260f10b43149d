#include "analysis/statistics/censored.h"

#include <algorithm>
#include <array>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

namespace palpate::analysis {

namespace {

constexpr double kLogRoot2Pi = 0.91893853320467274178;
constexpr int kMostSteps = 100;
constexpr double kClose = 1e-13;      // of a step's gain in likelihood, relative
constexpr double kEndless = 1e8;      // 1 / sd of residuals: the times fit without rest
constexpr double kLongestRatio = 50;  // |log ratio|: no data end there

/// The upper tail of the standard normal distribution: its log, and the hazard density / tail.
struct Tail {
  double log = 0, hazard = 0;
};

Tail upper_tail(double z) {
  const double log_density = -0.5 * z * z - kLogRoot2Pi;
  Tail tail;
  if (z < 20) {
    tail.log = std::log(0.5 * std::erfc(z / std::sqrt(2.0)));
  } else {  // erfc would vanish: Abramowitz & Stegun 26.2.12, to 1e-10 from here
    const double q = 1 / (z * z);
    tail.log =
        log_density - std::log(z) + std::log1p(-q * (1 - q * (3 - q * (15 - q * (105 - 945 * q)))));
  }
  tail.hazard = std::exp(log_density - tail.log);
  return tail;
}

/// One participant's trials with one renderer.
struct Cell {
  double n = 0, mean = 0, squares = 0;              ///< of the logs of times
  std::vector<std::pair<double, double>> censored;  ///< log limit, trials

  bool empty() const { return n == 0 && censored.empty(); }
};

/// [0]: reference, [1]: renderer.
using Person = std::array<Cell, 2>;

/// With Olsen's (1978) parameters the likelihood is concave: precision = 1 / sd, the others times
/// precision.
struct Parameters {
  std::vector<double> intercepts;
  double slope = 0, precision = 1;
};

/// Gradient and negative second derivatives by one participant's intercept a, the slope b and the
/// precision g.
struct Curvature {
  double a = 0, b = 0, g = 0, aa = 0, ab = 0, ag = 0, bb = 0, bg = 0, gg = 0;
};

/// Adds a cell's part. \return its log likelihood
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
    const Tail tail = upper_tail(z);
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

/// The likelihood and its curvature at one place, a participant at a time.
struct Evaluation {
  double log_likelihood = 0;
  std::vector<Curvature> people;
};

Evaluation evaluate(const std::vector<Person>& people, const Parameters& at) {
  Evaluation out;
  out.people.resize(people.size());
  for (std::size_t p = 0; p < people.size(); ++p) {
    for (const bool renderer : {false, true}) {
      out.log_likelihood +=
          add_cell(people[p][renderer ? 1 : 0], at.intercepts[p], at, renderer, out.people[p]);
    }
  }
  return out;
}

/// What is left of slope and precision when every participant's intercept follows them.
struct Reduced {
  double b = 0, g = 0, bb = 0, bg = 0, gg = 0;

  double determinant() const { return bb * gg - bg * bg; }
  /// Solves for slope and precision.
  std::pair<double, double> solve(double by_b, double by_g) const {
    return {(gg * by_b - bg * by_g) / determinant(), (bb * by_g - bg * by_b) / determinant()};
  }
};

Reduced reduce(const Evaluation& evaluation) {
  Reduced out;
  for (const Curvature& c : evaluation.people) {
    out.b += c.b - c.ab * c.a / c.aa;
    out.g += c.g - c.ag * c.a / c.aa;
    out.bb += c.bb - c.ab * c.ab / c.aa;
    out.bg += c.bg - c.ab * c.ag / c.aa;
    out.gg += c.gg - c.ag * c.ag / c.aa;
  }
  return out;
}

Parameters first_guess(const std::vector<Person>& people) {
  double n = 0, squares = 0;
  Parameters out;
  for (const Person& person : people) {
    double weight = 0, sum = 0;
    for (const Cell& cell : person) {
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

/// Newton's method with halved steps where a whole one leads down.
/// \return why there is no end; empty where there is one
std::string climb(const std::vector<Person>& people, Parameters& at, Evaluation& here) {
  at = first_guess(people);
  here = evaluate(people, at);
  for (int step = 0; step < kMostSteps; ++step) {
    const Reduced reduced = reduce(here);
    if (!(reduced.determinant() > 0)) return "renderers and participants cannot be told apart";
    const auto [by_slope, by_precision] = reduced.solve(reduced.b, reduced.g);
    double gain = reduced.b * by_slope + reduced.g * by_precision;
    std::vector<double> by_intercept;
    by_intercept.reserve(people.size());
    for (const Curvature& c : here.people) {
      by_intercept.push_back((c.a - c.ab * by_slope - c.ag * by_precision) / c.aa);
      gain += c.a * c.a / c.aa;
    }
    if (gain <= kClose * (1 + std::fabs(here.log_likelihood))) return {};
    double share = 1;
    for (;; share /= 2) {
      if (share < 1e-10) return {};  // nothing is higher: this is the top up to rounding
      Parameters next = at;
      next.slope += share * by_slope;
      next.precision += share * by_precision;
      for (std::size_t p = 0; p < people.size(); ++p) {
        next.intercepts[p] += share * by_intercept[p];
      }
      if (!(next.precision > 0)) continue;
      Evaluation there = evaluate(people, next);
      if (!(there.log_likelihood >= here.log_likelihood)) continue;
      at = std::move(next);
      here = std::move(there);
      break;
    }
    if (at.precision > kEndless) return "no variance: the times fit without a residual";
    if (std::fabs(at.slope / at.precision) > kLongestRatio) return "the difference has no end";
  }
  return "the likelihood has no maximum that can be found";
}

void put_errors(const Parameters& at, const Evaluation& top, CensoredEstimate& out) {
  const Reduced reduced = reduce(top);
  // log ratio = slope / precision: its derivatives by both.
  const double by_b = 1 / at.precision, by_g = -at.slope / (at.precision * at.precision);
  const auto [weight_b, weight_g] = reduced.solve(by_b, by_g);
  out.se_model = std::sqrt(by_b * weight_b + by_g * weight_g);
  const auto n = static_cast<double>(top.people.size());
  double squares = 0;
  for (const Curvature& c : top.people) {
    // A participant's scores of the own intercept sum to 0 at the top.
    const double influence = weight_b * c.b + weight_g * c.g;
    squares += influence * influence;
  }
  out.df = n - 1;
  if (n < 2) {
    out.undefined = "one participant cannot tell chance from effect";
    return;
  }
  out.se_log_ratio = std::sqrt(squares * n / (n - 1));
  if (*out.se_log_ratio <= 1e-10 * std::max(1.0, std::fabs(*out.log_ratio))) {
    out.undefined = "no variance: all participants gain alike";
    return;
  }
  const double half = quantile(boost::math::students_t(n - 1), 0.975) * *out.se_log_ratio;
  out.log_ratio_ci95 = Interval{*out.log_ratio - half, *out.log_ratio + half};
}

CensoredEstimate estimate(const std::vector<Person>& people, const RendererPair& pair) {
  CensoredEstimate out;
  out.n_participants = people.size();
  std::array<double, 2> observed{};
  double limits = 0;
  for (const Person& person : people) {
    for (std::size_t r = 0; r < 2; ++r) {
      observed[r] += person[r].n;
      for (const auto& [limit, n] : person[r].censored) limits += n;
    }
  }
  out.n_observed = static_cast<std::size_t>(observed[0] + observed[1]);
  out.n_censored = static_cast<std::size_t>(limits);
  if (people.empty()) {
    out.undefined = "no participant has trials with both renderers and a time";
  } else if (observed[0] == 0 || observed[1] == 0) {
    out.undefined = "no time with " + the(observed[0] == 0 ? pair.reference : pair.renderer) +
                    ": how much longer than the limit its trials take is not known";
  }
  if (!out.undefined.empty()) return out;
  Parameters at;
  Evaluation top;
  out.undefined = climb(people, at, top);
  if (!out.undefined.empty()) return out;
  out.log_ratio = at.slope / at.precision;
  out.residual_sd = 1 / at.precision;
  out.log_likelihood = top.log_likelihood;
  put_errors(at, top, out);
  return out;
}

CensoredEstimate estimate_shape(const Description& description, const TimeOuts& time_outs,
                                const RendererPair& pair, std::size_t shape) {
  const std::array<std::size_t, 2> renderers{*pair.reference_at, *pair.renderer_at};
  std::vector<Person> all(description.people[0][shape].size());
  for (std::size_t r = 0; r < 2; ++r) {
    for (std::size_t p = 0; p < all.size(); ++p) {
      const ParticipantCell& cell = description.people[renderers[r]][shape][p];
      all[p][r].n = static_cast<double>(cell.n_used);
      all[p][r].mean = cell.mean_log;
      all[p][r].squares = cell.squares_log;
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
  std::erase_if(all, [](const Person& person) {
    return person[0].empty() || person[1].empty() || person[0].n + person[1].n == 0;
  });
  return estimate(all, pair);
}

}  // namespace

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
  const std::size_t n_shapes = description.people[0].size();
  out.reserve(n_shapes);
  for (std::size_t s = 0; s < n_shapes; ++s) {
    out.push_back(estimate_shape(description, time_outs, pair, s));
  }
  return out;
}

}  // namespace palpate::analysis
