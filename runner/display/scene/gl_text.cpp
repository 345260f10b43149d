#include "runner/display/scene/gl_text.h"

#include <epoxy/gl.h>

#include <cmath>

#include "runner/display/scene/shaders.h"
#include "runner/display/scene/text_image.h"

namespace palpate::runner {

GlText::GlText() : program_(shaders::kTextVertex, shaders::kTextFragment) {
  glGenVertexArrays(1, &nothing_);
}

GlText::~GlText() {
  for (const auto& [text, known] : known_) glDeleteTextures(1, &known.texture);
  glDeleteVertexArrays(1, &nothing_);
}

void GlText::begin(const glm::vec2& picture, double size, const Theme& theme) {
  if (size != size_ || &theme != theme_) {
    for (const auto& [text, known] : known_) glDeleteTextures(1, &known.texture);
    known_.clear();
  }
  picture_ = picture;
  size_ = size;
  theme_ = &theme;
  for (auto& [text, known] : known_) known.used = false;
  glDisable(GL_DEPTH_TEST);
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  program_.use();
  program_.set("picture", picture_);
  program_.set("text", 0);
  glBindVertexArray(nothing_);
}

const GlText::Known& GlText::known(const std::string& text) {
  Known& out = known_[text];
  out.used = true;
  if (out.texture != 0) return out;
  const TextImage image = text_image(text, size_, theme_->text, theme_->halo);
  out.size = {image.width, image.height};
  glGenTextures(1, &out.texture);
  glBindTexture(GL_TEXTURE_2D, out.texture);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, image.width, image.height, 0, GL_BGRA, GL_UNSIGNED_BYTE,
               image.bgra.data());
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  return out;
}

void GlText::draw(const std::string& text, const glm::vec2& at, TextAnchor anchor) {
  if (text.empty()) return;
  const Known& image = known(text);
  glm::vec2 corner = at;
  if (anchor == TextAnchor::left) corner.y -= image.size.y / 2;
  if (anchor == TextAnchor::centre) corner -= 0.5F * image.size;
  if (anchor == TextAnchor::lower_left) corner.y -= image.size.y;
  program_.set("corner", glm::vec2(std::round(corner.x), std::round(corner.y)));
  program_.set("size", image.size);
  glBindTexture(GL_TEXTURE_2D, image.texture);
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
}

void GlText::end() {
  for (auto it = known_.begin(); it != known_.end();) {
    if (it->second.used) {
      ++it;
      continue;
    }
    glDeleteTextures(1, &it->second.texture);
    it = known_.erase(it);
  }
  glDisable(GL_BLEND);
}

}  // namespace palpate::runner
