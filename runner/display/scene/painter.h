#pragma once
// Pictures without a display.

#include <memory>
#include <string>

#include "runner/display/scene/camera.h"
#include "runner/display/scene/picture.h"

namespace palpate::runner::display {

/// Draws into memory, in the thread that created it. All functions throw DisplayError or
/// std::runtime_error if the driver or a library fails.
class ScenePainter {
 public:
  static constexpr int kLeastSide = 16, kMostSide = 8192;  ///< px

  virtual ~ScenePainter() = default;
  /// \param camera  resized to the pictures' size
  virtual void draw(const ScenePicture& picture, Camera camera, const Theme& theme) = 0;
  /// The picture drawn last: rows from the top, three bytes a pixel (red, green, blue).
  virtual const std::string& pixels() const = 0;
  virtual std::string png() const = 0;  ///< the same as a PNG file
  /// Adds the same to an animated WebP. \param seconds  since its first picture
  virtual void add_to_animation(double seconds) = 0;
  /// The animation, which repeats forever. \param seconds  at which its last picture ends
  virtual std::string animation(double seconds) = 0;
};

/// \param width, height  px, within ScenePainter's limits. \throws DisplayError: not built in, or
/// no suitable driver; the message names the remedy
std::unique_ptr<ScenePainter> make_painter(int width, int height);

}  // namespace palpate::runner::display
