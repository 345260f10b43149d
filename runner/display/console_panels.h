#pragma once
// Parts of the console, each a piece of the current Dear ImGui window.

#include <deque>
#include <vector>

#include "runner/display/console_view.h"

namespace palpate::runner {

void style_console(float scale);

/// \param hidden  leave out the shape and whether answers were right
/// \param beside  two values in a line, where there is more width than height
void draw_status(const ConsoleState& state, bool hidden, bool beside);
/// What is due before the first trial, large, with a button for each thing to say to it.
void draw_checklist(const Checklist& list, Ending& ending, std::vector<ConsoleCommand>& asked);
/// What it asks for is added to `asked`, without a time. Asks for the reason of an end in the
/// buttons' place: nothing in the console pops up, so nothing can cover the emergency button.
/// \param beside  as for the status: little height
void draw_buttons(const ConsoleState& state, bool beside, Ending& ending,
                  std::vector<ConsoleCommand>& asked);
/// Along the upper edge of the window, over everything else. It takes no clicks by itself.
/// \return its lower edge, px
float draw_emergency(bool lit);
/// Whether forces are off, why, and the button to allow them again.
/// \param silence  s without news from the session; 0: there are some
void draw_forces_off(const ConsoleState& state, double silence, std::vector<ConsoleCommand>& asked);
/// \param brief  only whether it is sound
void draw_health(const ConsoleState& state, bool brief);
/// \param height  px
void draw_forces(const std::deque<ForcePoint>& forces, float width, float height);
void draw_times(const std::vector<double>& times, float width, float height);
void draw_scores(const std::vector<ShapeScore>& scores, float width, float height);

/// On the button that asks for it.
const char* button_words(ConsoleCommand::Kind kind);
/// Words for bits of Sample::faults; empty for none.
std::string fault_words(std::uint32_t faults);
/// Why forces are off, as far as the session or the servo tells.
std::string forces_off_reason(const ConsoleState& state);
/// What is going on, in a word or two, and what goes with it: what it waits for.
std::string state_title(const ConsoleState& state);
std::string beside_state(const ConsoleState& state);
/// Of the session's trials, 0 to 1: the one that is said to be under way counts once it is over.
double share_done(const ConsoleState& state);
/// Forces are off as they have not been needed yet: nothing is wrong.
bool not_on_yet(const ConsoleState& state);
/// Whether forces are off, why, and what to press next.
std::string words_of_forces(const ConsoleState& state);
/// "1 h 05 min", "3 min 20 s"
std::string in_words(double seconds);

}  // namespace palpate::runner
