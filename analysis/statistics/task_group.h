#pragma once
// Results of the group from the hierarchical model of psychometric functions, for each block,
// stimulus and renderer, and their comparison between renderers.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace palpate::analysis {

struct TaskCell;
struct TaskComparison;
struct TaskGroup;

/// A measure of the group with a renderer. Estimates of ratios are geometric means.
struct TaskGroupModel {
  std::string block_name, task, shape;
  std::string measure;  ///< "pse", "threshold", "jnd", "weber_fraction", "d_prime", "criterion"
  std::optional<double> level;  ///< of d' and criterion
  std::string renderer, unit;
  bool geometric = false;
  std::size_t n = 0;  ///< participants with trials, without those with reversed answers
  std::optional<double> estimate;
  std::optional<double> low, high;   ///< 95 % interval; none: the end is open
  std::optional<double> sd_between;  ///< of logarithms where the mean is geometric
  std::optional<double> lapse_mean;
  std::string undefined;           ///< reason; empty: there is an estimate
  std::vector<std::string> notes;  ///< "JND below 3.2", people without trials, ...

  /// "ok", "low open", "high open", "not determined", "undefined".
  std::string status() const;
};

/// Today's paired t test of single fits.
struct IndividualFits {
  std::size_t n = 0, left_out = 0;
  std::optional<double> t, df, p;
  std::vector<std::string> left_out_names;  ///< participants without a figure of both
};

struct TaskGroupComparison {
  std::string block_name, task, shape, measure, reference, compared;
  std::optional<double> level;                ///< of d'
  bool ratio = false;                         ///< compared / reference; else compared - reference
  std::size_t n = 0;                          ///< participants with both
  std::optional<double> estimate, low, high;  ///< an open end is none
  std::optional<double> low90, high90;        ///< 90 % interval, for equivalence; likewise
  std::optional<double> p, p_holm, likelihood_ratio;
  std::size_t n_tests = 1;  ///< that p_holm is adjusted over: those of the measure
  std::string undefined;
  IndividualFits individual_fits;

  std::string status() const;
};

struct TaskGroupResults {
  std::vector<TaskGroupModel> models;
  std::vector<TaskGroupComparison> comparisons;
};

/// \param individual  comparisons of renderers by single fits
TaskGroupResults group_models(const std::vector<TaskCell>& cells,
                              const std::vector<TaskComparison>& individual);

/// Lists the participants without a figure of single fits. \param groups  with those figures
void name_left_out(const std::vector<TaskCell>& cells, const std::vector<TaskGroup>& groups,
                   TaskGroupResults& results);

/// Puts the model's values in the place of means of single fits.
void put_model_values(const std::vector<TaskGroupModel>& models, std::vector<TaskGroup>& groups);

}  // namespace palpate::analysis
