#include "runner/display/scene/painter.h"

#include <optional>

#include "runner/display/scene/image_file.h"
#include "runner/display/scene/offscreen.h"
#include "runner/display/scene/scene_renderer.h"

namespace palpate::runner {
namespace {

class OffscreenPainter final : public ScenePainter {
 public:
  OffscreenPainter(int width, int height) : width_(width), height_(height) {}

  void draw(const ScenePicture& picture, Camera camera, const Theme& theme) override {
    camera.resize(static_cast<float>(width_), static_cast<float>(height_));
    renderer_.draw(picture, camera, theme, width_, height_);
    pixels_ = renderer_.pixels();
  }
  const std::string& pixels() const override { return pixels_; }
  std::string png() const override { return png_of(pixels_, width_, height_); }
  void add_to_animation(double seconds) override {
    if (!animation_) animation_.emplace(width_, height_);
    animation_->add(pixels_, seconds);
  }
  std::string animation(double seconds) override {
    if (!animation_) return {};
    return animation_->finish(seconds);
  }

 private:
  const int width_, height_;
  OffscreenContext context_;
  SceneRenderer renderer_;
  std::string pixels_;
  std::optional<WebpAnimation> animation_;
};

}  // namespace

std::unique_ptr<ScenePainter> make_painter(int width, int height) {
  return std::make_unique<OffscreenPainter>(width, height);
}

}  // namespace palpate::runner
