#pragma once
// What a participant reads of a protocol, listed once, and translations of it.

#include <string>
#include <utility>
#include <vector>

#include "protocols/protocol.h"

namespace palpate::protocols {

/// Every text that a participant may read, by a key that says its place: "texts.go",
/// "blocks.BLOCK.question", "blocks.BLOCK.keys.ANSWER", "pages.PAGE.ITEM.choices.1". Empty ones are
/// left out.
std::vector<std::pair<std::string, std::string>> texts_of(const Protocol& protocol);

/// The same as a JSON object, a key a line: what a translator fills in.
std::string texts_json(const Protocol& protocol);

/// Keys of the program's own texts, in English, that participants read in a protocol that has words
/// of its own; empty where it has none, or all are of a translation.
std::vector<std::string> built_in_texts(const Protocol& protocol);

/// Replaces the texts by those of a JSON object of the same keys. What is stored of an answer stays
/// what it is in the protocol's own language.
/// \param language  "de", "pt-BR"; \param file_name  that faults name
/// \throws InputError: every key that is missing, unknown, no text, or a label that is none.
void translate(Protocol& protocol, const std::string& language, const std::string& text,
               const std::string& file_name);

/// As above, from NAME.texts.LANGUAGE.json beside NAME.json, else texts.LANGUAGE.json there.
/// \throws InputError; also where there is neither.
void translate(Protocol& protocol, const std::string& protocol_path, const std::string& language);

}  // namespace palpate::protocols
