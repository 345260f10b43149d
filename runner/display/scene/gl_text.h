#pragma once
// Text over a picture.

#include <glm/vec2.hpp>
#include <map>
#include <string>

#include "runner/display/scene/gl_objects.h"
#include "runner/display/scene/picture.h"

namespace palpate::runner::display {

/// The point of the text that is positioned: its left end at mid-height, its centre, its lower left
/// corner.
enum class TextAnchor { left, centre, lower_left };

class GlText {
 public:
  GlText();
  ~GlText();
  GlText(const GlText&) = delete;
  GlText& operator=(const GlText&) = delete;

  /// Begins the texts of a picture, drawn into the bound target. \param size  px, of the font
  void begin(const glm::vec2& picture, double size, const Theme& theme);
  void draw(const std::string& text, const glm::vec2& at, TextAnchor anchor);
  /// Size of the text as drawn, px.
  glm::vec2 size_of(const std::string& text) { return known(text).size; }
  void end();

 private:
  struct Known {
    unsigned texture = 0;
    glm::vec2 size{0, 0};
    bool used = false;
  };
  const Known& known(const std::string& text);

  GlProgram program_;
  unsigned nothing_ = 0;  ///< vertex array without data: the shader computes the vertices
  std::map<std::string, Known> known_;
  glm::vec2 picture_{1, 1};
  double size_ = 0;
  const Theme* theme_ = nullptr;
};

}  // namespace palpate::runner::display
