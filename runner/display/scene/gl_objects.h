#pragma once
// Owners of OpenGL objects, which free them. All need a current OpenGL 3.3 context, also in their
// destructors.

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <string>

#include "runner/display/scene/drawn_mesh.h"

namespace palpate::runner::display {

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

}  // namespace palpate::runner::display
