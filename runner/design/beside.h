#pragma once
// Files beside a protocol that its page may write: meshes that were dropped on it, and translations
// of what the participant reads.

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "runner/design/protocol_file.h"

namespace palpate::runner::design {

/// Copies a mesh beside the protocol, under its own name or a free one like it.
/// \param name  as the user's computer calls it. \param folder  for a draft: nothing is written
/// beside the protocol unless palpate can read it. \return {"file", "scale": proposed, "size_m": at
/// that scale, "notes", "soft": of a solid, what makes it one}. \throws UsageError,
/// stimuli::MeshError, protocols::InputError, NotSaved
nlohmann::ordered_json add_mesh(const ProtocolFile& file, const std::string& folder,
                                const std::string& name, const std::string& bytes);

/// Of the translations that are there.
std::vector<std::string> languages_of(const ProtocolFile& file);

/// {"texts": [[key, original], ...], "languages": as languages_of}
nlohmann::ordered_json texts_answer(const std::string& text, const ProtocolFile& file);

/// "NAME.texts.LANGUAGE.json" beside the protocol. \throws UsageError: "de", "pt-BR" are languages
std::string translation_path(const ProtocolFile& file, const std::string& language);

/// The faults of a translation, as of a protocol.
nlohmann::ordered_json check_translation(const std::string& text, const ProtocolFile& file,
                                         const std::string& language,
                                         const std::string& translation);

}  // namespace palpate::runner::design
