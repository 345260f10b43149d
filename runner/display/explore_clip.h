#pragma once
// A clip of what a window has shown: drawn a few pictures a frame, so the window goes on.

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "runner/display/scene/camera.h"
#include "runner/display/scene/image_file.h"
#include "runner/display/scene/scene_renderer.h"
#include "runner/display/timeline.h"

namespace palpate::runner {

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

}  // namespace palpate::runner
