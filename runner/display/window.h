#pragma once
// The participant's window and the experimenter's console on a graphical display.

#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "runner/devices/mouse.h"
#include "runner/display/display.h"

namespace palpate::runner {

/// No window: none was built in, no display answers, or it is no good. The text tells which.
class DisplayError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct WindowSettings {
  std::string title;               ///< UTF-8, of the window frames: study and participant
  bool full_screen = false;        ///< the participant's window, on a monitor of its own
  double ui_scale = 0;             ///< of letters and buttons; 0: each window's from its monitor
  int participant_monitor = 0;     ///< from 1; 0: the second if there is one, else the first
  int console_monitor = 0;         ///< from 1; 0: the first
  std::vector<std::string> texts;  ///< UTF-8, of the protocol: the console loads letters for them
  /// Called at once, in the display's thread, when the emergency key or button is pressed; the
  /// command follows through commands().
  std::function<void()> emergency;
  MouseStylus* mouse = nullptr;  ///< moved by the pointer over the console's view; may be none
  WorkspaceMap workspace;        ///< of the servo, for the mouse
  Clock* clock = nullptr;        ///< stamps keys and commands; required; must outlive the windows
};

/// Two windows and the thread that draws them. All but run() may be called from any thread, and
/// none of it waits for the display.
class DisplayLoop {
 public:
  virtual ~DisplayLoop() = default;
  virtual ParticipantScreen& participant() = 0;
  virtual ExperimenterConsole& console() = 0;
  /// What the experimenter should know of the monitors: a sentence; empty: nothing.
  virtual std::string warning() const { return {}; }
  /// What of the protocol's texts it cannot show: a sentence; empty: nothing.
  virtual std::string unreadable() const { return {}; }
  /// Shows both until end() or until the display dies. On the main thread, that made the windows.
  /// Where it leaves before end(), by an exception as well, the participant's screen is not open.
  virtual void run() = 0;
  virtual void end() noexcept = 0;
};

/// \throws DisplayError
std::unique_ptr<DisplayLoop> make_windows(const WindowSettings& settings);

/// What of the texts no installed font can show: a sentence for the experimenter; empty if all can.
std::string missing_letters(const std::vector<std::string>& texts);

}  // namespace palpate::runner
