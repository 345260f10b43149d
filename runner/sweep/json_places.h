#pragma once
// JSON pointers into documents: set a value, and say which pointers are near to one that is none.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace palpate::runner {

/// The value that a pointer leads to; nullptr: there is none.
const nlohmann::json* value_at(const nlohmann::json& document, const std::string& pointer);

/// Sets it. Members of objects are added where they are missing, elements of arrays are not.
/// \return false: it leads through an array's end, or into a number or a text
bool set_value(nlohmann::json& document, const std::string& pointer, const nlohmann::json& value);

/// Pointers of the document's numbers, texts and booleans that are written much like this one, the
/// nearest first, at most `most`.
std::vector<std::string> near_pointers(const nlohmann::json& document, const std::string& pointer,
                                       std::size_t most = 3);

}  // namespace palpate::runner
