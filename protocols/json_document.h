#pragma once
// A JSON document with the line of every value and duplicate keys, which nlohmann-json drops.

#include <nlohmann/json.hpp>
#include <string>

#include "protocols/fault_list.h"
#include "protocols/object_reader.h"

namespace palpate::protocols {

/// Reads JSON (RFC 8259, UTF-8). Duplicate keys become faults. \throws InputError with line and
/// column where the text is not JSON; with the location where it is nested too deeply, has too many
/// values or too long a key. Memory is in proportion to the text.
nlohmann::json read_json(const std::string& text, FaultList& faults);

/// The contents of a file. \throws InputError where it cannot be read or is above 16 MiB.
std::string read_text_file(const std::string& path);

}  // namespace palpate::protocols
