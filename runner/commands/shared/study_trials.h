#pragma once

#include <string>

#include "analysis/input/trials.h"

namespace palpate::runner {

/// The trials of a study: of the CSV file where it is named, else of the database.
/// \throws UsageError, InputError: the file is no study's
analysis::TrialTable read_study_trials(const std::string& database, const std::string& csv);

}  // namespace palpate::runner
