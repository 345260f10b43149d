#pragma once
// The texts of the experimenter's console that follow from its state.

#include <string>

#include "runner/display/display.h"

namespace palpate::runner {

/// The label of the button for a command.
const char* button_label(ConsoleCommand::Kind kind);
/// Why forces are off, as far as the session or the servo tells.
std::string forces_off_reason(const ConsoleState& state);
/// The state of the session in a word or two, and what it waits for or what to press.
std::string state_title(const ConsoleState& state);
std::string state_detail(const ConsoleState& state);
/// Fraction of the session's trials that are done, 0 to 1.
double fraction_done(const ConsoleState& state);
/// Forces are off only because they have not been needed yet: nothing is wrong.
bool forces_not_yet_on(const ConsoleState& state);
/// Whether forces are off, why, and what to press next.
std::string forces_text(const ConsoleState& state);
/// A number of an axis as it is, of half the number at its end too: "2.5", "500".
std::string axis_label(double value);
/// "1 h 05 min", "3 min 20 s"
std::string duration_text(double seconds);

}  // namespace palpate::runner
