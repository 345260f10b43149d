#include "analysis/statistics/field_fit.h"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/tools/minima.hpp>
#include <boost/math/tools/roots.hpp>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <set>

namespace palpate::analysis {
namespace {

using protocols::FieldForm;
using protocols::FieldFunction;
using protocols::LevelPoint;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kLeastFieldProbability = 1e-12;

/// The scales on which a participant's answers are fitted.
struct FieldScales {
  double least = 0, middle = 0;              ///< of the other dimension, in its unit
  double x_range = 1;                        ///< of x, threshold forms: of its places
  double other_middle = 0, other_range = 1;  ///< threshold forms: of the places of x2
};

double place_of_x(const FieldFunction& function, const LevelPoint& point) {
  return protocols::scale_position(function.x_scale, point[function.x]);
}
double place_of_other(const FieldFunction& function, const LevelPoint& point) {
  return protocols::scale_position(function.other_scale, point[function.other]);
}

FieldScales scales_of(const std::vector<PointCount>& counts, const FieldFunction& function) {
  FieldScales scales;
  std::set<double> others;
  double low = kInfinity, high = -kInfinity, other_low = kInfinity, other_high = -kInfinity;
  for (const PointCount& count : counts) {
    others.insert(count.point[function.other]);
    const double x = has_two_lapses(function.form)
                         ? count.point[function.x] - count.point[function.other]
                         : place_of_x(function, count.point);
    low = std::min(low, x);
    high = std::max(high, x);
    other_low = std::min(other_low, place_of_other(function, count.point));
    other_high = std::max(other_high, place_of_other(function, count.point));
  }
  scales.least = *others.begin();
  scales.middle = *std::next(others.begin(), static_cast<std::ptrdiff_t>(others.size() / 2));
  if (high > low) scales.x_range = high - low;
  scales.other_middle = 0.5 * (other_low + other_high);
  if (other_high > other_low) scales.other_range = other_high - other_low;
  return scales;
}

FieldScales scales_with(const std::vector<PointCount>& counts, const FieldModel& model) {
  FieldScales scales = scales_of(counts, model.function);
  scales.middle = model.middle.value_or(scales.middle);
  return scales;
}

/// A parameter as the search has it: unbounded, of a size near 1.
struct Coordinate {
  std::function<double(double)> value;  ///< of the coordinate, in the parameter's unit
  std::function<double(double)> place;  ///< the inverse
  double least = -kInfinity;            ///< that the parameter can be
};

Coordinate positive() {
  return {[](double u) { return std::exp(std::clamp(u, -40.0, 40.0)); },
          [](double v) { return std::log(std::max(v, 1e-17)); }, 0};
}
Coordinate above(double least, double unit) {
  return {[=](double u) { return least + unit * std::exp(std::clamp(u, -20.0, 12.0)); },
          [=](double v) { return std::log(std::max((v - least) / unit, 1e-9)); }, least};
}
Coordinate any(double unit) {
  return {[=](double u) { return unit * u; }, [=](double v) { return v / unit; }};
}
/// From 0 to `most`, both included.
Coordinate rate(double most) {
  return {[=](double u) { return most * std::sin(u) * std::sin(u); },
          [=](double v) { return std::asin(std::sqrt(std::clamp(v / most, 0.0, 1.0))); }};
}

std::vector<Coordinate> coordinates_of(const FieldModel& model, const FieldScales& scales) {
  std::vector<Coordinate> out;
  const double t = scales.x_range, r = scales.other_range;
  switch (model.function.form) {
    case FieldForm::weber:
      out = {positive(), above(-scales.least, std::max(std::abs(scales.middle), 1e-12))};
      break;
    case FieldForm::power:
      out = {positive(), any(1)};
      break;
    case FieldForm::threshold_line:
      out = {positive(), any(t), any(t / r)};
      break;
    case FieldForm::threshold_parabola:
      out = {positive(), any(t), any(t / r), any(t / (r * r))};
      break;
    case FieldForm::cues:
      out = {any(1), positive()};
      break;
  }
  if (!has_two_lapses(model.function.form) && model.guess.free)
    out.push_back(rate(model.guess.most));
  out.push_back(rate(kMostLapse));
  return out;
}

double log_binomial_part(int trials, int successes, double p) {
  const double q = std::clamp(p, kLeastFieldProbability, 1 - kLeastFieldProbability);
  return successes * std::log(q) + (trials - successes) * std::log(1 - q);
}

/// The answers of a participant, and the likelihood of parameters.
class FieldLikelihood {
 public:
  FieldLikelihood(const std::vector<PointCount>& counts, const FieldModel& model)
      : counts_(counts),
        model_(model),
        scales_(scales_with(counts, model)),
        coordinates_(coordinates_of(model, scales_)) {}

