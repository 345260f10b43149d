#pragma once
// Panels of the experimenter's console. Each function draws into the current Dear ImGui window.

#include <array>
#include <cstddef>
#include <deque>
#include <vector>

#include "runner/display/display.h"

namespace palpate::runner::display {

/// A point of the force plot.
struct ForcePoint {
  double time = 0;   ///< s, session clock
  double force = 0;  ///< N, on the hand, sum of both devices
};

/// Text of an input field, zero-terminated.
using TypedText = std::array<char, 1000>;

/// The dialog for ending the session.
struct EndRequest {
  bool open = false, shown = false;
  TypedText reason{};  ///< as typed so far
};

/// The dialog for another answer to a question of a page.
struct Correction {
  bool open = false;
  std::size_t at = 0;  ///< into ConsoleState::given
  TypedText answer{};  ///< as typed so far
};

/// \param hidden  leaves out the shape and whether answers were correct
/// \param compact  two values in a row, for low windows
void draw_status(const ConsoleState& state, bool hidden, bool compact);
/// The steps before the first trial: the current one large, with a button for each possible answer.
void draw_checklist(const Checklist& list, EndRequest& ending,
                    std::vector<ConsoleCommand>& commands);
/// Adds a command, without a time, for each button pressed. The dialog for ending the session
/// replaces the buttons: the console has no pop-ups, so nothing can cover the emergency button.
/// The dialog for correcting an answer does so, too. \param compact  as for the status
void draw_buttons(const ConsoleState& state, bool compact, EndRequest& ending,
                  Correction& correction, std::vector<ConsoleCommand>& commands);
/// If forces are off: the reason, and the button to allow them again.
/// \param silence  s without an update from the session; 0: updates arrive
void draw_forces_off(const ConsoleState& state, double silence,
                     std::vector<ConsoleCommand>& commands);
/// \param compact  as for the status
void draw_health(const ConsoleState& state, bool compact);
float health_height(const ConsoleState& state);  ///< px, of that which is not compact
/// \param height  px
void draw_forces(const std::deque<ForcePoint>& forces, float width, float height);
void draw_times(const std::vector<double>& times, float width, float height);
void draw_scores(const ConsoleState& state, float width, float height);

}  // namespace palpate::runner::display
