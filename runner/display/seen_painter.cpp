#include "runner/display/seen_painter.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "runner/display/scene/camera.h"

namespace palpate::runner::display {
namespace {

constexpr double kPatch = 0.015;  // m
constexpr double kBlurReach = 3;  // sd
constexpr int kBlurTaps = 32;     // on each side

constexpr const char* kLayerVertex = R"(#version 330 core
uniform vec4 rectangle;  // left, below, right, above in clip space
uniform vec2 flip;       // 1: the texture's axis is reversed
out vec2 at;
void main() {
  vec2 unit = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  at = mix(unit, 1.0 - unit, flip);
  gl_Position = vec4(mix(rectangle.xy, rectangle.zw, unit), 0.0, 1.0);
})";
constexpr const char* kLayerFragment = R"(#version 330 core
in vec2 at;
uniform sampler2D layer;
uniform int grey;
uniform vec4 fill;  // alpha above 0: this colour instead
out vec4 result;
void main() {
  vec4 c = fill.a > 0.0 ? fill : texture(layer, at);
  result = grey > 0 ? vec4(vec3(dot(c.rgb, vec3(0.2126, 0.7152, 0.0722))), c.a) : c;
})";
constexpr const char* kBlurFragment = R"(#version 330 core
in vec2 at;
uniform sampler2D layer;
uniform vec2 stride;  // of a tap, as a share of the texture
uniform float sd;     // in taps
uniform int taps;
out vec4 result;
void main() {
  vec4 sum = texture(layer, at);
  float weights = 1.0;
  for (int i = 1; i <= taps; ++i) {
    float w = exp(-0.5 * float(i * i) / (sd * sd));
    sum += w * (texture(layer, at + float(i) * stride) + texture(layer, at - float(i) * stride));
    weights += 2.0 * w;
  }
  result = sum / weights;
})";

/// px, sd of a blur of a trial in a picture of this width; 0: none.
double blur_pixels(const SeenTrial& trial, int width) {
  if (!(trial.seen.blur_deg > 0)) return 0;
  const protocols::ViewSpec& view = trial.view;
  const Vec3 across = view.lower_right - view.lower_left;
  const Vec3 normal = glm::normalize(glm::cross(across, view.upper_left - view.lower_left));
  const double distance = glm::dot(view.eye - view.lower_left, normal);
  return std::tan(trial.seen.blur_deg * std::numbers::pi / 180) * distance * width /
         glm::length(across);
}

}  // namespace

SeenPainter::SeenPainter()
    : renderer_(SceneRenderer::live_quality()),
      layer_(kLayerVertex, kLayerFragment),
      blur_(kLayerVertex, kBlurFragment) {
  glGenVertexArrays(1, &vertices_);
  glGenTextures(1, &page_);
  glGenFramebuffers(2, frames_);
  glGenTextures(2, blurs_);
  check_opengl("preparing the participant's view");
}

SeenPainter::~SeenPainter() {
  glDeleteTextures(2, blurs_);
  glDeleteFramebuffers(2, frames_);
  glDeleteTextures(1, &page_);
  glDeleteVertexArrays(1, &vertices_);
}

/// A picture for a mirror is flipped as a whole, text and patch as well.
void SeenPainter::draw_layer(Layer layer, const protocols::ViewSpec& view) const {
  const bool across = view.mirror == protocols::Mirror::horizontal,
             up = view.mirror == protocols::Mirror::vertical;
  if (across) {
    std::swap(layer.left, layer.right);
    layer.left = 1 - layer.left;
    layer.right = 1 - layer.right;
  }
  if (up) {
    std::swap(layer.below, layer.above);
    layer.below = 1 - layer.below;
    layer.above = 1 - layer.above;
  }
  layer_.use();
  layer_.set("rectangle", glm::vec4(2 * layer.left - 1, 2 * layer.below - 1, 2 * layer.right - 1,
                                    2 * layer.above - 1));
  layer_.set("flip", glm::vec2(across ? 1 : 0, layer.top_first != up ? 1 : 0));
  layer_.set("layer", 0);
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D, layer.texture);
  glBindVertexArray(vertices_);
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
}

