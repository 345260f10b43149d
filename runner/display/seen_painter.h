#pragma once
// Paints what a participant sees, and the page's texts over it, into the window of the current
// OpenGL context.

#include <memory>

#include "runner/display/participant_window.h"
#include "runner/display/scene/gl_objects.h"
#include "runner/display/scene/scene_renderer.h"
#include "runner/display/seen.h"

namespace palpate::runner::display {

/// Needs a current context of OpenGL 3.3, also to be destroyed.
class SeenPainter {
 public:
  /// \throws DisplayError naming the missing part of OpenGL
  SeenPainter();
  ~SeenPainter();
  SeenPainter(const SeenPainter&) = delete;
  SeenPainter& operator=(const SeenPainter&) = delete;

  /// A moment of a scene; null: nothing of it is visible.
  struct Frame {
    const SeenScene* scene = nullptr;    ///< of the interval
    const SeenMoment* moment = nullptr;  ///< null: only the background is seen
    std::int64_t time_ns = 0;            ///< session clock
    bool forces = false;                 ///< for the patch
  };
  /// Draws into the window's back buffer. \param page  with an alpha channel, of the window's size
  /// \param changed  the page is another than that of the last call \throws DisplayError
  void paint(const Frame& frame, const Image& page, bool changed, int width, int height);

  /// A rectangle in shares of the window, y up.
  struct Part {
    float left = 0, below = 0, right = 1, above = 1;
  };
  /// The part of the window that has the sides of the protocol's screen: the whole, if it is there.
  static Part screen_part(const protocols::ViewSpec& view, int width, int height);

 private:
  struct Layer : Part {
    unsigned texture = 0;
    bool top_first = false;  ///< rows of the texture are from the top
  };
  /// \param at  of the window, which this eye sees
  void draw_eye(const Frame& frame, double right, const Layer& at, int width, int height);
  /// The part of `at` that has the sides of the screen in the protocol.
  Layer fitted(const protocols::ViewSpec& view, const Layer& at, int width, int height) const;
  void draw_layer(Layer layer, const protocols::ViewSpec& view) const;
  unsigned blurred(const Frame& frame, unsigned scene, int width, int height);
  void draw_patch(const Frame& frame, int width, int height) const;

  enum class Colours { all, red, cyan };

  SceneRenderer renderer_;
  Colours colours_ = Colours::all;  ///< anaglyph: of the eye that is drawn
  GlProgram layer_, blur_;
  unsigned vertices_ = 0, page_ = 0;
  unsigned frames_[2] = {0, 0}, blurs_[2] = {0, 0};
  int blur_width_ = 0, blur_height_ = 0;
};

}  // namespace palpate::runner::display