  const FieldScales& scales() const { return scales_; }
  const std::vector<Coordinate>& coordinates() const { return coordinates_; }
  std::size_t form_size() const { return parameter_names(model_.function.form).size(); }

  double guess_of(const std::vector<double>& values) const {
    if (has_two_lapses(model_.function.form)) return values.back();
    return model_.guess.free ? values[values.size() - 2] : model_.guess.value;
  }
  double with_rates(double share, const std::vector<double>& values) const {
    const double guess = guess_of(values);
    return guess + (1 - guess - values.back()) * share;
  }
  double of_catch_trials(const std::vector<double>& values) const {
    if (model_.catch_trials == 0) return 0;
    return log_binomial_part(model_.catch_trials, model_.catch_successes, guess_of(values));
  }
  /// \param values  in their units: the form's, a free guess, the lapse
  double log_likelihood(const std::vector<double>& values) const {
    double sum = of_catch_trials(values);
    for (const PointCount& count : counts_)
      sum +=
          log_binomial_part(count.trials, count.successes,
                            with_rates(field_share(model_.function, values, count.point), values));
    return sum;
  }

  std::vector<std::vector<double>> starts() const {
    const double x = scales_.x_range, s = std::max(std::abs(scales_.middle), 1e-12);
    std::vector<std::vector<double>> out;
    switch (model_.function.form) {
      case FieldForm::weber:
        for (const double jnd : {0.02, 0.08, 0.25})
          for (const double c : {0.0, 1.0}) out.push_back({jnd * x / (s * (1 + c)), c * s});
        break;
      case FieldForm::power:
        for (const double jnd : {0.02, 0.08, 0.25})
          for (const double a : {0.2, 1.0}) out.push_back({jnd * x / std::pow(s, a), a});
        break;
      case FieldForm::threshold_line:
      case FieldForm::threshold_parabola:
        for (const double slope : {4.0, 15.0}) {
          for (const double place : {0.25, 0.5, 0.75}) {
            out.push_back({slope / x, lowest_x() + place * x, 0});
            if (model_.function.form == FieldForm::threshold_parabola) out.back().push_back(0);
          }
        }
        break;
      case FieldForm::cues:
        for (const double w : {0.2, 0.8})
          for (const double sd : {0.03, 0.1, 0.3}) out.push_back({w, sd * x});
        break;
    }
    for (std::vector<double>& one : out) {
      if (!has_two_lapses(model_.function.form) && model_.guess.free) one.push_back(0.1);
      one.push_back(0.02);
    }
    return out;
  }

  const std::vector<PointCount>& counts() const { return counts_; }
  const FieldModel& model() const { return model_; }

 private:
  double lowest_x() const {
    double low = kInfinity;
    for (const PointCount& count : counts_)
      low = std::min(low, place_of_x(model_.function, count.point));
    return low;
  }

