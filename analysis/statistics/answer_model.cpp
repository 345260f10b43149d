#include "analysis/statistics/answer_model.h"

#include <Eigen/Dense>
#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <tuple>
#include <utility>

#include "analysis/statistics/crossed_stimuli.h"
#include "analysis/statistics/design_effects.h"
#include "analysis/statistics/jobs.h"
#include "analysis/statistics/normal_tail.h"
#include "analysis/statistics/probit_mixed_model.h"
#include "analysis/statistics/quantiles.h"
#include "analysis/statistics/task_analysis.h"
#include "data/base/cell_name.h"
#include "data/base/random.h"

namespace palpate::analysis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Simulated studies without a value, above which there is no interval: it would be too short.
constexpr double kMostFailed = 0.025;

/// The cells of the analysis that one model covers.
using BlockCells = std::vector<const TaskCell*>;

bool has_answers(const TaskCell& cell) {
  return (cell.task == "compare" || cell.task == "detect") && !cell.field;
}

std::vector<BlockCells> blocks_of_answers(const std::vector<TaskCell>& cells) {
  std::vector<BlockCells> out;
  for (const TaskCell& cell : cells) {
    if (!has_answers(cell)) continue;
    const auto known = std::ranges::find_if(out, [&](const BlockCells& one) {
      return one.front()->task == cell.task && one.front()->block_name == cell.block_name &&
             base_name(one.front()->shape) == base_name(cell.shape);
    });
    if (known != out.end())
      known->push_back(&cell);
    else
      out.push_back({&cell});
  }
  return out;
}

std::string why_no_answer_model(const BlockCells& block) {
  for (const TaskCell* const cell : block) {
    if (cell->same_different)
      return "same/different answers do not rise from 0 to 1 with the level";
    if (cell->forced_choice)
      return "forced choices have a chance of success by guessing, which this model has not";
    if (!cell->no_function.empty()) return cell->no_function;
    if (cell->scale != block.front()->scale) return "its cells have levels on different scales";
  }
  return "";
}

/// Answers and design of a block.
struct BlockAnswers {
  std::string undefined;
  std::vector<StudyFactor> within;  ///< renderer, then factors
  bool crossed = false;
  std::size_t groups = 1;
  std::vector<LevelAnswers> answers;  ///< places from the centre, in an order of names alone
  double centre = 0;
  std::vector<std::string> participants, left_out, without_group;

  std::size_t conditions() const {
    std::size_t out = 1;
    for (const StudyFactor& factor : within) out *= factor.levels.size();
    return out;
  }
};

/// The names of each in order of their first mention.
template <class Name>
std::vector<std::string> names_in_block(const BlockCells& block, Name name) {
  std::vector<std::string> out;
  for (const TaskCell* const cell : block) note_once(name(*cell), out);
  return out;
}

std::size_t place_of_name(const std::vector<std::string>& names, const std::string& name) {
  return static_cast<std::size_t>(std::ranges::find(names, name) - names.begin());
}

/// Puts the answers into the block, centred. The order of the rows of a table changes nothing.
void put_answers(const BlockCells& block, const std::vector<std::string>& renderers,
                 const std::vector<std::string>& stimuli, const std::vector<std::size_t>& order,
                 const StudyTable& table, BlockAnswers& out) {
  using Key = std::tuple<std::string, std::string, std::string, double>;
  std::multimap<Key, LevelAnswers> sorted;  // logs of two levels may be one place
  std::set<std::string> without_group;
  const std::size_t conditions = out.conditions();
  for (const TaskCell* const cell : block) {
    const std::size_t condition = place_of_name(renderers, cell->renderer) * stimuli.size() +
                                  order[place_of_name(stimuli, cell->shape)];
    const bool is_log = cell->scale != protocols::LevelScale::linear;
    for (const ParticipantFunction& one : cell->functions) {
      const auto group = known_group(table.group_labels, one.participant);
      if (!group) without_group.insert(one.participant);
      if (!group || std::ranges::find(out.left_out, one.participant) != out.left_out.end())
        continue;
      for (const LevelCount& count : one.counts) {
        if (count.trials == 0) continue;
        const double place = is_log ? std::log10(count.level) : count.level;
        sorted.emplace(
            Key{one.participant, cell->shape, cell->renderer, place},
            LevelAnswers{0, *group * conditions + condition, place,
                         static_cast<double>(count.trials), static_cast<double>(count.successes)});
      }
    }
  }
  out.without_group.assign(without_group.begin(), without_group.end());
  double trials = 0;
  for (auto& [key, one] : sorted) {
    if (!std::isfinite(one.place))
      out.undefined = "a level of 0 has no place on a logarithmic scale";
    if (out.participants.empty() || out.participants.back() != std::get<0>(key))
      out.participants.push_back(std::get<0>(key));
    one.participant = out.participants.size() - 1;
    out.centre += one.trials * one.place;
    trials += one.trials;
    out.answers.push_back(one);
  }
  out.centre /= std::max(1.0, trials);
  for (LevelAnswers& one : out.answers) one.place -= out.centre;
  if (out.undefined.empty() && out.groups > 1 && out.participants.size() <= out.groups)
    out.undefined = "one participant in each group, so no variance within groups";
}

