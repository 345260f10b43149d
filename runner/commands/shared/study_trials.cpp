#include "runner/commands/shared/study_trials.h"

#include "data/store/store.h"
#include "runner/commands/shared/command.h"

namespace palpate::runner {

analysis::TrialTable read_study_trials(const std::string& database, const std::string& csv) {
  if (!csv.empty()) return analysis::read_trials_csv(csv);
  try {
    return analysis::read_trials_store(database);
  } catch (const data::StoreRefused& error) {
    throw UsageError(error.what());  // the file that was named is bad input: status 2
  }
}

}  // namespace palpate::runner
