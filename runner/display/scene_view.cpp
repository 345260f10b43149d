#include "runner/display/scene_view.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>

#include "runner/display/tool_shape.h"
#include "runner/display/window.h"

namespace palpate::runner {
namespace {

constexpr int kSamples = 4;  // multisampling; too slow without a graphics card
constexpr glm::vec4 kGround{0.098F, 0.114F, 0.133F, 1};
constexpr glm::vec4 kObject{0.60F, 0.68F, 0.76F, 1};
constexpr glm::vec4 kStylus{0.93F, 0.91F, 0.87F, 1};
constexpr glm::vec4 kVirtual{0.95F, 0.55F, 0.25F, 1};
constexpr glm::vec4 kForce{0.97F, 0.78F, 0.26F, 1};
constexpr glm::vec4 kContact{0.95F, 0.35F, 0.30F, 1};
constexpr glm::vec4 kGrid{0.20F, 0.23F, 0.26F, 1};

constexpr double kThin = 0.0018;       // m, radius of the stylus
constexpr double kGridEdge = 0.15;     // m, from the centre
constexpr double kGridHeight = -0.08;  // m
constexpr double kMetresPerNewton = 0.012;
constexpr double kLongestArrow = 0.15;  // m

constexpr const char* kVertexShader = R"(#version 330 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
uniform mat4 matrix, place;
out vec3 at, outward;
void main() {
  vec4 world = place * vec4(position, 1.0);
  at = world.xyz;
  outward = inverse(transpose(mat3(place))) * normal;
  gl_Position = matrix * world;
})";
// Hemisphere light from above, a lamp above the viewer's left shoulder with a highlight.
constexpr const char* kFragmentShader = R"(#version 330 core
in vec3 at, outward;
uniform vec4 colour;
uniform vec3 eye;
out vec4 result;
void main() {
  vec3 n = normalize(outward);
  vec3 to_eye = normalize(eye - at);
  vec3 lamp = normalize(to_eye + vec3(-0.5, 0.9, 0.2));
  float sky = 0.38 + 0.14 * n.y;
  float lit = 0.56 * max(dot(n, lamp), 0.0);
  float shine = 0.16 * pow(max(dot(n, normalize(lamp + to_eye)), 0.0), 30.0);
  result = vec4(colour.rgb * (sky + lit) + vec3(shine), colour.a);
})";

unsigned compile(GLenum kind, const char* source) {
  const unsigned shader = glCreateShader(kind);
  glShaderSource(shader, 1, &source, nullptr);
  glCompileShader(shader);
  int good = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &good);
  if (good == 0) throw DisplayError("the graphics driver refused a shader of the console");
  return shader;
}

bool draws_in_software() {
  const auto* const name = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
  return name == nullptr || std::strstr(name, "llvmpipe") != nullptr ||
         std::strstr(name, "softpipe") != nullptr || std::strstr(name, "Software") != nullptr;
}

bool finite(const Vec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

}  // namespace

SceneView::SceneView() : samples_(draws_in_software() ? 0 : kSamples) {
  const unsigned vertex = compile(GL_VERTEX_SHADER, kVertexShader);
  const unsigned fragment = compile(GL_FRAGMENT_SHADER, kFragmentShader);
  program_ = glCreateProgram();
  glAttachShader(program_, vertex);
  glAttachShader(program_, fragment);
  glLinkProgram(program_);
  glDeleteShader(vertex);
  glDeleteShader(fragment);
  matrix_at_ = glGetUniformLocation(program_, "matrix");
  place_at_ = glGetUniformLocation(program_, "place");
  colour_at_ = glGetUniformLocation(program_, "colour");
  eye_at_ = glGetUniformLocation(program_, "eye");
  cylinder_ = upload(unit_cylinder());
  cone_ = upload(unit_cone());
  sphere_ = upload(unit_sphere());
}

SceneView::~SceneView() {
  for (Shape* const shape : {&objects_, &cylinder_, &cone_, &sphere_}) discard(*shape);
  resize(0, 0);
  glDeleteProgram(program_);
}

SceneView::Shape SceneView::upload(const DrawnMesh& mesh) {
  Shape shape;
  shape.corners = static_cast<int>(mesh.size());
  glGenVertexArrays(1, &shape.vertices);
  glGenBuffers(1, &shape.buffer);
  glBindVertexArray(shape.vertices);
  glBindBuffer(GL_ARRAY_BUFFER, shape.buffer);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(mesh.size() * sizeof(DrawnVertex)),
               mesh.data(), GL_STATIC_DRAW);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(DrawnVertex), nullptr);
  // NOLINTNEXTLINE(performance-no-int-to-ptr): an offset, as OpenGL asks for it
  const void* const normals = reinterpret_cast<const void*>(offsetof(DrawnVertex, normal));
  glVertexAttribPointer(1, 3, GL_FLOAT, GL_FALSE, sizeof(DrawnVertex), normals);
  glEnableVertexAttribArray(0);
  glEnableVertexAttribArray(1);
  glBindVertexArray(0);
  return shape;
}

