#pragma once
// What a simulated study is asked for with.

#include <cstdint>
#include <functional>
#include <set>
#include <string>

#include "analysis/input/trials.h"
#include "protocols/protocol.h"
#include "runner/commands/shared/command.h"
#include "runner/participants/simulated_settings.h"
#include "runner/session/simulated_study.h"

namespace palpate::runner {

/// The trials of a study: of the CSV file where it is named, else of the database.
/// \throws UsageError, InputError: the file is no study's
analysis::TrialTable read_study_trials(const std::string& database, const std::string& csv);

/// The options that the data of a simulated study depends on.
struct StudyOptions {
  std::string protocol;
  std::string patch;  ///< file of a JSON merge patch on the simulated participant; empty: none
  int participants = 7;
  std::uint64_t seed = 1;
  int version = 0;  ///< of the simulated participant; 0: none was asked for
};

void add_study_options(CommandLine& line, StudyOptions& options);
/// To be called with what CommandLine::parse gave. \throws UsageError
void check_study_options(const boost::program_options::variables_map& values,
                         StudyOptions& options);

/// \throws UsageError: the path is no socket, or the time is out of range
void check_advisor(const std::string& path, double time_out);

// Which part of the work this process does: points of a sweep, participants of a study.

/// Shard `number` of `count`, from 1.
struct Shard {
  std::int64_t number = 1, count = 1;
  /// Its items follow one another: after `first` (from 0) up to `last`.
  std::int64_t first(std::int64_t items) const { return part(items, number - 1); }
  std::int64_t last(std::int64_t items) const { return part(items, number); }

 private:
  std::int64_t part(std::int64_t items, std::int64_t parts) const;
};

/// "2/8"; "auto": from the variables of a Slurm array task, SLURM_ARRAY_TASK_ID, _COUNT and _MIN.
/// \param variable  the value of an environment variable, or null. \throws UsageError
Shard parse_shard(const std::string& text, const std::function<const char*(const char*)>& variable);

// What is checked before a study is simulated.

/// \throws UsageError
void check_simulated_participants(int participants);
/// Adds --participant-version. It leaves `version` alone where it is not given.
void add_participant_version(CommandLine& line, int& version);
/// \throws UsageError: the simulated participant has no such version
void check_participant_version(const boost::program_options::variables_map& values, int version);
/// The version for a file without an option: the only one in `begun`, the default if that is empty.
/// \throws UsageError naming `file`: there are several
int version_to_go_on_with(const std::set<int>& begun, const std::string& file);

/// Limits the materials where the protocol says so. \throws UsageError: the simulated device or
/// participant cannot do the protocol
LimitedForSimulation fit_to_simulation(protocols::Protocol& protocol,
                                       const SimulatedSettings& simulated);

}  // namespace palpate::runner
