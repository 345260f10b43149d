#pragma once
// Reads untrusted JSON (RFC 8259, UTF-8): files, rows of databases, messages of other programs.
// Refuses a document that nests deeper than kDeepestJson: comparing, copying and writing recurse
// for each level, and would overflow the stack. protocols/json_document.h also records the line of
// every value, to the same depth. No other code parses JSON.

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
  std::optional<std::size_t> byte;  ///< first byte that is not JSON, from 0
};

/// \throws JsonError
nlohmann::json read_json(std::string_view text);

/// With the keys in the order of the text. \throws JsonError
nlohmann::ordered_json read_ordered_json(std::string_view text);
/// Like read_json(), but returns a discarded value instead of throwing.
nlohmann::json json_or_discarded(std::string_view text);

/// SHA-256 of an object without its member "sha256": of its text with sorted keys and no spaces.
std::string json_checksum(const nlohmann::json& object);

/// A value as JSON in ASCII, cut after `most` characters, for messages. A long value is not
/// serialised in full.
std::string json_excerpt(const nlohmann::json& value, std::size_t most = 60);

}  // namespace palpate