  const std::vector<PointCount>& counts_;
  const FieldModel& model_;
  FieldScales scales_;
  std::vector<Coordinate> coordinates_;
};

/// Values with some of them held.
using Completed = std::function<std::vector<double>(const std::vector<double>&)>;

/// The greatest log likelihood over the coordinates `free`; `values` is start and place.
/// \param complete  makes all values of those with the free ones changed
double maximize(const FieldLikelihood& likelihood, const std::vector<std::size_t>& free,
                const Completed& complete, std::vector<double>& values) {
  if (free.empty()) return likelihood.log_likelihood(complete(values));
  std::vector<double> start;
  for (const std::size_t k : free) start.push_back(likelihood.coordinates()[k].place(values[k]));
  const auto placed = [&](const std::vector<double>& at) {
    std::vector<double> all = values;
    for (std::size_t i = 0; i < free.size(); ++i)
      all[free[i]] = likelihood.coordinates()[free[i]].value(at[i]);
    return complete(all);
  };
  const SimplexMinimum found = minimize(
      [&](const std::vector<double>& at) { return -likelihood.log_likelihood(placed(at)); }, start,
      std::vector<double>(free.size(), 0.2), 1e-9);
  values = placed(found.place);
  return -found.value;
}

std::vector<std::size_t> all_but(std::size_t count, std::size_t held) {
  std::vector<std::size_t> out;
  for (std::size_t k = 0; k < count; ++k)
    if (k != held) out.push_back(k);
  return out;
}

/// Where the loss crosses that of a 95 % interval. \param loss_inside, loss_outside  below and
/// above it
double crossing(const std::function<double(double)>& loss_at, double inside, double outside,
                double loss_inside, double loss_outside) {
  constexpr double kNear = 1e-5;
  std::uintmax_t most = 40;
  const bool up = inside < outside;
  const auto [low, high] = boost::math::tools::toms748_solve(
      [&](double u) { return loss_at(u) - kHalfChiSquared95; }, up ? inside : outside,
      up ? outside : inside, (up ? loss_inside : loss_outside) - kHalfChiSquared95,
      (up ? loss_outside : loss_inside) - kHalfChiSquared95,
      [](double a, double b) { return std::abs(a - b) < kNear; }, most);
  return 0.5 * (low + high);
}

/// The end of a profile interval on one side. \param loss_at  at a coordinate: loss of profile log
/// likelihood \return the coordinate; infinite: nothing is excluded
double profile_end(const std::function<double(double)>& loss_at, double best, double direction) {
  double inside = best, step = 0.1, loss_inside = 0;
  for (int i = 0; i < 12; ++i, step *= 2) {
    const double outside = inside + direction * step, loss = loss_at(outside);
    if (loss > kHalfChiSquared95) return crossing(loss_at, inside, outside, loss_inside, loss);
    inside = outside;
    loss_inside = loss;
  }
  return direction * kInfinity;
}

/// \param held  coordinate that the profile is of \param complete  see maximize
FieldParameter profiled(const FieldLikelihood& likelihood, const std::vector<double>& best,
                        double most, std::size_t held, const Coordinate& coordinate,
                        const std::function<double(const std::vector<double>&)>& value_of,
                        const std::function<Completed(double)>& completing) {
  FieldParameter out;
  out.value = value_of(best);
  const std::vector<std::size_t> free = all_but(best.size(), held);
  const auto end = [&](double direction) {
    std::vector<double> values = best;  // each end goes on from the place before
    const double at = profile_end(
        [&](double u) {
          std::vector<double> own = values;
          const double reached = maximize(likelihood, free, completing(coordinate.value(u)), own);
          if (most - reached <= kHalfChiSquared95) values = own;
          return most - reached;
        },
        coordinate.place(out.value), direction);
    return std::isfinite(at) ? coordinate.value(at) : coordinate.value(direction * 50);
  };
  const auto is_open = [&](double direction, double value) {
    return !std::isfinite(value) || value == coordinate.value(direction * 50);
  };
  out.ci95 = {end(-1), end(1)};
  const bool low_open = is_open(-1, out.ci95.low), high_open = is_open(1, out.ci95.high);
  out.closed = !low_open && !high_open;
  if (low_open) out.ci95.low = coordinate.least;
  if (high_open) out.ci95.high = kInfinity;
  return out;
}

/// A rate's end is 0 or its maximum if no value on that side is excluded.
FieldParameter profiled_rate(const FieldLikelihood& likelihood, const std::vector<double>& best,
                             double most, std::size_t held, double largest) {
  FieldParameter out;
  out.value = best[held];
  const std::vector<std::size_t> free = all_but(best.size(), held);
  const auto loss_at = [&](double value) {
    std::vector<double> own = best;
    return most - maximize(
                      likelihood, free,
                      [&](std::vector<double> all) {
                        all[held] = value;
                        return all;
                      },
                      own);
  };
  const auto end = [&](double limit) {
    const double loss = loss_at(limit);
    return loss > kHalfChiSquared95 ? crossing(loss_at, out.value, limit, 0, loss) : limit;
  };
  out.ci95 = {end(0), end(largest)};
  out.closed = out.ci95.low > 0 && out.ci95.high < largest;
  return out;
}

/// Opens the ends of w and c at which the JND is as good as constant, and that of c where it is 0
/// at the least standard: the search has bounds there.
void open_flat_ends(const FieldScales& scales, const std::vector<double>& best,
                    std::vector<FieldParameter>& parameters) {
  constexpr double kLevel = 0.02;
  FieldParameter &w = parameters[0], &c = parameters[1];
  const double least_w =
      kLevel *
      std::abs(protocols::field_jnd(FieldForm::weber, best, scales.middle) / scales.middle);
  const double most_c = scales.middle / kLevel;
  if (w.ci95.low < least_w) {
    w.ci95.low = 0;
    w.closed = false;
  }
  if (c.ci95.high > most_c) {
    c.ci95.high = kInfinity;
    c.closed = false;
  }
  if (c.ci95.low < -scales.least + 1e-3 * scales.middle) {
    c.ci95.low = -scales.least;
    c.closed = false;
  }
}

void add_parameters(const FieldLikelihood& likelihood, const std::vector<double>& best, double most,
                    FieldFit& fit) {
  const FieldForm form = likelihood.model().function.form;
  const std::vector<std::string> names = parameter_names(form);
  const bool has_jnd = form == FieldForm::weber || form == FieldForm::power;
  const double middle = likelihood.scales().middle;
  const auto jnd_of = [form, middle](const std::vector<double>& values) {
    return protocols::field_jnd(form, values, middle);
  };
  const auto with_jnd = [jnd_of](std::vector<double> all, double jnd) {
    all[0] = 1;
    all[0] = jnd / jnd_of(all);
    return all;
  };
  for (std::size_t k = 0; k < names.size(); ++k) {
    fit.parameters.push_back(profiled(
        likelihood, best, most, k, likelihood.coordinates()[k],
        [k](const std::vector<double>& values) { return values[k]; },
        [=](double value) -> Completed {
          return [=](std::vector<double> all) {
            // The search is of the JND where c or a is held: w alone would lose it.
            const double jnd = has_jnd && k == 1 ? jnd_of(all) : 0;
            all[k] = value;
            return has_jnd && k == 1 ? with_jnd(std::move(all), jnd) : all;
          };
        }));
    fit.parameters.back().name = names[k];
  }
  if (form == FieldForm::weber) open_flat_ends(likelihood.scales(), best, fit.parameters);
  if (has_jnd) {
    // w follows from the JND and the other parameter.
    fit.jnd = profiled(
        likelihood, best, most, 0, positive(), jnd_of, [with_jnd](double value) -> Completed {
          return [=](std::vector<double> all) { return with_jnd(std::move(all), value); };
        });
    fit.jnd->name = "jnd";
  }
  if (best.size() > names.size() + 1) {
    fit.parameters.push_back(
        profiled_rate(likelihood, best, most, names.size(), likelihood.model().guess.most));
    fit.parameters.back().name = "guess";
  }
  fit.parameters.push_back(profiled_rate(likelihood, best, most, best.size() - 1, kMostLapse));
  fit.parameters.back().name = "lapse";
}

FieldMisfit misfit_of(const FieldLikelihood& likelihood, const std::vector<double>& best,
                      double most) {
  FieldMisfit out;
  const FieldFunction& function = likelihood.model().function;
  std::map<double, std::vector<const PointCount*>> places;
  for (const PointCount& count : likelihood.counts())
    places[count.point[place_dimension(function)]].push_back(&count);
  const std::optional<std::size_t> width = protocols::width_parameter(function.form);
  const auto locations = likelihood.form_size() - (width ? 1 : 0);
  if (places.size() > kMostMisfitPlaces) {
    out.undefined = "more than " + std::to_string(kMostMisfitPlaces) + " different places";
    return out;
  }
  for (const auto& [at, counts] : places) {
    FieldMisfit::Place place{at, 0, 0, field_location(function, best, at)};
    for (const PointCount* count : counts) place.trials += count->trials;
    out.places.push_back(place);
    if (place.trials < kFewestMisfitTrials)
      out.undefined = "fewer than " + std::to_string(kFewestMisfitTrials) + " trials at a place";
  }
  if (places.size() <= locations)
    out.undefined = "no more places than the form has parameters for them";
  if (!out.undefined.empty()) return out;
  out.df = static_cast<int>(places.size() - locations);
  const bool ratios = function.form == FieldForm::weber || function.form == FieldForm::power;
  const double unit = ratios ? 1 : likelihood.scales().x_range;
  // The locations one by one, within a search of what they share. Ratios of locations are searched
  // from 1/20 to 20, others three ranges of x to each side.
  constexpr double kFar = 3;
  constexpr int kBits = 24;
  const auto value_at = [&](const std::vector<double>& shared, std::vector<double>* found) {
    double sum = likelihood.of_catch_trials(shared);
    std::size_t k = 0;
    for (const auto& [at, counts] : places) {
      const double start = out.places[k++].fitted;
      const auto of = [&](double u) {
        return ratios ? start * std::exp(std::clamp(u, -20.0, 20.0)) : start + unit * u;
      };
      const auto loss = [&](double u) {
        double own = 0;
        for (const PointCount* count : counts)
          own -= log_binomial_part(
              count->trials, count->successes,
              likelihood.with_rates(
                  field_share_at(function, count->point, of(u), width ? shared[*width] : 1),
                  shared));
        return own;
      };
      const auto [u, least] = boost::math::tools::brent_find_minima(loss, -kFar, kFar, kBits);
      sum -= least;
      if (found != nullptr) found->push_back(of(u));
    }
    return sum;
  };
  std::vector<std::size_t> free;
  for (std::size_t k = likelihood.form_size(); k < best.size(); ++k) free.push_back(k);
  if (width) free.push_back(*width);
  std::vector<double> start;
  for (const std::size_t k : free) start.push_back(likelihood.coordinates()[k].place(best[k]));
  const auto shared_at = [&](const std::vector<double>& u) {
    std::vector<double> shared = best;
    for (std::size_t i = 0; i < free.size(); ++i)
      shared[free[i]] = likelihood.coordinates()[free[i]].value(u[i]);
    return shared;
  };
  const SimplexMinimum minimum =
      minimize([&](const std::vector<double>& u) { return -value_at(shared_at(u), nullptr); },
               start, std::vector<double>(start.size(), 0.1), 1e-7);
  std::vector<double> found;
  const double reached = value_at(shared_at(minimum.place), &found);
  for (std::size_t k = 0; k < found.size(); ++k) out.places[k].free = found[k];
  out.deviance = std::max(0.0, 2 * (reached - most));
  out.p = boost::math::cdf(boost::math::complement(boost::math::chi_squared(out.df), out.deviance));
  return out;
}

/// The reason that nothing can be fitted; "": none.
std::string no_fit(const std::vector<PointCount>& counts, const FieldModel& model) {
  int trials = 0, successes = 0;
  for (const PointCount& count : counts) {
    trials += count.trials;
    successes += count.successes;
    if (model.function.form == FieldForm::power && !(count.point[model.function.other] > 0))
      return "a standard is not above 0";
  }
  if (trials == 0) return "no answers";
  if (successes == 0 || successes == trials) return "all answers are alike";
  std::set<double> places;
  for (const PointCount& count : counts)
    places.insert(count.point[place_dimension(model.function)]);
  const std::size_t needed = model.function.form == FieldForm::threshold_parabola ? 3 : 2;
  if (places.size() < needed)
    return "fewer than " + std::to_string(needed) +
           " values of the dimension over which it changes";
  return "";
}

}  // namespace

std::vector<PointCount> sum_by_point(std::vector<PointCount> counts) {
  std::ranges::sort(counts, {}, &PointCount::point);
  std::vector<PointCount> sums;
  for (PointCount& count : counts) {
    if (sums.empty() || sums.back().point != count.point) {
      sums.push_back(std::move(count));
    } else {
      sums.back().trials += count.trials;
      sums.back().successes += count.successes;
    }
  }
  return sums;
}

std::vector<double> FieldFit::values(FieldForm form) const {
  std::vector<double> out;
  for (std::size_t k = 0; k < parameter_names(form).size(); ++k) out.push_back(parameters[k].value);
  return out;
}

FieldFit fit_field(const std::vector<PointCount>& counts, const FieldModel& model) {
  FieldFit fit;
  fit.undefined = no_fit(counts, model);
  for (const PointCount& count : counts) fit.trials += count.trials;
  if (!fit.undefined.empty()) return fit;
  const FieldLikelihood likelihood(counts, model);
  std::vector<std::size_t> all;
  for (std::size_t k = 0; k < likelihood.coordinates().size(); ++k) all.push_back(k);
  const Completed as_it_is = [](const std::vector<double>& values) { return values; };
  std::vector<double> best;
  double most = -kInfinity;
  for (const std::vector<double>& start : likelihood.starts()) {
    std::vector<double> values = start;
    const double reached = maximize(likelihood, all, as_it_is, values);
    if (reached <= most) continue;
    most = reached;
    best = values;
  }
  fit.middle = likelihood.scales().middle;
  fit.log_likelihood = most;
  fit.lapse = best.back();
  fit.guess = likelihood.guess_of(best);
  add_parameters(likelihood, best, most, fit);
  fit.misfit = misfit_of(likelihood, best, most);
  return fit;
}

}  // namespace palpate::analysis
