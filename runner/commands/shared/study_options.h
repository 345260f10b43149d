#pragma once
// The options of a simulated study.

#include <cstdint>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "data/base/group_assignment.h"
#include "runner/commands/shared/command.h"
#include "runner/participants/simulated_settings.h"

namespace palpate::runner::commands {

/// The options that determine the data of a simulated study.
struct StudyOptions {
  std::string protocol;
  std::string patch;  ///< file of a JSON merge patch on the simulated participant; empty: none
  int participants = 7;
  std::uint64_t seed = 1;
  int version = 0;  ///< of the simulated participant; 0: not given
};

void add_study_options(CommandLine& line, StudyOptions& options);
/// Call it with the result of CommandLine::parse. \throws UsageError
void check_study_options(const boost::program_options::variables_map& values,
                         StudyOptions& options);

/// The numbers that participants of groups get as they come, ascending: "young=12,old=10".
/// \throws UsageError
std::vector<int> numbers_of_groups(const std::string& text, const GroupAssignment& groups);

/// \throws UsageError: the path is not a socket, or the time is out of range
void check_advisor(const std::string& path, double time_out);

/// The share of the work of this process, of points of a sweep or participants of a study: shard
/// `number` of `count`, from 1.
struct Shard {
  std::int64_t number = 1, count = 1;
  /// Its items are consecutive: after `first` (from 0) up to `last`.
  std::int64_t first(std::int64_t items) const { return part(items, number - 1); }
  std::int64_t last(std::int64_t items) const { return part(items, number); }

 private:
  std::int64_t part(std::int64_t items, std::int64_t parts) const;
};

/// "2/8"; "auto": from the variables of a Slurm array task, SLURM_ARRAY_TASK_ID, _COUNT and _MIN.
/// \param variable  the value of an environment variable, or null. \throws UsageError
Shard parse_shard(const std::string& text, const std::function<const char*(const char*)>& variable);

/// Adds --participant-version. Without the option `version` stays unchanged.
void add_participant_version(CommandLine& line, int& version);
/// \throws UsageError: the simulated participant has no such version
void check_participant_version(const boost::program_options::variables_map& values, int version);
/// The version for a file without an option: the only one in `begun`, the default if that is empty.
/// \throws UsageError naming `file`: it has several
int version_to_resume_with(const std::set<int>& begun, const std::string& file);

}  // namespace palpate::runner::commands