BlockAnswers answers_of_block(const BlockCells& block, const StudyTable& table) {
  BlockAnswers out;
  out.groups = std::max<std::size_t>(1, table.group_labels.names.size());
  const auto renderers = names_in_block(block, [](const TaskCell& one) { return one.renderer; });
  const auto stimuli = names_in_block(block, [](const TaskCell& one) { return one.shape; });
  out.within = {{"renderer", renderers}};
  std::vector<std::size_t> order(stimuli.size(), 0);
  if (stimuli.size() > 1) {
    const auto crossed = crossed_stimuli(stimuli, table.factors);
    out.crossed = true;
    if (!crossed) {
      out.undefined = "its " + std::to_string(stimuli.size()) +
                      " cells do not cross the levels of its factors completely";
      return out;
    }
    out.within.insert(out.within.end(), crossed->factors.begin(), crossed->factors.end());
    for (std::size_t i = 0; i < crossed->cells.size(); ++i) order[crossed->cells[i]] = i;
  }
  for (const TaskCell* const cell : block) {
    for (const ParticipantFunction& one : cell->functions) {
      if (one.reversed) note_once(one.participant, out.left_out);
    }
  }
  put_answers(block, renderers, stimuli, order, table, out);
  return out;
}

/// PSEs, or natural logs of half the distance of the levels of 25 and 75 %, of all cells on the
/// scale of the levels.
enum class AnswerScale { pse, log_width };

VectorXd figure_values(AnswerScale figure, const VectorXd& coefficients) {
  VectorXd out(coefficients.size() / 2);
  for (Index c = 0; c < out.size(); ++c) {
    const double intercept = coefficients[2 * c], slope = coefficients[2 * c + 1];
    out[c] =
        figure == AnswerScale::pse ? -intercept / slope : std::log(kNormal75 / std::abs(slope));
  }
  return out;
}

/// Covariance of these values by the delta method.
MatrixXd figure_covariance(AnswerScale figure, const ProbitMixedModel& model) {
  const Index cells = model.coefficients.size() / 2;
  MatrixXd by = MatrixXd::Zero(cells, 2 * cells);
  for (Index c = 0; c < cells; ++c) {
    const double intercept = model.coefficients[2 * c], slope = model.coefficients[2 * c + 1];
    if (figure == AnswerScale::pse) by(c, 2 * c) = -1 / slope;
    by(c, 2 * c + 1) = figure == AnswerScale::pse ? intercept / (slope * slope) : -1 / slope;
  }
  return by * model.covariance * by.transpose();
}

/// The values of simulated studies, one a column.
struct Bootstrapped {
  MatrixXd pse, log_width;
  std::size_t failed = 0;
};

Bootstrapped bootstrapped_figures(const BlockAnswers& block, const ProbitMixedModel& model,
                                  const AnswerModelSettings& settings) {
  const auto cells = static_cast<std::size_t>(model.coefficients.size() / 2);
  std::vector<VectorXd> found(settings.bootstrap);
  do_jobs(settings.bootstrap, settings.jobs,
          [&](std::size_t i) {
            Random random(settings.seed, {i});
            const ProbitMixedModel one =
                refit_probit_mixed(simulate_answers(block.answers, model, random), cells, model);
            if (!one.undefined.empty()) return;
            for (Index c = 0; c < static_cast<Index>(cells); ++c) {
              if (!(one.coefficients[2 * c + 1] * model.coefficients[2 * c + 1] > 0)) return;
            }
            found[i] = one.coefficients;
          },
          {});
  Bootstrapped out;
  out.failed = std::erase_if(found, [](const VectorXd& one) { return one.size() == 0; });
  // A study without a value has a step or no slope: beyond an end of the interval, or of either.
  if (static_cast<double>(out.failed) > kMostFailed * static_cast<double>(settings.bootstrap))
    found.clear();
  out.pse.resize(static_cast<Index>(cells), static_cast<Index>(found.size()));
  out.log_width.resizeLike(out.pse);
  for (std::size_t i = 0; i < found.size(); ++i) {
    out.pse.col(static_cast<Index>(i)) = figure_values(AnswerScale::pse, found[i]);
    out.log_width.col(static_cast<Index>(i)) = figure_values(AnswerScale::log_width, found[i]);
  }
  return out;
}

