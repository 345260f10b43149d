#pragma once
// Reads JSON (RFC 8259, UTF-8), whoever wrote it: files, rows of databases, messages of other
// programs. A document that nests deeper than kDeepestJson is refused: comparing, copying and
// writing a document recurse for each level, and would overflow the stack.
// protocols/json_document.h reads with the line of every value, to the same depth. Nothing else
// parses JSON.

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace palpate {

/// Objects and arrays within each other. Protocols need 12.
constexpr std::size_t kDeepestJson = 64;

/// Why a text is refused: "expected ..., found ...".
class JsonError : public std::runtime_error {
 public:
  JsonError(std::string expected, std::string found, std::optional<std::size_t> byte = {});

  std::string expected, found;
  std::optional<std::size_t> byte;  ///< where it is no JSON, from 0
};

/// \throws JsonError
nlohmann::json read_json(std::string_view text);

/// With the keys in the order of the text. \throws JsonError
nlohmann::ordered_json read_ordered_json(std::string_view text);
/// A discarded value, which is of no type, where read_json() would throw.
nlohmann::json json_or_discarded(std::string_view text);

/// A value as JSON in ASCII, at most so many characters of it; for messages. A long value is not
/// written out in full.
std::string json_excerpt(const nlohmann::json& value, std::size_t most = 60);

}  // namespace palpate
