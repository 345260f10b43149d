#pragma once
// The trials of a study for its analysis, from a database or a table.

#include <string>
#include <vector>

#include "analysis/input/study_record.h"
#include "analysis/input/study_table.h"
#include "analysis/statistics/task_analysis.h"
#include "data/store/store.h"

namespace palpate::runner::study {

struct StudySource {
  std::string database = {}, csv = {};  ///< one of them
  std::string protocol = {};  ///< of several protocols, the one that is wanted (is_protocol)
  std::vector<analysis::ProtocolText> protocols = {};  ///< of a table's trials, if known
};

struct Study {
  analysis::StudyTable table;
  analysis::StudyRecord record;  ///< as far as it was asked for; of a table always empty
};

/// Opens a study's database to read it. \throws UsageError: it is none
data::Store open_study(const std::string& database);

/// \param protocol  the one that is wanted (is_protocol) \param with_record  reads it, too
/// \throws UsageError: tasks are of several protocols; InputError
Study read_study(data::Store& store, const std::string& protocol, bool with_record = false);
/// The same of a database or a table. \throws UsageError: the file is not a study's, too
Study read_study(const StudySource& source, bool with_record = false);

/// \param too_fast  s, limit of too fast answers
analysis::StudyAnalysis analyze_study(analysis::StudyTable table, double too_fast);

}  // namespace palpate::runner::study
