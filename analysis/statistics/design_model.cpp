#include "analysis/statistics/design_model.h"

#include <Eigen/Dense>
#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "analysis/statistics/anova.h"
#include "analysis/statistics/design_effects.h"
#include "analysis/statistics/model_tester.h"
#include "analysis/statistics/reml.h"

namespace palpate::analysis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// With more, an evaluation of the derivatives takes too long.
constexpr Index kMostEffects = 8;
constexpr double kMostWork = 2e8;   ///< multiplications of one evaluation
constexpr double kSingular = 1e-4;  ///< relative to the residual sd, as lme4's isSingular()

/// The products of the factors that vary, those of few factors first.
std::vector<FactorProduct> products_of(const std::vector<WithinFactor>& factors) {
  std::vector<FactorProduct> out;
  for (FactorProduct product = 1; product < 1U << factors.size(); ++product) {
    bool varies = true;
    for (std::size_t i = 0; i < factors.size(); ++i)
      varies = varies && (!has_factor(product, i) || factors[i].levels > 1);
    if (varies) out.push_back(product);
  }
  std::ranges::stable_sort(out, {}, [](FactorProduct one) { return std::popcount(one); });
  return out;
}

/// The columns of a product in treatment coding, one row a condition.
MatrixXd columns_of(FactorProduct product, const std::vector<WithinFactor>& factors) {
  MatrixXd out = MatrixXd::Ones(1, 1);
  for (std::size_t i = 0; i < factors.size(); ++i) {
    const auto levels = static_cast<Index>(factors[i].levels);
    out = kronecker(out, has_factor(product, i)
                             ? MatrixXd(MatrixXd::Identity(levels, levels).rightCols(levels - 1))
                             : MatrixXd::Ones(levels, 1));
  }
  return out;
}

MatrixXd coding_of(const std::vector<FactorProduct>& slopes,
                   const std::vector<WithinFactor>& factors) {
  MatrixXd out = columns_of(0, factors);
  for (const FactorProduct slope : slopes) {
    const MatrixXd more = columns_of(slope, factors);
    out.conservativeResize(Eigen::NoChange, out.cols() + more.cols());
    out.rightCols(more.cols()) = more;
  }
  return out;
}

/// The cells of each group as shapes of their own, so that the fixed effects are those of group,
/// condition and shape.
ParticipantCells cells_by_group(const DesignedTimes& times) {
  ParticipantCells out(times.cells.size());
  for (std::size_t c = 0; c < times.cells.size(); ++c) {
    for (std::size_t group = 0; group < times.groups; ++group) {
      for (const std::vector<ParticipantCell>& shape : times.cells[c]) {
        std::vector<ParticipantCell>& own = out[c].emplace_back(shape);
        for (std::size_t p = 0; p < own.size(); ++p) {
          if (times.group_of[p] != group) own[p] = {};
        }
      }
    }
  }
  return out;
}

/// The fit with the most slopes that is not singular.
struct Fit {
  RemlOptimum optimum;
  std::vector<FactorProduct> slopes, taken_out;
  bool singular = false;
};

bool is_singular(const RemlOptimum& optimum, Index effects) {
  return lower_triangle(optimum.theta, effects).diagonal().minCoeff() < kSingular;
}

Fit fitted(const ReducedModel& data, const DesignedTimes& times) {
  Fit out;
  out.slopes = products_of(times.conditions);
  const auto take_out = [&] {
    out.taken_out.push_back(out.slopes.back());
    out.slopes.pop_back();
  };
  const auto people = static_cast<Index>(data.data.groups.size() - times.groups);
  const auto work = [&](Index effects) {
    const auto columns = static_cast<double>(data.data.within.size());
    return static_cast<double>(effects * (effects + 1)) / 2 * std::pow(columns, 3);
  };
  for (; !out.slopes.empty(); take_out()) {
    const Index effects = coding_of(out.slopes, times.conditions).cols();
    // A slope of every condition needs more than one time in it.
    const bool too_many =
        data.degrees_of_freedom < 1 && effects == static_cast<Index>(times.cells.size());
    if (effects <= std::min(kMostEffects, people) && work(effects) <= kMostWork && !too_many) break;
  }
  for (;; take_out()) {
    const MatrixXd coding = coding_of(out.slopes, times.conditions);
    out.optimum = reml_optimum(data.data, coding);
    out.singular = is_singular(out.optimum, coding.cols());
    if ((out.optimum.converged && !out.singular) || out.slopes.empty()) return out;
  }
}

