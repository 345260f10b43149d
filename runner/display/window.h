#pragma once
// The participant's window and the experimenter's console on a graphical display.

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "runner/devices/mouse.h"
#include "runner/display/display.h"
#include "runner/display/scene/picture.h"
#include "runner/display/window_places.h"

namespace palpate::runner::display {

struct WindowSettings {
  std::string title;            ///< UTF-8, of the window frames: study and participant
  bool full_screen = false;     ///< the participant's window fills its own monitor
  double ui_scale = 0;          ///< scale of text and buttons; 0: taken from each window's monitor
  int participant_monitor = 0;  ///< from 1; 0: the second if there is one, else the first
  int console_monitor = 0;      ///< from 1; 0: the first
  bool quad_buffer = false;     ///< the participant's window has a buffer for each eye
  std::vector<std::string> texts;  ///< UTF-8, of the protocol: the console loads fonts for them
  /// Called at once, in the display's thread, when the emergency key or button is pressed; the
  /// command follows through commands().
  std::function<void()> emergency;
  devices::MouseStylus* mouse =
      nullptr;             ///< moved by the pointer over the console's view; nullptr: none
  WorkspaceMap workspace;  ///< the servo's, for the mouse
  std::map<std::string, std::string> joystick;  ///< its inputs -> keys; empty: not used
  std::optional<WindowPlaces> places;           ///< places of the windows in an earlier session
  servo::Clock* clock =
      nullptr;  ///< time-stamps keys and commands; required; must outlive the windows
};

/// Participant's screen and console with the loop that draws them. All functions but run() may be
/// called from any thread and do not wait for the display.
class DisplayLoop {
 public:
  virtual ~DisplayLoop() = default;
  virtual ParticipantScreen& participant() = 0;
  virtual ExperimenterConsole& console() = 0;
  /// A warning for the experimenter about the monitors; empty: none.
  virtual std::string warning() const { return {}; }
  /// A warning about characters of the protocol's texts that it cannot show; empty: none.
  virtual std::string unreadable() const { return {}; }
  /// Draws both until end() or until the display is lost. Must run in the main thread, which
  /// created the windows. If it returns (or throws) before end(), the participant's screen is
  /// closed.
  virtual void run() = 0;
  virtual void end() noexcept = 0;
};

/// \throws DisplayError
std::unique_ptr<DisplayLoop> make_windows(const WindowSettings& settings);

/// A warning about characters of the texts that no installed font has; empty: none.
std::string missing_letters(const std::vector<std::string>& texts);

}  // namespace palpate::runner::display
