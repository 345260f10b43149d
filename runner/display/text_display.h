#pragma once
// Participant's screen and experimenter's console on one terminal, or on pipes: where there is no
// display. It names no shape: the participant may see it.

#include <functional>
#include <memory>

#include "runner/display/window.h"

namespace palpate::runner {

struct TextSettings {
  Clock* clock = nullptr;  ///< stamps keys and commands; required; must outlive the display
  /// Called at once, in the display's thread, when the emergency key is pressed; the command
  /// follows through commands().
  std::function<void()> emergency;
};

/// Keys from standard input, pages to standard output, messages to standard error. The end of the
/// input counts as closing the screen. Its run() belongs to the thread that made it; the terminal
/// is as before once it is destroyed.
std::unique_ptr<DisplayLoop> make_text_display(const TextSettings& settings);

}  // namespace palpate::runner
