#pragma once
// The texts of the experimenter's console that follow from its state.

#include <string>

#include "runner/display/display.h"

namespace palpate::runner {

/// On the button that asks for it.
const char* button_words(ConsoleCommand::Kind kind);
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
