#include "runner/display/scene/gl_objects.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cstddef>
#include <glm/gtc/type_ptr.hpp>
#include <string>
#include <vector>

#include "runner/display/scene/picture.h"

namespace palpate::runner::display {
namespace {

constexpr int kOldest = 33;  // OpenGL 3.3

std::string named_by_driver(GLenum what) {
  const auto* const text = reinterpret_cast<const char*>(glGetString(what));
  return text == nullptr ? "unknown" : text;
}

unsigned compiled(GLenum kind, const char* source) {
  const unsigned shader = glCreateShader(kind);
  glShaderSource(shader, 1, &source, nullptr);
  glCompileShader(shader);
  int good = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &good);
  if (good != 0) return shader;
  char why[400] = {};
  glGetShaderInfoLog(shader, sizeof why - 1, nullptr, why);
  glDeleteShader(shader);
  throw DisplayError("the graphics driver (" + named_by_driver(GL_RENDERER) +
                     ") refused a shader: " + why);
}

void expect_whole_frame() {
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE) return;
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  throw DisplayError("the graphics driver (" + named_by_driver(GL_RENDERER) +
                     ") cannot draw a picture of this size");
}

}  // namespace

void require_opengl() {
  const int version = epoxy_gl_version();
  if (version >= kOldest && epoxy_is_desktop_gl()) return;
  throw DisplayError("scenes are drawn with OpenGL 3.3; this is " + named_by_driver(GL_VERSION) +
                     " (" + named_by_driver(GL_RENDERER) + ")");
}

bool draws_in_software() {
  const std::string name = named_by_driver(GL_RENDERER);
  return std::ranges::any_of(
      std::initializer_list<const char*>{"llvmpipe", "softpipe", "Software", "unknown"},
      [&name](const char* known) { return name.find(known) != std::string::npos; });
}

void finish_target() {
  if (draws_in_software()) glFinish();
}

void check_opengl(const char* doing) {
  const GLenum error = glGetError();
  if (error == GL_NO_ERROR) return;
  while (glGetError() != GL_NO_ERROR) {  // one message is enough
  }
  throw DisplayError(std::string(doing) + ": OpenGL reports error " + std::to_string(error) + " (" +
                     named_by_driver(GL_RENDERER) + ")" +
                     (error == GL_OUT_OF_MEMORY ? ": out of memory; try a smaller picture" : ""));
}

GlMesh::GlMesh(const DrawnMesh& mesh) : corners_(static_cast<int>(mesh.size())) {
  glGenVertexArrays(1, &vertices_);
  glGenBuffers(1, &buffer_);
  glBindVertexArray(vertices_);
  glBindBuffer(GL_ARRAY_BUFFER, buffer_);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(mesh.size() * sizeof(DrawnVertex)),
               mesh.data(), GL_STATIC_DRAW);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(DrawnVertex), nullptr);
  // NOLINTNEXTLINE(performance-no-int-to-ptr): an offset, as OpenGL asks for it
  const void* const normals = reinterpret_cast<const void*>(offsetof(DrawnVertex, normal));
  glVertexAttribPointer(1, 3, GL_FLOAT, GL_FALSE, sizeof(DrawnVertex), normals);
  // NOLINTNEXTLINE(performance-no-int-to-ptr): likewise
  const void* const tints = reinterpret_cast<const void*>(offsetof(DrawnVertex, tint));
  glVertexAttribPointer(2, 1, GL_FLOAT, GL_FALSE, sizeof(DrawnVertex), tints);
  for (const GLuint attribute : {0U, 1U, 2U}) glEnableVertexAttribArray(attribute);
  glBindVertexArray(0);
}

GlMesh::~GlMesh() {
  glDeleteVertexArrays(1, &vertices_);
  glDeleteBuffers(1, &buffer_);
}

void GlMesh::draw() const {
  glBindVertexArray(vertices_);
  glDrawArrays(GL_TRIANGLES, 0, corners_);
}

GlProgram::GlProgram(const char* vertex_shader, const char* fragment_shader) {
  const unsigned vertex = compiled(GL_VERTEX_SHADER, vertex_shader);
  const unsigned fragment = compiled(GL_FRAGMENT_SHADER, fragment_shader);
  program_ = glCreateProgram();
  glAttachShader(program_, vertex);
  glAttachShader(program_, fragment);
  glLinkProgram(program_);
  glDeleteShader(vertex);
  glDeleteShader(fragment);
  int good = 0;
  glGetProgramiv(program_, GL_LINK_STATUS, &good);
  if (good != 0) return;
  glDeleteProgram(program_);
  throw DisplayError("the graphics driver (" + named_by_driver(GL_RENDERER) +
                     ") could not link a shader");
}

GlProgram::~GlProgram() { glDeleteProgram(program_); }

void GlProgram::use() const { glUseProgram(program_); }

int GlProgram::place_of(const char* name) const { return glGetUniformLocation(program_, name); }

void GlProgram::set(const char* name, float value) const { glUniform1f(place_of(name), value); }
void GlProgram::set(const char* name, int value) const { glUniform1i(place_of(name), value); }
void GlProgram::set(const char* name, const glm::vec2& value) const {
  glUniform2fv(place_of(name), 1, glm::value_ptr(value));
}
void GlProgram::set(const char* name, const glm::vec3& value) const {
  glUniform3fv(place_of(name), 1, glm::value_ptr(value));
}
void GlProgram::set(const char* name, const glm::vec4& value) const {
  glUniform4fv(place_of(name), 1, glm::value_ptr(value));
}
void GlProgram::set(const char* name, const glm::mat4& value) const {
  glUniformMatrix4fv(place_of(name), 1, GL_FALSE, glm::value_ptr(value));
}

