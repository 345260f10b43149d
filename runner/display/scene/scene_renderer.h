#pragma once
// Draws scenes: one drawing code for windows and files. OpenGL 3.3 forward renderer with several
// samples a pixel, soft shadows of a lamp and of the sky, and a hemisphere light.

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "runner/display/scene/camera.h"
#include "runner/display/scene/drawn_mesh.h"
#include "runner/display/scene/picture.h"

namespace palpate::runner::display {

// Owners of OpenGL objects, which free them. All need a current OpenGL 3.3 context, also in their
// destructors.

/// \throws DisplayError if the current context is too old to draw scenes
void require_opengl();

/// Whether the CPU draws instead of a graphics card.
bool draws_in_software();

/// Call after the last drawing into a target, before drawing into another. If the CPU draws, waits
/// until it has finished. Without the wait Mesa's software driver (llvmpipe, seen in 22.3.6) may
/// free a target's fence while the thread that signals it still uses it; that thread then writes
/// into freed memory.
void finish_target();

/// \throws DisplayError naming `doing` if OpenGL reports an error
void check_opengl(const char* doing);

/// A mesh on the graphics card.
class GlMesh {
 public:
  explicit GlMesh(const DrawnMesh& mesh);
  ~GlMesh();
  GlMesh(const GlMesh&) = delete;
  GlMesh& operator=(const GlMesh&) = delete;
  void draw() const;

 private:
  unsigned vertices_ = 0, buffer_ = 0;
  int corners_ = 0;
};

class GlProgram {
 public:
  /// \throws DisplayError with the driver's reason
  GlProgram(const char* vertex_shader, const char* fragment_shader);
  ~GlProgram();
  GlProgram(const GlProgram&) = delete;
  GlProgram& operator=(const GlProgram&) = delete;

  void use() const;
  // Set uniforms of the program in use.
  void set(const char* name, float value) const;
  void set(const char* name, int value) const;
  void set(const char* name, const glm::vec2& value) const;
  void set(const char* name, const glm::vec3& value) const;
  void set(const char* name, const glm::vec4& value) const;
  void set(const char* name, const glm::mat4& value) const;

 private:
  int place_of(const char* name) const;
  unsigned program_ = 0;
};

/// A render target with several samples a pixel, and its resolved texture.
class GlCanvas {
 public:
  ~GlCanvas();
  GlCanvas() = default;
  GlCanvas(const GlCanvas&) = delete;
  GlCanvas& operator=(const GlCanvas&) = delete;

  /// Resizes it (px) and binds it. \throws DisplayError: too large for the driver
  void begin(int width, int height, int samples);
  /// Resolves the samples into the texture.
  void end() const;
  unsigned texture() const { return texture_; }
  /// Rows from the top, three bytes a pixel: red, green, blue.
  std::string pixels() const;

 private:
  void discard();
  int width_ = 0, height_ = 0, samples_ = 0;
  unsigned samples_frame_ = 0, samples_colour_ = 0, samples_depth_ = 0, frame_ = 0, texture_ = 0;
};

/// A shadow map: distances from a light.
class GlDepthMap {
 public:
  explicit GlDepthMap(int size);
  ~GlDepthMap();
  GlDepthMap(const GlDepthMap&) = delete;
  GlDepthMap& operator=(const GlDepthMap&) = delete;
  void begin() const;
  /// Binds it as the texture of a shadow sampler.
  void read_as(int unit) const;

