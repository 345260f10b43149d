#include "data/store/participant_columns.h"

#include <algorithm>
#include <tuple>

namespace palpate::data {

std::vector<ParticipantColumn> participant_columns(Store& store) {
  std::vector<ParticipantColumn> columns;
  std::map<std::tuple<std::string, std::string, std::string>, std::string> column_of;
  for (const ProtocolInfo& protocol : store.protocols()) {
    for (const StoredColumn& one : read_stored_protocol(protocol.text).columns) {
      column_of[{protocol.name, one.page, one.item}] = one.column;
      const bool known = std::ranges::any_of(
          columns, [&](const ParticipantColumn& other) { return other.from.column == one.column; });
      if (!known) columns.push_back({one, {}});
    }
  }
  if (columns.empty()) return columns;
  for (const StoredPageAnswer& one : store.page_answers()) {
    const auto found = column_of.find({one.protocol_name, one.answer.page, one.answer.item});
    if (one.replaced || found == column_of.end() || one.answer.answer.empty()) continue;
    const auto column = std::ranges::find_if(columns, [&](const ParticipantColumn& other) {
      return other.from.column == found->second;
    });
    column->answers[one.participant.code] = one.answer.answer;
  }
  return columns;
}

}  // namespace palpate::data