GlCanvas::~GlCanvas() { discard(); }

void GlCanvas::discard() {
  if (width_ == 0) return;
  for (const unsigned* frame : {&samples_frame_, &frame_}) glDeleteFramebuffers(1, frame);
  for (const unsigned* part : {&samples_colour_, &samples_depth_}) glDeleteRenderbuffers(1, part);
  glDeleteTextures(1, &texture_);
  width_ = 0;
}

void GlCanvas::begin(int width, int height, int samples) {
  if (width == width_ && height == height_ && samples == samples_) {
    glBindFramebuffer(GL_FRAMEBUFFER, samples_frame_);
    glViewport(0, 0, width_, height_);
    return;
  }
  discard();
  int largest = 0, most = 0;
  glGetIntegerv(GL_MAX_RENDERBUFFER_SIZE, &largest);
  glGetIntegerv(GL_MAX_SAMPLES, &most);
  if (width > largest || height > largest)
    throw DisplayError("the graphics driver draws pictures of at most " + std::to_string(largest) +
                       " px a side");
  width_ = width;
  height_ = height;
  samples_ = samples;
  glGenFramebuffers(1, &samples_frame_);
  glGenRenderbuffers(1, &samples_colour_);
  glGenRenderbuffers(1, &samples_depth_);
  glGenTextures(1, &texture_);
  glGenFramebuffers(1, &frame_);
  const auto storage = [&](unsigned part, GLenum format, GLenum place) {
    glBindRenderbuffer(GL_RENDERBUFFER, part);
    glRenderbufferStorageMultisample(GL_RENDERBUFFER, std::min(samples, most), format, width,
                                     height);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, place, GL_RENDERBUFFER, part);
  };
  glBindTexture(GL_TEXTURE_2D, texture_);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  glBindFramebuffer(GL_FRAMEBUFFER, frame_);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture_, 0);
  expect_whole_frame();
  glBindFramebuffer(GL_FRAMEBUFFER, samples_frame_);
  storage(samples_colour_, GL_RGBA8, GL_COLOR_ATTACHMENT0);
  storage(samples_depth_, GL_DEPTH_COMPONENT24, GL_DEPTH_ATTACHMENT);
  expect_whole_frame();
  glViewport(0, 0, width_, height_);
}

void GlCanvas::end() const {
  finish_target();
  glBindFramebuffer(GL_READ_FRAMEBUFFER, samples_frame_);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, frame_);
  glBlitFramebuffer(0, 0, width_, height_, 0, 0, width_, height_, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  finish_target();
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
}

std::string GlCanvas::pixels() const {
  const auto row = static_cast<std::size_t>(width_) * 3;
  std::string from_below(row * static_cast<std::size_t>(height_), '\0'),
      out(from_below.size(), '\0');
  glBindFramebuffer(GL_READ_FRAMEBUFFER, frame_);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width_, height_, GL_RGB, GL_UNSIGNED_BYTE, from_below.data());
  glBindFramebuffer(GL_READ_FRAMEBUFFER, 0);
  for (std::size_t y = 0; y < static_cast<std::size_t>(height_); ++y)
    std::memcpy(&out[y * row], &from_below[(static_cast<std::size_t>(height_) - 1 - y) * row], row);
  return out;
}

GlDepthMap::GlDepthMap(int size) : size_(size) {
  glGenTextures(1, &texture_);
  glBindTexture(GL_TEXTURE_2D, texture_);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT24, size, size, 0, GL_DEPTH_COMPONENT, GL_FLOAT,
               nullptr);
  const auto set = [](GLenum name, GLint value) { glTexParameteri(GL_TEXTURE_2D, name, value); };
  set(GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  set(GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  set(GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
  set(GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
  set(GL_TEXTURE_WRAP_S, GL_CLAMP_TO_BORDER);
  set(GL_TEXTURE_WRAP_T, GL_CLAMP_TO_BORDER);
  const glm::vec4 lit(1);
  glTexParameterfv(GL_TEXTURE_2D, GL_TEXTURE_BORDER_COLOR, glm::value_ptr(lit));
  glGenFramebuffers(1, &frame_);
  glBindFramebuffer(GL_FRAMEBUFFER, frame_);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, texture_, 0);
  glDrawBuffer(GL_NONE);
  glReadBuffer(GL_NONE);
  expect_whole_frame();
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
}

GlDepthMap::~GlDepthMap() {
  glDeleteFramebuffers(1, &frame_);
  glDeleteTextures(1, &texture_);
}

void GlDepthMap::begin() const {
  glBindFramebuffer(GL_FRAMEBUFFER, frame_);
  glViewport(0, 0, size_, size_);
  glClear(GL_DEPTH_BUFFER_BIT);
}

void GlDepthMap::read_as(int unit) const {
  glActiveTexture(GL_TEXTURE0 + static_cast<unsigned>(unit));
  glBindTexture(GL_TEXTURE_2D, texture_);
  glActiveTexture(GL_TEXTURE0);
}

}  // namespace palpate::runner::display
