#pragma once
// The texts of a protocol that a participant reads, and their translation.

#include <string>
#include <utility>
#include <vector>

#include "protocols/protocol.h"

namespace palpate::protocols {

/// Every text that a participant may read, by a key that gives its place: "texts.go",
/// "blocks.BLOCK.question", "blocks.BLOCK.keys.ANSWER", "pages.PAGE.ITEM.choices.1". Empty ones are
/// left out.
std::vector<std::pair<std::string, std::string>> texts_of(const Protocol& protocol);

/// The same as a JSON object, one key a line, for a translator to fill in.
std::string texts_json(const Protocol& protocol);

/// Keys of the program's own English texts that participants read in a protocol with words of its
/// own. Empty if the protocol has none, or all are translated.
std::vector<std::string> built_in_texts(const Protocol& protocol);

/// Replaces the texts by those of a JSON object with the same keys. Stored answers keep the
/// protocol's own language.
/// \param language  "de", "pt-BR"
/// \param file_name  named in faults
/// \throws InputError with every key that is missing, unknown or not a text, and every invalid
/// label
void translate(Protocol& protocol, const std::string& language, const std::string& text,
               const std::string& file_name);

/// As above, from NAME.texts.LANGUAGE.json beside NAME.json, else texts.LANGUAGE.json there.
/// \throws InputError, also if neither exists
void translate(Protocol& protocol, const std::string& protocol_path, const std::string& language);

}  // namespace palpate::protocols
