#pragma once
// The stimuli of a protocol as a page draws them.

#include <nlohmann/json.hpp>
#include <string>

namespace palpate::runner::design {

/// The surfaces of the stimuli in their own frames, m, with what is drawn on and about them, and
/// the stylus that touches them: {"stimuli": [...], "movements": [{"blocks", "places": {"home_m",
/// "home_radius_m", "targets_m", "target_radius_m"}}], "stylus": {...}}. A stimulus:
///   "name", "written"    its name; in a cell or group also its JSON there
///   "corners", "triangles", "size_m", "all_triangles"  of its surface
///   "marks", "fields"    of its texture (as SurfaceMarks), about it
///   "seen"               another shape, place or size, as a stimulus
///   "varied"             [{"block", "group", "numbers": [{"name", "path", "least", "most"}]}]
/// Where the levels of a block look other than the stimulus itself, the least and the greatest of
/// each number follow it, with
///   "at", "turn_wxyz"    [{"name", "path", "value"}], a turn by such a level
/// and where a group's stimulus looks other than that of all, it follows with its "group".
/// \throws as parse_protocol_text
nlohmann::ordered_json picture_answer(const std::string& text, const std::string& path);

}  // namespace palpate::runner::design
