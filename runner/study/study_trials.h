#pragma once
// The trials of a study for its analysis, from a database or a table.

#include <string>
#include <vector>

#include "analysis/input/task_trials.h"
#include "analysis/input/trials.h"

namespace palpate::runner::study {

/// The trials of a study: from the CSV file if given, else from the database.
/// \param protocol  of several protocols, the one that is wanted (analysis::is_protocol)
/// \throws UsageError, InputError: the file is not a study's
analysis::TrialTable read_study_trials(const std::string& database, const std::string& csv,
                                       const std::string& protocol = "");

/// Whether the trials are of tasks, to be read by read_study_tasks. The reader reports unreadable
/// data.
bool is_of_tasks(const std::string& database, const std::string& csv, const std::string& protocol);

/// The trials of a study of version 2, as above. \param protocols  of a table's trials, if known
/// \throws UsageError: they are of several protocols
analysis::TaskTable read_study_tasks(const std::string& database, const std::string& csv,
                                     const std::string& protocol,
                                     const std::vector<analysis::ProtocolText>& protocols = {});

}  // namespace palpate::runner::study