/// 95 % of the values; none: no studies.
std::optional<Interval> middle_of(const VectorXd& values) {
  if (values.size() == 0) return std::nullopt;
  std::vector<double> sorted(values.begin(), values.end());
  std::ranges::sort(sorted);
  return Interval{sorted_quantile(sorted, 0.025), sorted_quantile(sorted, 0.975)};
}

/// Values of a model on the scale of its levels, with all that is known of them.
struct CellValues {
  VectorXd values;
  MatrixXd covariance, simulated;

  AnswerFigure combined(const VectorXd& weights) const {
    AnswerFigure out;
    out.estimate = weights.dot(values);
    out.se = std::sqrt(weights.dot(covariance * weights));
    out.ci95 = Interval{*out.estimate - kNormal975 * *out.se, *out.estimate + kNormal975 * *out.se};
    out.bootstrap_ci95 = middle_of(simulated.transpose() * weights);
    return out;
  }
};

/// Changes a figure by an increasing function.
template <class Change>
AnswerFigure changed_figure(AnswerFigure figure, Change change, double slope) {
  for (auto* interval : {&figure.ci95, &figure.bootstrap_ci95}) {
    if (*interval) *interval = Interval{change((*interval)->low), change((*interval)->high)};
  }
  *figure.estimate = change(*figure.estimate);
  *figure.se *= slope;
  return figure;
}

void put_figures(const CellValues& pse, const CellValues& log_width, const AnswerModel& model,
                 std::size_t index, AnswerCell& cell) {
  const VectorXd one = VectorXd::Unit(pse.values.size(), static_cast<Index>(index));
  const double place = model.centre + pse.values[static_cast<Index>(index)];
  const double width = std::exp(log_width.values[static_cast<Index>(index)]);
  cell.pse = changed_figure(
      pse.combined(one), [&](double x) { return model.centre + x; }, 1);
  cell.jnd = log_width.combined(one);
  if (model.log_levels) {
    const auto level = [](double x) { return std::pow(10, x); };
    cell.pse = changed_figure(cell.pse, level, std::numbers::ln10 * level(place));
    cell.jnd = changed_figure(
        cell.jnd, [](double x) { return std::pow(10, std::exp(x)) - 1; },
        std::numbers::ln10 * width * level(width));
  } else {
    cell.jnd = changed_figure(
        cell.jnd, [](double x) { return std::exp(x); }, width);
  }
}

double normal_p(double z) { return 2 * cdf(complement(boost::math::normal(), std::abs(z))); }

void put_measure(const CellValues& values, const std::vector<std::string>& tests, double unit,
                 AnswerMeasure& out) {
  const std::vector<WithinFactor> within = factor_sizes(out.of.within);
  const std::size_t groups = std::max<std::size_t>(1, out.of.groups.size());
  std::vector<WithinFactor> factors{{"group", groups}};
  factors.insert(factors.end(), within.begin(), within.end());
  std::vector<std::optional<double>> p;
  for (const DesignEffect& effect : design_effects(factors)) {
    AnswerEffect& made = out.effects.emplace_back();
    made.name = effect.name;
    const VectorXd found = effect.rows * values.values;
    const Eigen::LDLT<MatrixXd> spread(effect.rows * values.covariance * effect.rows.transpose());
    made.df = static_cast<double>(effect.rows.rows());
    made.chi_squared = found.dot(spread.solve(found));
    if (std::isfinite(*made.chi_squared) && *made.chi_squared >= 0)
      made.p = cdf(complement(boost::math::chi_squared(*made.df), *made.chi_squared));
    p.push_back(is_tested(tests, made.name) ? made.p : std::nullopt);
  }
  const auto adjusted = holm(p);
  for (std::size_t i = 0; i < adjusted.size(); ++i) out.effects[i].p_holm = adjusted[i];
  std::vector<GroupContrast> contrasts;
  for (DesignContrast& one : design_contrasts(groups, within, WithinContrasts::added)) {
    const AnswerFigure found = changed_figure(
        values.combined(one.weights), [&](double x) { return unit * x; }, unit);
    one.contrast.estimate = found.estimate;
    one.contrast.se = found.se;
    one.contrast.ci95 = found.ci95;
    one.contrast.t = *found.estimate / *found.se;
    one.contrast.p = normal_p(*one.contrast.t);
    contrasts.push_back(one.contrast);
    out.contrasts.push_back({one.contrast, found.bootstrap_ci95});
  }
  adjust_contrasts(contrasts);
  for (std::size_t i = 0; i < contrasts.size(); ++i)
    out.contrasts[i].contrast.p_holm = contrasts[i].p_holm;
}

