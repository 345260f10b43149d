#pragma once
// The texts of the experimenter's console that follow from its state.

#include <functional>
#include <string>

#include "runner/display/display.h"

namespace palpate::runner::display {

/// The label of the button for a command.
const char* button_label(ConsoleCommand::Kind kind);
/// State of the session in a word or two; and what it waits for, or the key to press.
std::string state_title(const ConsoleState& state);
std::string state_detail(const ConsoleState& state);
/// "3 of 24", "3 of about 28"
std::string trial_of(const ConsoleState& state);
/// The level with the name of what varies: "stiffness 80 N/m"; "-": none.
std::string level_text(const ConsoleState& state);
/// The words, or as many letters as fit and an ellipsis. \param room, width  px
std::string shortened(const std::string& words, double room,
                      const std::function<double(const std::string&)>& width);
/// Share of the session's trials that are done, 0 to 1.
double fraction_done(const ConsoleState& state);
/// Whether forces are off only because they have not been needed yet.
bool forces_not_yet_on(const ConsoleState& state);
/// Whether forces are off, the reason, and the button or key to press next.
std::string forces_text(const ConsoleState& state);
/// A number at an axis, in full: "2.5", "500". Half of the number at the axis' end is shown too.
std::string axis_label(double value);
/// "8.2 mW into the hand", "3.0 mW out of the hand"
std::string power_words(double watts);
/// "1 h 05 min", "3 min 20 s"
std::string duration_text(double seconds);

}  // namespace palpate::runner::display
