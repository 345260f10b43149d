#pragma once
// How well the procedures of a protocol find a known threshold, for `schedule --recover`.

#include <cstdint>
#include <string>

#include "protocols/protocol.h"

namespace palpate::runner {

/// A line for each procedure: what it aims at, bias and spread over so many simulated participants.
/// \param format  table, csv or json
std::string recovery_text(const protocols::Protocol& protocol, int participants, std::uint64_t seed,
                          const std::string& format);

}  // namespace palpate::runner
