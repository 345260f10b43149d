#pragma once
// Data that a protocol's name already has: who edits its text then makes another study.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "runner/design/protocol_file.h"

namespace palpate::runner::design {

/// The databases beside the protocol, and the given ones, that hold participants of a protocol of
/// this text's name: [{"database", "participants", "simulated": all of them, "same": byte for byte,
/// "differs": in words, "only_texts"}]. What is no database of palpate is passed over.
/// \throws protocols::InputError: the text is no valid protocol
nlohmann::ordered_json study_data(const std::string& text, const ProtocolFile& file,
                                  const std::vector<std::string>& databases);

}  // namespace palpate::runner::design
