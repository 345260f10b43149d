#pragma once
// Participant's screen and experimenter's console on one terminal or on pipes, for computers
// without a display. It never names the shape, because the participant may see it.

#include <functional>
#include <memory>

#include "runner/display/window.h"

namespace palpate::runner {

struct TextSettings {
  Clock* clock = nullptr;  ///< time-stamps keys and commands; required; must outlive the display
  /// Called at once, in the display's thread, when the emergency key is pressed; the command
  /// follows through commands().
  std::function<void()> emergency;
};

/// Keys from standard input, pages to standard output, messages to standard error. The end of the
/// input counts as closing the screen. run() must be called by the thread that created it; the
/// destructor restores the terminal.
std::unique_ptr<DisplayLoop> make_text_display(const TextSettings& settings);

}  // namespace palpate::runner
