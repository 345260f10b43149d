#pragma once
// Panels of the experimenter's console. Each function draws into the current Dear ImGui window.

#include <deque>
#include <vector>

#include "runner/display/console_view.h"

namespace palpate::runner {

/// \param hidden  leaves out the shape and whether answers were correct
/// \param compact  two values in a row, for low windows
void draw_status(const ConsoleState& state, bool hidden, bool compact);
/// The steps before the first trial: the current one large, with a button for each possible answer.
void draw_checklist(const Checklist& list, EndRequest& ending,
                    std::vector<ConsoleCommand>& commands);
/// Buttons pressed are added to `commands`, without a time. The dialog for ending the session takes
/// the place of the buttons: the console has no pop-ups, so nothing can cover the emergency button.
/// \param compact  as for the status
void draw_buttons(const ConsoleState& state, bool compact, EndRequest& ending,
                  std::vector<ConsoleCommand>& commands);
/// The emergency button along the upper edge of the window, over everything else. Only drawn: its
/// clicks are handled by ConsoleWindow. \return its lower edge, px
float draw_emergency(bool lit);
/// Whether forces are off, why, and the button to allow them again.
/// \param silence  s without an update from the session; 0: updates arrive
void draw_forces_off(const ConsoleState& state, double silence,
                     std::vector<ConsoleCommand>& commands);
/// \param brief  only the servo's faults
void draw_health(const ConsoleState& state, bool brief);
/// \param height  px
void draw_forces(const std::deque<ForcePoint>& forces, float width, float height);
void draw_times(const std::vector<double>& times, float width, float height);
void draw_scores(const std::vector<ShapeScore>& scores, float width, float height);

}  // namespace palpate::runner
