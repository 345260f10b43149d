#pragma once
// The columns that a protocol's questionnaires give to the table of participants.

#include <map>
#include <string>
#include <vector>

#include "data/store/store.h"
#include "data/stored_protocol.h"

namespace palpate::data {

struct ParticipantColumn {
  StoredColumn from;  ///< the first protocol's, where several have the column
  /// By participant's code: the latest answer that is not empty. Personal data.
  std::map<std::string, std::string> answers;
};

/// In the order of protocols and questions.
std::vector<ParticipantColumn> participant_columns(Store& store);

}  // namespace palpate::data
