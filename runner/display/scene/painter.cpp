#include "runner/display/scene/painter.h"

#include <dlfcn.h>
#include <epoxy/egl.h>

#include <cstdlib>
#include <optional>
#include <string>

#include "runner/display/scene/image_file.h"
#include "runner/display/scene/picture.h"
#include "runner/display/scene/scene_renderer.h"

namespace palpate::runner::display {
namespace {

// OpenGL without a display.

/// A context of its own, current in the creating thread until destroyed there.
class OffscreenContext {
 public:
  /// \throws DisplayError naming the missing part
  OffscreenContext();
  ~OffscreenContext();
  OffscreenContext(const OffscreenContext&) = delete;
  OffscreenContext& operator=(const OffscreenContext&) = delete;

 private:
  void* display_ = nullptr;
  void* context_ = nullptr;
};

[[noreturn]] void refuse(const std::string& why) {
  throw DisplayError("no pictures can be drawn without a display: " + why +
                     "; Debian's packages libegl1 and libgl1-mesa-dri draw on any computer");
}

// EGL_MESA_platform_surfaceless: no window system at all. Drivers without it have a default
// display.
EGLDisplay surfaceless_display() {
  if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_MESA_platform_surfaceless") &&
      epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_platform_base"))
    return eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA,
                                    static_cast<void*>(EGL_DEFAULT_DISPLAY), nullptr);
  return eglGetDisplay(EGL_DEFAULT_DISPLAY);
}

OffscreenContext::OffscreenContext() {
  // libepoxy ends the program if it does not find the library.
  void* const library = dlopen("libEGL.so.1", RTLD_LAZY | RTLD_LOCAL);
  if (library == nullptr) refuse("the library libEGL is not installed");
  display_ = surfaceless_display();
  if (display_ == EGL_NO_DISPLAY) refuse("EGL gives no display");
  if (eglInitialize(display_, nullptr, nullptr) == EGL_FALSE)
    refuse("EGL cannot start (error " + std::to_string(eglGetError()) + ")");
  const auto give_up = [this](const std::string& why) {
    eglTerminate(display_);
    refuse(why);
  };
  if (!epoxy_has_egl_extension(display_, "EGL_KHR_surfaceless_context") ||
      !epoxy_has_egl_extension(display_, "EGL_KHR_no_config_context"))
    give_up("this EGL draws into windows only");
  if (eglBindAPI(EGL_OPENGL_API) == EGL_FALSE) give_up("this EGL has no OpenGL");
  constexpr EGLint kWanted[] = {EGL_CONTEXT_MAJOR_VERSION,
                                3,
                                EGL_CONTEXT_MINOR_VERSION,
                                3,
                                EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                EGL_NONE};
  context_ = eglCreateContext(display_, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, kWanted);
  if (context_ == EGL_NO_CONTEXT) give_up("this driver has no OpenGL 3.3");
  if (eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) == EGL_FALSE)
    give_up("the context cannot be used (error " + std::to_string(eglGetError()) + ")");
}

OffscreenContext::~OffscreenContext() {
  eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(display_, context_);
  eglTerminate(display_);
}

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

}  // namespace palpate::runner::display
