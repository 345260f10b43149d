#pragma once
// 3D view of object and stylus for the console, rendered off screen into a texture.

#include <array>
#include <glm/mat4x4.hpp>
#include <glm/vec4.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "runner/display/camera.h"
#include "runner/display/scene_mesh.h"
#include "runner/servo/sample.h"

namespace palpate::runner {

/// Needs a current OpenGL 3.3 context, also to be destroyed.
class SceneView {
 public:
  SceneView();
  SceneView(const SceneView&) = delete;
  SceneView& operator=(const SceneView&) = delete;
  ~SceneView();

  using Objects = std::shared_ptr<const std::vector<stimuli::ObjectSpec>>;
  /// \return the OpenGL texture, `width` by `height` px, valid until the next draw
  unsigned draw(const Objects& objects, const rendering::Tool& tool, const Sample& sample,
                const Camera& camera, int width, int height);
  /// The first point where a line meets, from outside, the objects drawn last.
  std::optional<glm::vec3> hit(const glm::vec3& from, const glm::vec3& along) const;
  /// Why the objects could not be drawn; empty: they were.
  const std::string& trouble() const { return trouble_; }

 private:
  struct Shape {
    unsigned vertices = 0, buffer = 0;
    int corners = 0;
  };
  static Shape upload(const DrawnMesh& mesh);
  static void discard(Shape& shape);
  void resize(int width, int height);
  void draw_shape(const Shape& shape, const glm::mat4& place, const glm::vec4& colour) const;
  void draw_rod(const Vec3& from, const Vec3& to, double radius, const glm::vec4& colour) const;
  void draw_arrow(const Vec3& from, const Vec3& force, const glm::vec4& colour) const;
  void draw_stylus(const rendering::Tool& tool, const Sample& sample) const;
  void draw_hidden_stylus(const rendering::Tool& tool, const Sample& sample) const;

  const int samples_;  ///< multisampling, per pixel
  unsigned program_ = 0;
  int matrix_at_ = 0, place_at_ = 0, colour_at_ = 0, eye_at_ = 0;
  Shape objects_, cylinder_, cone_, sphere_;
  Objects shown_;
  DrawnMesh mesh_;  ///< of these
  std::string trouble_;
  int width_ = 0, height_ = 0;
  unsigned samples_frame_ = 0, samples_colour_ = 0, samples_depth_ = 0, frame_ = 0, texture_ = 0;
};

}  // namespace palpate::runner