std::vector<AnswerCell> cells_of_model(const BlockAnswers& block, const ProbitMixedModel& model) {
  const std::size_t conditions = block.conditions();
  std::vector<AnswerCell> out(block.groups * conditions);
  for (std::size_t c = 0; c < out.size(); ++c) {
    AnswerCell& cell = out[c];
    cell.group = c / conditions;
    std::size_t rest = c % conditions;
    for (auto factor = block.within.rbegin(); factor != block.within.rend(); ++factor) {
      cell.levels.insert(cell.levels.begin(), rest % factor->levels.size());
      rest /= factor->levels.size();
    }
    std::vector<bool> seen(block.participants.size());
    for (const LevelAnswers& one : block.answers) {
      if (one.cell != c) continue;
      cell.n_trials += static_cast<std::size_t>(one.trials);
      cell.n_participants += seen[one.participant] ? 0 : 1;
      seen[one.participant] = true;
    }
    const auto at = 2 * static_cast<Index>(c);
    cell.intercept = model.coefficients[at];
    cell.slope = model.coefficients[at + 1];
    cell.intercept_se = std::sqrt(model.covariance(at, at));
    cell.slope_se = std::sqrt(model.covariance(at + 1, at + 1));
    if (std::abs(cell.slope) < kNormal975 * cell.slope_se)
      cell.undefined = "answers do not clearly change with the level";
  }
  return out;
}

AnswerMeasure modelled_measure(const std::string& name, const BlockCells& cells,
                               const BlockAnswers& block, const StudyTable& table,
                               bool log_levels) {
  AnswerMeasure out;
  out.of.measure = name;
  out.of.task = cells.front()->task;
  out.of.block_name = cells.front()->block_name;
  out.of.shape = base_name(cells.front()->shape);
  out.of.unit = cells.front()->level_unit;
  out.of.logarithms = log_levels;
  out.of.groups = table.group_labels.names;
  out.of.within = block.within;
  out.of.crossed = block.crossed;
  return out;
}

AnswerModel model_of_block(const BlockCells& cells, const StudyTable& table,
                           const AnswerModelSettings& settings) {
  AnswerModel out;
  out.task = cells.front()->task;
  out.block_name = cells.front()->block_name;
  out.shape = base_name(cells.front()->shape);
  out.log_levels = cells.front()->scale != protocols::LevelScale::linear;
  out.undefined = why_no_answer_model(cells);
  if (!out.undefined.empty()) return out;
  const BlockAnswers block = answers_of_block(cells, table);
  out.left_out = block.left_out;
  out.without_group = block.without_group;
  out.centre = block.centre;
  out.pse = modelled_measure(out.task == "detect" ? "threshold" : "pse", cells, block, table,
                             out.log_levels);
  out.jnd = modelled_measure(out.log_levels ? "weber_fraction" : "jnd", cells, block, table, true);
  out.undefined = block.undefined;
  if (!out.undefined.empty()) return out;
  const ProbitMixedModel model = fit_probit_mixed(block.answers, block.groups * block.conditions());
  out.undefined = model.undefined;
  if (!out.undefined.empty()) return out;
  out.n_participants = block.participants.size();
  for (const LevelAnswers& one : block.answers)
    out.n_answers += static_cast<std::size_t>(one.trials);
  out.intercept_sd = std::sqrt(model.spread(0, 0));
  out.slope_sd = std::sqrt(model.spread(1, 1));
  if (out.intercept_sd > 0 && out.slope_sd > 0)
    out.correlation = model.spread(0, 1) / (out.intercept_sd * out.slope_sd);
  out.singular = model.singular;
  out.log_likelihood = model.log_likelihood;
  out.cells = cells_of_model(block, model);
  if (std::ranges::any_of(out.cells, [](const auto& one) { return !one.undefined.empty(); }))
    return out;
  const Bootstrapped simulated = bootstrapped_figures(block, model, settings);
  out.bootstrapped = settings.bootstrap;
  out.failed = simulated.failed;
  const CellValues pse{figure_values(AnswerScale::pse, model.coefficients),
                       figure_covariance(AnswerScale::pse, model), simulated.pse};
  const CellValues log_width{figure_values(AnswerScale::log_width, model.coefficients),
                             figure_covariance(AnswerScale::log_width, model), simulated.log_width};
  for (std::size_t c = 0; c < out.cells.size(); ++c)
    put_figures(pse, log_width, out, c, out.cells[c]);
  put_measure(pse, table.tests, out.log_levels ? std::numbers::ln10 : 1, out.pse);
  put_measure(log_width, table.tests, 1, out.jnd);
  return out;
}

}  // namespace

std::vector<AnswerModel> answer_models(const StudyAnalysis& analysis,
                                       const AnswerModelSettings& settings) {
  std::vector<AnswerModel> out;
  for (const BlockCells& cells : blocks_of_answers(analysis.cells))
    out.push_back(model_of_block(cells, analysis.table, settings));
  return out;
}

}  // namespace palpate::analysis