/// Two passes of a separable Gaussian on the scene alone.
unsigned SeenPainter::blurred(const Frame& frame, unsigned scene, int width, int height) {
  const double sd = blur_pixels(frame.scene->trial(), width);
  if (!(kBlurReach * sd >= 1)) return scene;
  if (blur_width_ != width || blur_height_ != height) {
    for (const unsigned texture : blurs_) {
      glBindTexture(GL_TEXTURE_2D, texture);
      glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB8, width, height, 0, GL_RGB, GL_UNSIGNED_BYTE, nullptr);
      glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
      glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
      glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
      glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    }
    blur_width_ = width;
    blur_height_ = height;
  }
  glBindTexture(GL_TEXTURE_2D, scene);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  const int taps = std::clamp(static_cast<int>(std::ceil(kBlurReach * sd)), 1, kBlurTaps);
  const double step = std::max(1.0, kBlurReach * sd / taps);  // px
  blur_.use();
  blur_.set("rectangle", glm::vec4(-1, -1, 1, 1));
  blur_.set("flip", glm::vec2(0, 0));
  blur_.set("layer", 0);
  blur_.set("sd", static_cast<float>(sd / step));
  blur_.set("taps", taps);
  glActiveTexture(GL_TEXTURE0);
  glBindVertexArray(vertices_);
  glDisable(GL_BLEND);
  glDisable(GL_DEPTH_TEST);
  glViewport(0, 0, width, height);
  for (int pass = 0; pass < 2; ++pass) {
    glBindFramebuffer(GL_FRAMEBUFFER, frames_[pass]);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, blurs_[pass], 0);
    blur_.set("stride", pass == 0 ? glm::vec2(static_cast<float>(step / width), 0)
                                  : glm::vec2(0, static_cast<float>(step / height)));
    glBindTexture(GL_TEXTURE_2D, pass == 0 ? scene : blurs_[0]);
    glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
    finish_target();
  }
  return blurs_[1];
}

SeenPainter::Part SeenPainter::screen_part(const protocols::ViewSpec& view, int width, int height) {
  const double wanted = glm::length(view.lower_right - view.lower_left) /
                        glm::length(view.upper_left - view.lower_left);
  const auto narrow = static_cast<float>(std::min(1.0, wanted * height / width)),
             low = static_cast<float>(std::min(1.0, width / (wanted * height)));
  return {(1 - narrow) / 2, (1 - low) / 2, (1 + narrow) / 2, (1 + low) / 2};
}

SeenPainter::Layer SeenPainter::fitted(const protocols::ViewSpec& view, const Layer& at, int width,
                                       int height) const {
  const Part part = screen_part(view, width, height);
  Layer out = at;
  out.left = at.left + part.left * (at.right - at.left);
  out.right = at.left + part.right * (at.right - at.left);
  out.below = at.below + part.below * (at.above - at.below);
  out.above = at.below + part.above * (at.above - at.below);
  return out;
}

void SeenPainter::draw_eye(const Frame& frame, double right, const Layer& of_window, int width,
                           int height) {
  const Layer at = fitted(frame.scene->trial().view, of_window, width, height);
  const int across = std::max(1, static_cast<int>(std::lround(width * double{at.right - at.left})));
  const int high = std::max(1, static_cast<int>(std::lround(height * double{at.above - at.below})));
  Camera camera;
  camera.resize(static_cast<float>(across), static_cast<float>(high));
  camera.look_through(window_of(frame.scene->trial(), right));
  ScenePicture picture;
  picture.with_ground = false;
  if (frame.moment != nullptr) picture = frame.scene->picture(*frame.moment, frame.time_ns);
  const unsigned scene = renderer_.draw(picture, camera, frame.scene->theme(), across, high);
  Layer layer = at;
  layer.texture = blurred(frame, scene, across, high);
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  glViewport(0, 0, width, height);
  glDisable(GL_BLEND);
  glDisable(GL_DEPTH_TEST);
  const bool red = colours_ != Colours::cyan, cyan = colours_ != Colours::red;
  glColorMask(red, cyan, cyan, GL_TRUE);
  draw_layer(layer, frame.scene->trial().view);
  layer = of_window;
  layer.texture = page_;
  layer.top_first = true;
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);  // cairo's colours are premultiplied
  draw_layer(layer, frame.scene->trial().view);
  glDisable(GL_BLEND);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
}