std::string why_no_model(const DesignedTimes& times, const ModelCells& cells) {
  if (cells.n != static_cast<Index>(times.cells.size() * times.groups * times.shapes))
    return "a cell of the design has no time";
  if (static_cast<double>(cells.n) > std::cbrt(kMostWork)) return "too many cells for this model";
  return "";
}

std::string why_not_fitted(const ReducedModel& data, const DesignedTimes& times) {
  if (data.data.groups.size() <= times.groups)
    return times.groups == 1 ? "one participant, so no variance between participants"
                             : "one participant in each group, so no variance within groups";
  if (data.data.degrees_of_freedom <= static_cast<double>(data.data.groups.size()))
    return "too few trials to estimate the residual variance";
  if (data.degrees_of_freedom >= 1 &&
      std::sqrt(data.least_square / data.degrees_of_freedom) <= 1e-10 * std::max(1.0, data.scale))
    return "no residual variance: participants and cells explain every time";
  return "";
}

/// Weights of the model's cells for weights by group and condition, or by these and shape.
class CellWeights {
 public:
  CellWeights(const DesignedTimes& times, const ModelCells& cells) : times_(times), cells_(cells) {}

  /// The same of every shape. \param weights  as of condition_weights
  VectorXd over_shapes(const VectorXd& weights) const {
    const auto shapes = static_cast<Index>(times_.shapes);
    return ordered(kronecker(weights, VectorXd::Constant(shapes, 1 / static_cast<double>(shapes)))
                       .transpose())
        .transpose();
  }

  /// The rows in the order of the model's cells.
  MatrixXd ordered(const MatrixXd& rows) const {
    MatrixXd out = MatrixXd::Zero(rows.rows(), cells_.n);
    Index at = 0;
    for (std::size_t group = 0; group < times_.groups; ++group) {
      for (std::size_t c = 0; c < times_.cells.size(); ++c) {
        for (std::size_t s = 0; s < times_.shapes; ++s)
          out.col(cells_.column[c][group * times_.shapes + s]) = rows.col(at++);
      }
    }
    return out;
  }

 private:
  const DesignedTimes& times_;
  const ModelCells& cells_;
};

void put_effects(const DesignedTimes& times, const CellWeights& weights, const ModelTester& tested,
                 DesignModel& out) {
  std::vector<WithinFactor> factors{{"group", times.groups}};
  factors.insert(factors.end(), times.conditions.begin(), times.conditions.end());
  factors.push_back({"shape", times.shapes});
  for (const DesignEffect& effect : design_effects(factors))
    out.effects.push_back(tested.joint(weights.ordered(effect.rows), effect.name));
}

}  // namespace

DesignModel design_model(const DesignedTimes& times, WithinContrasts contrasts) {
  DesignModel out;
  const ParticipantCells own = cells_by_group(times);
  const ModelCells cells = model_cells(own);
  for (const auto& condition : own) {
    for (const auto& shape : condition) {
      for (const ParticipantCell& cell : shape) out.n_observations += cell.n_used;
    }
  }
  out.undefined = why_no_model(times, cells);
  if (!out.undefined.empty()) return out;
  const ReducedModel data(own, cells);
  out.n_participants = data.data.groups.size();
  out.undefined = why_not_fitted(data, times);
  if (!out.undefined.empty()) return out;
  const Fit fit = fitted(data, times);
  for (const FactorProduct one : fit.slopes)
    out.slopes.push_back(product_name(one, times.conditions));
  for (const FactorProduct one : fit.taken_out)
    out.taken_out.push_back(product_name(one, times.conditions));
  if (!fit.optimum.converged) {
    out.undefined = "the fit did not converge";
    return out;
  }
  if (fit.singular) out.singular = "participants' levels do not vary";
  const ModelTester tested(data, fit.optimum.point);
  const CellWeights weights(times, cells);
  put_effects(times, weights, tested, out);
  put_means(
      times.groups, times.conditions, contrasts,
      [&](const VectorXd& one) { return tested(weights.over_shapes(one)); }, out);
  return out;
}

}  // namespace palpate::analysis
