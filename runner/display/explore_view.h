#pragma once
// What the window of a scene shows: its panels, and what they keep from frame to frame.

#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "runner/display/console_view.h"
#include "runner/display/explore_window.h"
#include "runner/display/scene/camera.h"
#include "runner/display/scene/image_file.h"
#include "runner/display/scene/scene_renderer.h"
#include "runner/display/timeline.h"

namespace palpate::runner {

// A clip of what a window has shown: drawn a few pictures a frame, so the window goes on.

/// Needs the current OpenGL context of the window.
class ExploreClip {
 public:
  static constexpr double kSpan = 5, kEvery = 0.04;  ///< s, of the path
  static constexpr int kWide = 640, kHigh = 360;     ///< px

  /// The last kSpan before the moment that is shown; from the first where that is it. Keeps these
  /// moments: a timeline drops its own while they are drawn. \param timeline  not empty
  ExploreClip(const Timeline& timeline, const Camera& camera);

  using Draw = std::function<ScenePicture(const SceneMoment&)>;
  /// One picture more. \return whether that was the last
  bool go_on(const Draw& draw, const Theme& theme);
  double done() const;  ///< 0 to 1
  /// The animated WebP of what has been drawn; nothing goes on after it. Empty: nothing has.
  std::string finish();

 private:
  SceneRenderer renderer_;
  WebpAnimation animation_;
  Camera camera_;
  std::vector<SceneMoment> moments_;  ///< kEvery apart
  std::size_t drawn_ = 0;
};

/// Needs a current OpenGL context.
class ExploreView {
 public:
  ExploreView(ExploreSettings settings, TouchSource& source);

  /// Draws a frame of Dear ImGui. \param seconds  since the last one
  void draw(double seconds, const Modifiers& modifiers);
  /// As ConsoleView: the emergency button spans the upper edge and lies over everything.
  bool in_emergency_button(float y) const { return y >= 0 && y < emergency_bottom_; }
  void highlight_emergency(bool on) { emergency_highlit_ = on; }

  // What keys do.
  void pause_or_go_on();
  void step(int moments);
  void keep_picture();
  void keep_clip();

  /// Draws what is left of a clip and keeps it; less of it where `go_on`, asked before each picture
  /// with what is done (0 to 1), says no. \return what keep_picture said; empty where none is drawn
  std::string finish_clip(const std::function<bool(double)>& go_on);

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
  std::unique_ptr<ExploreClip> clip_;  ///< while one is drawn
  std::string under_pointer_, note_;
  std::string not_pulled_;          ///< why not, while it is tried
  rendering::BodyPull pull_;        ///< by the pointer; object -1: none
  glm::vec3 pulled_from_{0, 0, 0};  ///< m; where the pointer took hold: the pull stays as far away
  bool labels_ = false, dark_ = true;
  int cut_axis_ = 0;        ///< 0: none; else 1 to 3: x, y, z of the world
  float cut_at_ = 0;        ///< of the size of the scene
  int touched_object_ = 0;  ///< whose material the sliders show; the last: all
  bool goes_on_ = true;     ///< moments have come since it was paused last
  bool steps_ = false;      ///< the newest moment is shown: ticks were asked for while it is paused
  float emergency_bottom_ = 40;
  bool emergency_highlit_ = false, fitted_ = false;
};

}  // namespace palpate::runner
