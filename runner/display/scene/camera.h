#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <span>

namespace palpate::runner::display {

/// A rectangle through which an eye sees the world, such as a screen. Virtual frame, m.
struct PictureWindow {
  glm::vec3 lower_left, lower_right, upper_left, eye;

  glm::vec3 normal() const;  ///< unit, towards the eye
  float distance() const;    ///< m, of the eye from the rectangle's plane
  /// Virtual frame to clip space: a point lies where the line from the eye to it meets the
  /// rectangle (Kooima, Generalized Perspective Projection, 2008).
  glm::mat4 matrix() const;
};

/// The camera of a picture of a scene: z is up, and initially y points away from the camera (the
/// frame of rendering/README.md). Points are in the virtual frame, m; pixels from the picture's
/// upper left corner.
class Camera {
 public:
  void resize(float width, float height);
  /// From now on the picture is what an eye sees through a window; orbit() to fit() change nothing.
  void look_through(const PictureWindow& window) { window_ = window; }
  /// \param right, up  rad
  void orbit(float right, float up);
  /// Places the camera about the centre. \param yaw  rad, about +z, 0: on -y, looking along +y with
  /// +x to the right. \param pitch  rad, up
  void look_from(float yaw, float pitch);
  /// \param closer  above 1: larger in the picture
  void zoom(float closer);
  /// Moves the centre in the picture's plane, by pixels.
  void pan(const glm::vec2& pixels);
  /// Changes centre and distance, not direction, so that all points are in the picture, with a
  /// margin.
  void fit(std::span<const glm::vec3> points);

  glm::vec3 eye() const;
  glm::vec3 centre() const { return centre_; }
  float distance() const { return distance_; }  ///< m, from the centre
  glm::mat4 matrix() const;                     ///< virtual frame to clip space
  glm::vec2 project(const glm::vec3& point) const;
  bool in_front(const glm::vec3& point) const;  ///< not behind the viewer
  /// The point seen at a pixel, at the same depth as `depth_of`.
  glm::vec3 unproject(const glm::vec2& pixel, const glm::vec3& depth_of) const;
  /// Height of the picture at the depth of a point, m.
  float height_at(const glm::vec3& depth_of) const;
  glm::vec3 towards_viewer() const;  ///< unit, from the centre to the camera

 private:
  glm::mat4 view() const;
  float near() const;
  float depth(const glm::vec3& point) const;  ///< m, at least near()

  float width_ = 1, height_ = 1;     ///< px
  float yaw_ = 0.5F, pitch_ = 0.4F;  ///< rad
  float distance_ = 0.62F;           ///< m
  glm::vec3 centre_{0, 0, 0};        ///< m
  std::optional<PictureWindow> window_;
};

}  // namespace palpate::runner::display