void SceneView::discard(Shape& shape) {
  glDeleteVertexArrays(1, &shape.vertices);
  glDeleteBuffers(1, &shape.buffer);
  shape = {};
}

void SceneView::resize(int width, int height) {
  if (width == width_ && height == height_) return;
  if (width_ > 0) {
    for (const unsigned* frame : {&samples_frame_, &frame_}) glDeleteFramebuffers(1, frame);
    for (const unsigned* part : {&samples_colour_, &samples_depth_}) glDeleteRenderbuffers(1, part);
    glDeleteTextures(1, &texture_);
  }
  width_ = width;
  height_ = height;
  if (width <= 0) return;
  glGenFramebuffers(1, &samples_frame_);
  glBindFramebuffer(GL_FRAMEBUFFER, samples_frame_);
  glGenRenderbuffers(1, &samples_colour_);
  glBindRenderbuffer(GL_RENDERBUFFER, samples_colour_);
  glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples_, GL_RGBA8, width, height);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, samples_colour_);
  glGenRenderbuffers(1, &samples_depth_);
  glBindRenderbuffer(GL_RENDERBUFFER, samples_depth_);
  glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples_, GL_DEPTH_COMPONENT24, width, height);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, samples_depth_);
  glGenTextures(1, &texture_);
  glBindTexture(GL_TEXTURE_2D, texture_);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  glGenFramebuffers(1, &frame_);
  glBindFramebuffer(GL_FRAMEBUFFER, frame_);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture_, 0);
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
}

void SceneView::draw_shape(const Shape& shape, const glm::mat4& place,
                           const glm::vec4& colour) const {
  glUniformMatrix4fv(place_at_, 1, GL_FALSE, glm::value_ptr(place));
  glUniform4fv(colour_at_, 1, glm::value_ptr(colour));
  glBindVertexArray(shape.vertices);
  glDrawArrays(GL_TRIANGLES, 0, shape.corners);
}

/// Takes the unit z axis from `from` to `to`, x and y to `radius`.
static glm::mat4 along(const Vec3& from, const Vec3& to, double radius) {
  const Vec3 axis = to - from;
  const double length = std::max(glm::length(axis), 1e-9);
  const Vec3 z = axis / length;
  const Vec3 aside = std::abs(z.x) < 0.7 ? Vec3(1, 0, 0) : Vec3(0, 1, 0);
  const Vec3 x = glm::normalize(glm::cross(aside, z)), y = glm::cross(z, x);
  return {glm::vec4(glm::vec3(radius * x), 0), glm::vec4(glm::vec3(radius * y), 0),
          glm::vec4(glm::vec3(axis), 0), glm::vec4(glm::vec3(from), 1)};
}

void SceneView::draw_rod(const Vec3& from, const Vec3& to, double radius,
                         const glm::vec4& colour) const {
  draw_shape(cylinder_, along(from, to, radius), colour);
}

void SceneView::draw_arrow(const Vec3& from, const Vec3& force, const glm::vec4& colour) const {
  const double size = glm::length(force);
  if (!finite(force) || size < 0.01) return;
  const double length = std::min(kMetresPerNewton * size, kLongestArrow);
  const Vec3 direction = force / size;
  const double head = std::min(0.012, 0.5 * length);
  const Vec3 neck = from + (length - head) * direction;
  draw_rod(from, neck, 0.0011, colour);
  draw_shape(cone_, along(neck, from + length * direction, 0.3 * head), colour);
}

