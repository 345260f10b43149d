#pragma once
// A window to touch a scene.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "runner/display/display.h"
#include "runner/display/scene/scene_drawing.h"
#include "runner/display/window.h"

namespace palpate::runner {

struct ExploreSettings {
  std::string title;    ///< UTF-8
  double ui_scale = 0;  ///< of text and buttons; 0: taken from the monitor
  std::vector<stimuli::ObjectSpec> objects;
  SceneDrawing drawing;          ///< of these
  SceneDrawingSettings looks;    ///< at first
  MouseStylus* mouse = nullptr;  ///< moved by the pointer over the scene; nullptr: none
  WorkspaceMap workspace = {};   ///< of the servo, for the mouse
  /// Keeps a picture (".png") or a clip (".webp") and says where, or why not; empty: none are kept.
  std::function<std::string(const std::string& bytes, const char* kind)> keep_picture = {};
  /// Asked once a frame: true ends the window.
  std::function<bool()> end_requested = {};
};

/// Shows the window until it is closed. In the main thread. \throws DisplayError
void explore_in_window(ExploreSettings settings, TouchSource& source);

}  // namespace palpate::runner