 private:
  int size_;
  unsigned frame_ = 0, texture_ = 0;
};

// Text over a picture.

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

namespace palpate::runner::display::shaders {

// The shaders of scene_renderer.cpp. Light is summed in linear colours and written as sRGB.

inline constexpr const char* kSolidVertex = R"(#version 330 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in float tint;
uniform mat4 matrix, place;
uniform vec4 cut;
out vec3 at, outward;
out float tinted;
void main() {
  tinted = tint;
  vec4 world = place * vec4(position, 1.0);
  at = world.xyz;
  outward = inverse(transpose(mat3(place))) * normal;
  gl_ClipDistance[0] = dot(cut, world);
  gl_Position = matrix * world;
})";

// A lamp with soft shadows, a hemisphere of sky and ground that is darker below objects, and a rim.
inline constexpr const char* kSolidFragment = R"(#version 330 core
in vec3 at, outward;
in float tinted;
uniform vec3 colour, eye, lamp, ground_colour;
uniform float opacity, softness, sky_softness, grain;
uniform float grid, ground_from, ground_to;  // for the ground only; grid < 0: no lines
uniform vec3 middle;
uniform bool is_ground;
uniform int taps;
uniform mat4 lamp_matrix, sky_matrix;
uniform sampler2DShadow lamp_map, sky_map;
out vec4 result;

vec3 linear(vec3 c) { return pow(c, vec3(2.2)); }

// Mean over a disc of taps that lie on a spiral (Vogel 1979).
float light(sampler2DShadow map, mat4 to_map, vec3 from, float radius, float bias, int count) {
  vec3 p = (to_map * vec4(from, 1.0)).xyz;
  if (count == 0 || any(lessThan(p, vec3(0.0))) || any(greaterThan(p, vec3(1.0)))) return 1.0;
  float sum = 0.0;
  for (int i = 0; i < count; ++i) {
    float r = radius * sqrt((float(i) + 0.5) / float(count)), a = 2.39996323 * float(i);
    sum += texture(map, vec3(p.xy + r * vec2(cos(a), sin(a)), p.z - bias));
  }
  return sum / float(count);
}

float line(float x) {
  float width = fwidth(x);
  float off = abs(fract(x - 0.5) - 0.5);
  return (1.0 - smoothstep(0.6 * width, 1.6 * width, off)) * (1.0 - smoothstep(0.15, 0.5, width));
}

void main() {
  vec3 n = normalize(outward);
  vec3 to_eye = normalize(eye - at);
  if (!gl_FrontFacing) n = -n;
  float facing = dot(n, lamp);
  float sun = facing > 0.0 ? light(lamp_map, lamp_matrix, at + grain * n, softness, 0.002, taps) : 0.0;
  float sky = light(sky_map, sky_matrix, at + 4.0 * grain * n, sky_softness, 0.012, 2 * taps);
  if (is_ground) {
    float far = length(at.xy - middle.xy);
    float dark = 1.0 - (0.62 + 0.38 * sun) * (0.66 + 0.34 * sky);
    float lines = grid > 0.0 ? 0.07 * max(line(at.x / grid), line(at.y / grid)) +
        0.09 * max(line(at.x / (5.0 * grid)), line(at.y / (5.0 * grid))) : 0.0;
    vec3 seen = ground_colour * (1.0 - dark);
    seen = mix(seen, vec3(dot(ground_colour, vec3(0.33)) > 0.4 ? 0.25 : 0.75), lines);
    result = vec4(seen, 1.0 - smoothstep(ground_from, ground_to, far));
    return;
  }
  // Deformation: from the object's colour through yellow to red.
  vec3 base = mix(mix(linear(colour), linear(vec3(0.95, 0.80, 0.35)), min(2.0 * tinted, 1.0)),
                  linear(vec3(0.80, 0.22, 0.20)), clamp(2.0 * tinted - 1.0, 0.0, 1.0));
  vec3 above = vec3(0.50, 0.53, 0.58), below = vec3(0.24, 0.22, 0.21);
  vec3 hemisphere = mix(below, above, 0.5 + 0.5 * n.z) * mix(0.72, 1.0, sky);
  float lit = max(facing, 0.0) * sun;
  float fill = 0.16 * max(dot(n, to_eye), 0.0);
  float shine = 0.10 * sun * pow(max(dot(n, normalize(lamp + to_eye)), 0.0), 40.0);
  float rim = 0.10 * pow(1.0 - max(dot(n, to_eye), 0.0), 3.0) * (0.5 + 0.5 * n.z);
  vec3 sum = base * (hemisphere + fill + vec3(0.74, 0.71, 0.66) * lit) + vec3(shine + rim);
  float veil = opacity < 1.0 ? clamp(opacity + 0.45 * pow(1.0 - abs(dot(n, to_eye)), 2.5), 0.0, 1.0) : 1.0;
  result = vec4(pow(clamp(sum, 0.0, 1.0), vec3(1.0 / 2.2)), veil);
})";

