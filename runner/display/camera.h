#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

namespace palpate::runner {

/// The camera of the console's 3D view. Points in the virtual frame, m; pixels from the view's
/// upper left corner.
class Camera {
 public:
  void resize(float width, float height);
  /// \param right, up  rad
  void orbit(float right, float up);

  glm::vec3 eye() const;
  glm::mat4 matrix() const;  ///< virtual frame to clip space
  glm::vec2 project(const glm::vec3& point) const;
  /// The point seen at a pixel, at the same depth as `depth_of`.
  glm::vec3 unproject(const glm::vec2& pixel, const glm::vec3& depth_of) const;
  glm::vec3 towards_viewer() const;  ///< unit, from the centre to the camera

 private:
  float width_ = 1, height_ = 1;     ///< px
  float yaw_ = 0.5F, pitch_ = 0.4F;  ///< rad
};

}  // namespace palpate::runner
