#pragma once
// A window to touch a scene.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "runner/display/display.h"
#include "runner/display/scene/scene_drawing.h"
#include "runner/display/window.h"

namespace palpate::runner::display {

struct ExploreSettings {
  std::string title;    ///< UTF-8
  double ui_scale = 0;  ///< scale of text and buttons; 0: taken from the monitor
  std::vector<stimuli::ObjectSpec> objects;
  SceneDrawing drawing;                   ///< drawing of `objects`
  SceneDrawingSettings looks;             ///< initial looks
  devices::MouseStylus* mouse = nullptr;  ///< moved by the pointer over the scene; nullptr: none
  WorkspaceMap workspace = {};            ///< the servo's, for the mouse
  /// Saves a picture (".png") or a clip (".webp"). Returns its path or why it failed, in words.
  /// Empty: pictures cannot be saved.
  std::function<std::string(const std::string& bytes, const char* kind)> keep_picture = {};
  /// Called once a frame; true closes the window.
  std::function<bool()> end_requested = {};
};

/// Shows the window until it is closed. Call it in the main thread. \throws DisplayError
void explore_in_window(ExploreSettings settings, TouchSource& source);

}  // namespace palpate::runner::display
