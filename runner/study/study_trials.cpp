#include "runner/study/study_trials.h"

#include <stdexcept>
#include <utility>
#include <vector>

#include "data/base/text.h"
#include "data/store/store.h"
#include "data/stored_protocol.h"
#include "runner/usage_error.h"

namespace palpate::runner::study {

analysis::TrialTable read_study_trials(const std::string& database, const std::string& csv,
                                       const std::string& protocol) {
  if (!csv.empty()) return analysis::read_trials_csv(csv, protocol);
  try {
    return analysis::read_trials_store(database, protocol);
  } catch (const data::StoreRefused& error) {
    throw UsageError(error.what());  // the named file is bad input: status 2
  }
}

bool is_of_tasks(const std::string& database, const std::string& csv, const std::string& protocol) {
  try {
    if (!csv.empty()) return analysis::has_task_trials(csv, protocol);
    std::vector<data::ProtocolInfo> wanted =
        data::Store::open(database, data::Store::Mode::read_only).protocols();
    std::erase_if(wanted, [&](const data::ProtocolInfo& one) {
      return !analysis::is_protocol(protocol, one.name, one.sha256);
    });
    return data::have_blocks(wanted);
  } catch (const std::runtime_error&) {
    return false;
  }
}

namespace {

/// Refuses several protocols: blocks of the same name in two protocols are different. \throws
/// UsageError
void require_one_protocol(const analysis::TaskTable& table, const std::string& wanted) {
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

analysis::TaskTable read_study_tasks(const std::string& database, const std::string& csv,
                                     const std::string& protocol,
                                     const std::vector<analysis::ProtocolText>& protocols) {
  analysis::TaskTable table = csv.empty()
                                  ? analysis::read_task_trials_store(database, protocol)
                                  : analysis::read_task_trials_csv(csv, protocol, protocols);
  require_one_protocol(table, protocol);
  return table;
}

}  // namespace palpate::runner::study
