#pragma once
// Answers to the page of palpate design about a text: pure functions of the text and of the meshes
// in its folder.

#include <nlohmann/json.hpp>
#include <string>

#include "protocols/protocol.h"
#include "runner/scene_builder.h"

namespace palpate::runner::design {

/// Meshes with their search trees that answers have built: what most edits leave as it is.
class BuiltShapes {
 public:
  /// Without what may have changed or is of no use any more.
  SceneBuilder& for_protocol(const protocols::Protocol& protocol);

 private:
  SceneBuilder builder_;
  int checks_ = 0;  ///< that it has served: then it is made anew, so that it does not grow for ever
};

/// The faults of a protocol, or none with "summary", "devices", "duration_s" as palpate validate
/// --json gives them, and its blocks "in_words".
/// \param path  named in faults; mesh files are in its folder. \param shapes  of earlier answers:
/// most edits leave them as they are
nlohmann::ordered_json check_answer(const std::string& text, const std::string& path,
                                    BuiltShapes& shapes);

/// The results of 'palpate schedule --recover' for the procedures of a block: {"procedures":
/// [...]}. \throws as parse_protocol_text; UsageError: they find no threshold
nlohmann::ordered_json recover_answer(const std::string& text, const std::string& path,
                                      const std::string& block, int participants);

/// The trials of a participant, a row each: {"columns": [...], "rows": [[...], ...], "group",
/// "all"}. \throws as parse_protocol_text
nlohmann::ordered_json schedule_answer(const std::string& text, const std::string& path,
                                       int participant);

}  // namespace palpate::runner::design
