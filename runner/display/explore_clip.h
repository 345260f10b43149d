#pragma once
// A clip of what a window has shown: drawn one picture a frame, so the window goes on.

#include <functional>
#include <optional>
#include <string>

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

  /// The last kSpan before the moment that is shown; from the first where that is it.
  ExploreClip(const Timeline& timeline, const Camera& camera);

  using Draw = std::function<ScenePicture(const SceneMoment&)>;
  /// One picture more. \return the animated WebP, once the last is there
  std::optional<std::string> go_on(const Timeline& timeline, const Draw& draw, const Theme& theme);
  double done() const;  ///< 0 to 1

 private:
  SceneRenderer renderer_;
  WebpAnimation animation_;
  Camera camera_;
  double from_, to_, next_;
};

}  // namespace palpate::runner
