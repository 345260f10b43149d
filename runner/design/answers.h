#pragma once
// What the page of palpate design asks of a text: pure functions of the text and of the meshes in
// its folder.

#include <nlohmann/json.hpp>
#include <string>

namespace palpate::runner::design {

/// The faults of a protocol, or none with "summary", "devices", "duration_s" as palpate validate
/// --json gives them, and its blocks "in_words".
/// \param path  named in faults; mesh files are in its folder
nlohmann::ordered_json check_answer(const std::string& text, const std::string& path);

/// The surfaces of the stimuli in their own frames, m, and the stylus that touches them:
/// {"stimuli":
/// [{"name", "corners", "triangles", "size_m"}], "stylus": {...}}. \throws as parse_protocol_text
nlohmann::ordered_json picture_answer(const std::string& text, const std::string& path);

/// The trials of a participant, a row each: {"columns": [...], "rows": [[...], ...], "group",
/// "all"}. \throws as parse_protocol_text
nlohmann::ordered_json schedule_answer(const std::string& text, const std::string& path,
                                       int participant);

}  // namespace palpate::runner::design
