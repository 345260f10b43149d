#pragma once
// Parts of the console, each a piece of the current Dear ImGui window.

#include <deque>
#include <vector>

#include "runner/display/console_view.h"

namespace palpate {

void style_console(float scale);

void draw_status(const ConsoleState& state);
/// What it asks for is added to `asked`, without a time. \param reason  typed so far, why to end
void draw_buttons(const ConsoleState& state, TypedText& reason, std::vector<ConsoleCommand>& asked);
void draw_emergency(const ConsoleState& state, std::vector<ConsoleCommand>& asked);
void draw_health(const ConsoleState& state);
/// \param height  px
void draw_forces(const std::deque<ForcePoint>& forces, float width, float height);
void draw_times(const std::vector<double>& times, float width, float height);

/// On the button that asks for it.
const char* button_words(ConsoleCommand::Kind kind);
/// Words for bits of Sample::faults; empty for none.
std::string fault_words(std::uint32_t faults);
/// "1 h 05 min", "3 min 20 s"
std::string in_words(double seconds);

}  // namespace palpate
