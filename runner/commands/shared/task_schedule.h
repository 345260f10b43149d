#pragma once
// The schedule of a protocol of version 2, printed.

#include <string>

#include "protocols/protocol.h"

namespace palpate::runner {

/// \param participant  number. \param format  table, csv or json
std::string task_schedule_text(const protocols::Protocol& protocol, int participant,
                               const std::string& format);

}  // namespace palpate::runner
