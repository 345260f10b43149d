#include "runner/study/study_trials.h"

#include <utility>

#include "data/base/text.h"
#include "runner/usage_error.h"

namespace palpate::runner::study {
namespace {

/// Refuses several protocols: blocks of the same name in two protocols are different. \throws
/// UsageError
void require_one_protocol(const analysis::StudyTable& table, const std::string& wanted) {
  if (table.protocols.size() < 2) return;
  std::string names;
  bool one_name = true;
  for (const auto& [name, sha256] : table.protocols) {
    // A table may have checksums alone.
    const std::string sum = sha256.substr(0, 12);
    names +=
        (names.empty() ? "" : ", ") + (name.empty() ? sum : printable(name) + " (" + sum + ")");
    one_name &= name == table.protocols.front().first;
  }
  if (one_name && !wanted.empty()) return;  // one name, as requested
  throw UsageError(printable(table.source) + ": has trials of several protocols (" + names +
                   "); say which with --protocol and " +
                   (table.protocols.front().first.empty() ? "" : "its name or ") +
                   "the beginning of its checksum");
}

}  // namespace

data::Store open_study(const std::string& database) {
  try {
    return data::Store::open(database, data::Store::Mode::read_only);
  } catch (const data::StoreRefused& error) {
    throw UsageError(error.what());  // the named file is bad input: status 2
  }
}

Study read_study(data::Store& store, const std::string& protocol, bool with_record) {
  Study study;
  study.table = analysis::read_study_store(store, protocol);
  require_one_protocol(study.table, protocol);
  if (with_record) study.record = analysis::read_study_record(store, protocol);
  return study;
}

Study read_study(const StudySource& source, bool with_record) {
  if (source.csv.empty()) {
    data::Store store = open_study(source.database);
    return read_study(store, source.protocol, with_record);
  }
  std::vector<std::string> wanted;
  if (!source.protocol.empty()) wanted.push_back(source.protocol);
  Study study;
  study.table = analysis::read_study_csv(source.csv, wanted, source.protocols);
  require_one_protocol(study.table, source.protocol);
  return study;
}

analysis::StudyAnalysis analyze_study(analysis::StudyTable table, double too_fast) {
  analysis::AnalysisSettings settings;
  settings.too_fast = too_fast;
  return analysis::analyze_study(std::move(table), {}, settings, PALPATE_VERSION);
}

}  // namespace palpate::runner::study
