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

}  // namespace palpate::runner