inline constexpr const char* kShadowFragment = R"(#version 330 core
in vec3 at, outward;
void main() {})";

// A triangle over the whole picture.
inline constexpr const char* kBackgroundVertex = R"(#version 330 core
out float height;
void main() {
  vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  height = 0.5 + 0.5 * corner.y;
  gl_Position = vec4(corner, 1.0, 1.0);
})";
inline constexpr const char* kBackgroundFragment = R"(#version 330 core
in float height;
uniform vec3 above, below;
out vec4 result;
void main() { result = vec4(mix(below, above, smoothstep(0.0, 1.0, height)), 1.0); })";

// Text: a rectangle in pixels with a texture of premultiplied colours.
inline constexpr const char* kTextVertex = R"(#version 330 core
uniform vec2 corner, size, picture;
out vec2 at;
void main() {
  at = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  vec2 pixel = corner + at * size;
  gl_Position = vec4(2.0 * pixel.x / picture.x - 1.0, 1.0 - 2.0 * pixel.y / picture.y, 0.0, 1.0);
})";
inline constexpr const char* kTextFragment = R"(#version 330 core
in vec2 at;
uniform sampler2D text;
out vec4 result;
void main() { result = texture(text, at); })";

}  // namespace palpate::runner::display::shaders

namespace palpate::runner::display {

struct DrawingQuality {
  int samples = 4;        ///< a pixel
  int taps = 16;          ///< a shadow
  int shadow_map = 2048;  ///< px a side
};

/// Needs a current context of OpenGL 3.3, also to be destroyed.
class SceneRenderer {
 public:
  /// \throws DisplayError naming the missing part of OpenGL
  explicit SceneRenderer(const DrawingQuality& quality = {});

  /// Quality for a window at many frames a second; lower if the CPU draws.
  static DrawingQuality live_quality();

  /// \param width, height  px \return the OpenGL texture, valid until the next draw
  /// \throws DisplayError
  unsigned draw(const ScenePicture& picture, const Camera& camera, const Theme& theme, int width,
                int height);
  /// The picture drawn last: rows from the top, three bytes a pixel (red, green, blue).
  std::string pixels() const { return canvas_.pixels(); }

 private:
  /// An opaque mesh, its place and its looks.
  struct Item {
    const GlMesh* mesh;
    glm::mat4 place;
    glm::vec3 colour;
    float through;
    bool is_sign = false;  ///< an arrow or a turn: casts no shadow
  };
  const GlMesh& uploaded(const std::shared_ptr<const DrawnMesh>& mesh);
  void forget_unused();
  std::vector<Item> tool_items(const ScenePicture& picture, const Camera& camera) const;
  void draw_shadows(const ScenePicture& picture, const std::vector<Item>& items);
  void prepare_light(const ScenePicture& picture, const Camera& camera, const Theme& theme) const;
  void draw_background(const Theme& theme) const;
  void draw_ground(const ScenePicture& picture, const Camera& camera) const;
  void draw_item(const Item& item) const;
  void draw_opaque_objects(const ScenePicture& picture) const;
  void draw_translucent_objects(const ScenePicture& picture, const Camera& camera) const;
  void draw_over_translucent(const ScenePicture& picture, const std::vector<Item>& items) const;
  void draw_hidden(const std::vector<Item>& items) const;
  void draw_texts(const ScenePicture& picture, const Camera& camera, const Theme& theme,
                  const glm::vec2& size);

  const DrawingQuality quality_;
  GlProgram solid_, shadow_, background_;
  GlMesh cylinder_, cone_, sphere_, square_;
  GlDepthMap lamp_map_, sky_map_;
  GlText text_;
  GlCanvas canvas_;
  struct Uploaded {
    std::shared_ptr<const DrawnMesh> mesh;
    std::unique_ptr<GlMesh> on_card;
    bool used = false;
  };
  std::map<const DrawnMesh*, Uploaded> meshes_;
  glm::vec3 lamp_{0, 0, 1};
  glm::mat4 lamp_view_{1}, sky_view_{1};
};

}  // namespace palpate::runner::display
