#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

namespace palpate::runner {

/// From where the console looks at the workspace. Points in the virtual frame, m; pixels of the
/// view from its upper left corner.
class Camera {
 public:
  void resize(float width, float height);
  /// \param right, up  rad
  void orbit(float right, float up);

  glm::vec3 eye() const;
  glm::mat4 matrix() const;  ///< virtual frame to clip space
  glm::vec2 pixel(const glm::vec3& point) const;
  /// The point under the pixel that is as far into the picture as `depth_of`.
  glm::vec3 under(const glm::vec2& pixel, const glm::vec3& depth_of) const;
  glm::vec3 towards_viewer() const;  ///< unit, against the line of sight

 private:
  float width_ = 1, height_ = 1;     ///< px
  float yaw_ = 0.5F, pitch_ = 0.4F;  ///< rad
};

}  // namespace palpate::runner
