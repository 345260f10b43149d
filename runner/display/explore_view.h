#pragma once
// Internal to runner/display: contents of the window of a scene: its panels, and their state
// between frames.

#include <functional>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "runner/display/console_elements.h"
#include "runner/display/explore_window.h"
#include "runner/display/scene/camera.h"
#include "runner/display/scene/scene_renderer.h"
#include "runner/display/scene_view.h"
#include "runner/display/timeline.h"

namespace palpate::runner::display {

class ExploreClip;

/// Needs a current OpenGL context.
class ExploreView {
 public:
  ExploreView(ExploreSettings settings, TouchSource& source);
  ~ExploreView();

  /// Draws a frame of Dear ImGui. \param seconds  since the last one
  void draw(double seconds, const Modifiers& modifiers);
  /// As in ConsoleView: the emergency button spans the upper edge and lies over everything.
  bool in_emergency_button(float y) const { return y >= 0 && y < emergency_bottom_; }
  void highlight_emergency(bool on) { emergency_highlit_ = on; }

  // Actions of keys.
  void pause_or_resume();
  void step(int moments);
  void keep_picture();
  void keep_clip();

  /// Draws the rest of a clip and saves it. Calls `continues` before each picture with the share
  /// done (0 to 1); false ends the clip there. \return result of keep_picture; empty: no clip was
  /// in progress
  std::string finish_clip(const std::function<bool(double)>& continues);

 private:
  void take_moments(double seconds);
  void draw_scene(const Modifiers& modifiers, float width, float height);
  void draw_over_scene(float x, float y, float width, float height) const;
  void draw_axes(float right, float low) const;
  std::string hint() const;
  void steer(const Modifiers& modifiers, float x, float y);
  bool pull(const Modifiers& modifiers, const glm::vec2& at, bool left);
  void draw_time(float width);
  void draw_plot(float width, float height);
  void draw_side();
  void draw_state();
  std::string why_off() const;
  void draw_faults();
  void draw_values();
  void draw_looks();
  void draw_material();
  ScenePicture picture(const SceneMoment* moment) const;
  void continue_clip();
  bool draw_clip();
  void end_clip();

  ExploreSettings settings_;
  TouchSource& source_;
  SceneRenderer renderer_;
  Camera camera_;
  std::optional<PointerControl> control_;
  Timeline timeline_;
  std::vector<SceneMoment> fresh_;
  std::unique_ptr<ExploreClip> clip_;  ///< null: no clip is being drawn
  std::string under_pointer_, note_;
  std::string not_pulled_;    ///< reason why the object cannot be pulled, while the user tries
  rendering::BodyPull pull_;  ///< by the pointer; object -1: none
  glm::vec3 pulled_from_{0, 0, 0};  ///< m; place that the pointer grabbed; the pull keeps its depth
  bool labels_ = false, dark_ = true;
  int cut_axis_ = 0;        ///< 0: none; else 1 to 3: x, y, z of the world
  float cut_at_ = 0;        ///< in sizes of the scene
  int touched_object_ = 0;  ///< object whose material the sliders show; the last index: all
  bool goes_on_ = true;     ///< moments have arrived since the last pause
  bool steps_ = false;      ///< shows the newest moment: ticks were requested while paused
  float emergency_bottom_ = 40;
  bool emergency_highlit_ = false, fitted_ = false;
};

}  // namespace palpate::runner::display
