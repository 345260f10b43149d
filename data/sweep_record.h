#pragma once
// The records of a sweep: its plan, and the results at each point. Plain values.

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace palpate::data {

/// Everything that determines the results of a sweep. Files of one plan can be merged.
struct SweepPlan {
  std::string protocol;      ///< JSON; layout and order of keys do not matter
  std::string files_sha256;  ///< of names and contents of the protocol's files; "": none
  std::string settings;      ///< JSON, of the simulated participant before anything varies
  std::string space;         ///< JSON, the varied parameters
  std::string design;        ///< lhs, sobol, grid, saltelli
  std::int64_t points = 0;   ///< of the whole sweep, not only this file
  std::uint64_t seed = 1;
  int participants = 7;
  std::string program_version;
  std::vector<std::string> parameters;         ///< names, as the space lists them
  std::vector<std::string> shapes, renderers;  ///< with columns of their own; empty: blocks have
  /// false: of a file from before cells of factors had columns; those of their blocks are empty.
  bool has_cells = true;
};

/// A sentence for each difference between two plans, a's value first; empty: they are the same
/// plan.
std::vector<std::string> differences(const SweepPlan& a, const SweepPlan& b);

using SweepValue = std::variant<double, std::string>;  ///< true and false are 1 and 0

/// One point of a sweep: a study with simulated participants.
struct SweepRow {
  std::int64_t point = 1;                  ///< 1, 2, ...
  std::uint64_t seed = 0, order_seed = 0;  ///< of its participants, and of their schedules
  std::string reason;                      ///< why it failed; "": it did not
  std::vector<SweepValue> values;          ///< of the plan's parameters
  /// In the order of figure_columns(); none: undefined, or the point failed.
  std::vector<std::optional<double>> figures;
};

/// gain_SHAPE and gain_se_SHAPE (percent reduction of time with the second renderer, geometric, and
/// its standard error); then for each renderer and shape time_R_S (s, mean of participants' means
/// over correct answers), accuracy_R_S, time_outs_R_S (share of trials) and contact_share_R_S
/// (share of the time with forces on).
///
/// For a protocol of version 2, for each block B except practice, stimulus S and renderer R, means
/// over the participants and their standard errors: compare and detect threshold_B_S_R (compare
/// with levels on both sides of the standard: PSE) and threshold_se_B_S_R, compare jnd_..., detect
/// d_prime_..., rate exponent_..., adjust pse_... and jnd_..., reach deviation_... and
/// adaptation_..., identify accuracy_... and time_... (s) likewise, and bits_B_R. Participants
/// without the figure are left out. In a cell of crossed factors the levels follow the stimulus:
/// threshold_B_S_rough_large_R. Where the settings of a group vary, the same follows for each group
/// G by itself: threshold_B_S_R_G, threshold_se_B_S_R_G.
std::vector<std::string> figure_columns(const SweepPlan& plan);

/// The measures of a cell of a protocol of version 2, and the names of their columns.
struct TaskCellColumns {
  /// stimulus: as trials are stored; "": identify, all together. group "": all participants
  std::string task, block, stimulus, renderer, group;
  std::vector<std::string> measures;  ///< "threshold", ..., each with a standard error
  std::vector<std::string> columns;   ///< measures and their errors, alternating
};
/// Empty: version 1.
std::vector<TaskCellColumns> task_columns(const SweepPlan& plan);
/// The columns of a figure and of its standard error.
struct EstimateColumns {
  std::string estimate, error;
};
/// Of all figures that have one, in the order of figure_columns().
std::vector<EstimateColumns> estimate_columns(const SweepPlan& plan);
/// point, status, reason, the parameters, the figures.
std::vector<std::string> sweep_columns(const SweepPlan& plan);
/// Two columns of one name, or a parameter and a shape (whose name stands for its gain in a
/// pattern), also by upper and lower case alone; none: there are no two.
std::optional<std::pair<std::string, std::string>> columns_alike(const SweepPlan& plan);

}  // namespace palpate::data