void SceneView::draw_stylus(const rendering::Tool& tool, const Sample& sample) const {
  const rendering::LineProbe& hand = sample.probe;
  if (!finite(hand.tip) || !finite(hand.tail)) return;
  const bool touching = sample.rendering.contacts > 0 && finite(sample.rendering.ideal.tip) &&
                        finite(sample.rendering.ideal.tail);
  // In contact the ideal tool lies on the surface and the virtual one inside: draw both.
  const DrawnTool in_hand = tool_in_hand(tool, sample);
  const DrawnTool seen = touching ? ideal_tool(tool, sample) : in_hand;
  const auto ball = [&](const Vec3& at, double radius, const glm::vec4& colour) {
    draw_shape(sphere_,
               glm::scale(glm::translate(glm::mat4(1), glm::vec3(at)),
                          glm::vec3(static_cast<float>(radius))),
               colour);
  };
  for (const rendering::LineProbe& segment : seen.segments) {
    draw_rod(segment.tip, segment.tail, kThin, kStylus);
    ball(segment.tip, 1.6 * kThin, kStylus);
    ball(segment.tail, 1.6 * kThin, kStylus);
  }
  // What is held but does not touch.
  if (!tool.segments.empty()) draw_rod(seen.stylus.tip, seen.stylus.tail, 0.4 * kThin, kStylus);
  if (touching) {
    for (const rendering::LineProbe& segment : in_hand.segments)
      draw_rod(segment.tip, segment.tail, 0.4 * kThin, kVirtual);
    if (finite(sample.rendering.deepest.point)) {
      ball(sample.rendering.deepest.point, 2.2 * kThin, kContact);
    }
  }
  draw_arrow(seen.stylus.tip, sample.device1, kForce);
  draw_arrow(seen.stylus.tail, sample.device2, kForce);
}

/// The part of the stylus inside or behind the object, translucent: the experimenter must see where
/// the tip is.
void SceneView::draw_hidden_stylus(const rendering::Tool& tool, const Sample& sample) const {
  glDepthFunc(GL_GREATER);
  glDepthMask(GL_FALSE);
  glEnable(GL_BLEND);
  glBlendColor(0, 0, 0, 0.45F);
  glBlendFunc(GL_CONSTANT_ALPHA, GL_ONE_MINUS_CONSTANT_ALPHA);
  draw_stylus(tool, sample);
  glDisable(GL_BLEND);
  glDepthMask(GL_TRUE);
  glDepthFunc(GL_LESS);
}

// Moeller & Trumbore 1997, front faces only.
std::optional<glm::vec3> SceneView::hit(const glm::vec3& from, const glm::vec3& along) const {
  std::optional<float> nearest;
  for (std::size_t i = 0; i + 2 < mesh_.size(); i += 3) {
    const glm::vec3 corner = mesh_[i].position;
    const glm::vec3 a = mesh_[i + 1].position - corner, b = mesh_[i + 2].position - corner;
    const glm::vec3 p = glm::cross(along, b);
    const float size = glm::dot(a, p);
    if (!(size > 0)) continue;
    const glm::vec3 off = from - corner, q = glm::cross(off, a);
    const float u = glm::dot(off, p), v = glm::dot(along, q), t = glm::dot(b, q) / size;
    if (u < 0 || v < 0 || u + v > size || t <= 0) continue;
    if (!nearest || t < *nearest) nearest = t;
  }
  if (!nearest) return std::nullopt;
  return from + *nearest * along;
}

unsigned SceneView::draw(const Objects& objects, const rendering::Tool& tool, const Sample& sample,
                         const Camera& camera, int width, int height) {
  resize(std::max(width, 1), std::max(height, 1));
  if (objects != shown_) {
    discard(objects_);
    trouble_.clear();
    shown_ = objects;
    mesh_.clear();
    try {
      if (objects != nullptr) mesh_ = triangles_of(*objects);
      if (!mesh_.empty()) objects_ = upload(mesh_);
    } catch (const std::exception& fault) {
      trouble_ = fault.what();
    }
  }
  glBindFramebuffer(GL_FRAMEBUFFER, samples_frame_);
  glViewport(0, 0, width_, height_);
  glDisable(GL_SCISSOR_TEST);
  glDisable(GL_BLEND);
  glEnable(GL_DEPTH_TEST);
  glClearColor(kGround.r, kGround.g, kGround.b, 1);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  glUseProgram(program_);
  glUniformMatrix4fv(matrix_at_, 1, GL_FALSE, glm::value_ptr(camera.matrix()));
  glUniform3fv(eye_at_, 1, glm::value_ptr(camera.eye()));
  for (int i = -3; i <= 3; ++i) {
    const double at = kGridEdge * i / 3;
    draw_rod({at, kGridHeight, -kGridEdge}, {at, kGridHeight, kGridEdge}, 0.0004, kGrid);
    draw_rod({-kGridEdge, kGridHeight, at}, {kGridEdge, kGridHeight, at}, 0.0004, kGrid);
  }
  if (objects_.corners > 0) {
    draw_shape(objects_, glm::mat4(1), kObject);
    draw_hidden_stylus(tool, sample);
  }
  draw_stylus(tool, sample);
  glBindVertexArray(0);
  glUseProgram(0);
  glDisable(GL_DEPTH_TEST);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, samples_frame_);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, frame_);
  glBlitFramebuffer(0, 0, width_, height_, 0, 0, width_, height_, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  return texture_;
}

}  // namespace palpate::runner
