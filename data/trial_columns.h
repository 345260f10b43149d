#pragma once
// The columns measured over a trial's servo ticks. A new column needs a row of kMeasured, a member
// of TrialRecord and a migration (an .sql file in store/, named in data/CMakeLists.txt, and
// kSchemaVersion); SQL, reading, writing, checks, seal, exports and codebooks follow the table.

#include <cstdint>
#include <limits>
#include <optional>
#include <variant>

#include "data/record.h"

namespace palpate::data {

struct MeasuredColumn {
  const char* name;  ///< in `attempts` and, if it has a description, in exports
  std::variant<std::uint64_t TrialRecord::*, std::int64_t TrialRecord::*,
               std::uint32_t TrialRecord::*, bool TrialRecord::*, double TrialRecord::*,
               std::optional<double> TrialRecord::*, std::optional<std::int64_t> TrialRecord::*>
      member;
  int since;  ///< version of the schema that added the column
  /// Exported after the columns of schema 1, in the table's order. Empty: placed separately.
  const char* description = "";
  const char* unit = "";
  double most = std::numeric_limits<double>::infinity();  ///< largest valid value
};

/// In the order of a seal (store/seals.h). A column newer than schema 1 holds std::optional, so
/// that older trials have none.
inline constexpr MeasuredColumn kMeasured[] = {
    {"ticks", &TrialRecord::ticks, 1},
    {"missed_ticks", &TrialRecord::missed_ticks, 1},
    {"longest_period_ns", &TrialRecord::longest_period_ns, 1},
    {"faults", &TrialRecord::faults, 1},
    {"started_inside", &TrialRecord::started_inside, 1},
    {"max_force", &TrialRecord::max_force, 1},
    {"contact_share", &TrialRecord::contact_share, 4,
     "Share of the servo ticks, from the first one with forces on to the answer, in which the "
     "stylus touched the stimulus; missing: not measured",
     "1", 1},
    {"edge_dwell", &TrialRecord::edge_dwell, 4,
     "Time in contact within 3 mm of an edge or vertex at which the surface turns by 30 degrees or "
     "more; missing: not measured, or the stimulus has more than 2000 such edges and vertices",
     "s"},
};

/// Calls visit(column, value) for every measured column, in order.
/// \param record  a TrialRecord, const or not
template <class Record, class Visit>
void for_each_measured(Record& record, Visit visit) {
  for (const MeasuredColumn& column : kMeasured) {
    std::visit([&](auto member) { visit(column, record.*member); }, column.member);
  }
}

}  // namespace palpate::data