/// White in frames with forces on, else black: for a photodiode.
void SeenPainter::draw_patch(const Frame& frame, int width, int height) const {
  const protocols::ViewSpec& view = frame.scene->trial().view;
  using protocols::PatchPlace;
  if (view.patch == PatchPlace::none) return;
  const auto across = static_cast<float>(kPatch / glm::length(view.lower_right - view.lower_left)),
             high = static_cast<float>(kPatch / glm::length(view.upper_left - view.lower_left));
  const bool left = view.patch == PatchPlace::lower_left || view.patch == PatchPlace::upper_left;
  const bool low = view.patch == PatchPlace::lower_left || view.patch == PatchPlace::lower_right;
  Layer patch = fitted(view, {}, width, height);
  const float wide = across * (patch.right - patch.left), tall = high * (patch.above - patch.below);
  (left ? patch.right : patch.left) = left ? patch.left + wide : patch.right - wide;
  (low ? patch.above : patch.below) = low ? patch.below + tall : patch.above - tall;
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  glViewport(0, 0, width, height);
  layer_.use();
  const float grey = frame.forces ? 1 : 0;
  layer_.set("fill", glm::vec4(grey, grey, grey, 1));
  draw_layer(patch, view);
  layer_.set("fill", glm::vec4(0));
}

void SeenPainter::paint(const Frame& frame, const Image& page, bool changed, int width,
                        int height) {
  if (changed) {
    glBindTexture(GL_TEXTURE_2D, page_);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, page.width, page.height, 0, GL_BGRA, GL_UNSIGNED_BYTE,
                 page.pixels.data());
  }
  const protocols::ViewSpec& view = frame.scene->trial().view;
  const double half = view.ipd / 2;
  const auto part_of = [](float left, float below, float right, float above) {
    Layer out;
    out.left = left;
    out.below = below;
    out.right = right;
    out.above = above;
    return out;
  };
  const float grey = grey_of(view.background);
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  glClearColor(grey, grey, grey, 1);
  glClear(GL_COLOR_BUFFER_BIT);
  layer_.use();
  layer_.set("fill", glm::vec4(0));
  layer_.set("grey", 0);
  switch (view.stereo) {
    case protocols::Stereo::none:
      draw_eye(frame, 0, {}, width, height);
      break;
    case protocols::Stereo::side_by_side:
      draw_eye(frame, -half, part_of(0, 0, 0.5F, 1), width, height);
      draw_eye(frame, half, part_of(0.5F, 0, 1, 1), width, height);
      break;
    case protocols::Stereo::top_bottom:
      draw_eye(frame, -half, part_of(0, 0.5F, 1, 1), width, height);
      draw_eye(frame, half, part_of(0, 0, 1, 0.5F), width, height);
      break;
    case protocols::Stereo::anaglyph:
      layer_.use();
      layer_.set("grey", 1);
      for (const bool left : {true, false}) {
        colours_ = left ? Colours::red : Colours::cyan;
        draw_eye(frame, left ? -half : half, {}, width, height);
      }
      colours_ = Colours::all;
      layer_.use();
      layer_.set("grey", 0);
      break;
    case protocols::Stereo::quad_buffer:
      glDrawBuffer(GL_BACK_LEFT);
      draw_eye(frame, -half, {}, width, height);
      glDrawBuffer(GL_BACK_RIGHT);
      draw_eye(frame, half, {}, width, height);
      glDrawBuffer(GL_BACK);
      break;
  }
  draw_patch(frame, width, height);
  glBindVertexArray(0);
  glUseProgram(0);
  check_opengl("painting the participant's view");
}

}  // namespace palpate::runner::display
