#include "runner/display/camera.h"

#include <algorithm>
#include <cmath>
#include <glm/ext/matrix_clip_space.hpp>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>

namespace palpate::runner {
namespace {

constexpr float kDistance = 0.62F;           // m, of the camera from the centre
constexpr float kFieldOfView = 0.45F;        // rad, vertical
constexpr float kNear = 0.02F, kFar = 5.0F;  // m
constexpr float kSteepestPitch = 1.5F;       // rad

}  // namespace

void Camera::resize(float width, float height) {
  width_ = std::max(width, 1.0F);
  height_ = std::max(height, 1.0F);
}

void Camera::orbit(float right, float up) {
  yaw_ = std::remainder(yaw_ + right, 2 * static_cast<float>(M_PI));
  pitch_ = std::clamp(pitch_ + up, -kSteepestPitch, kSteepestPitch);
}

glm::vec3 Camera::towards_viewer() const {
  return {std::cos(pitch_) * std::sin(yaw_), std::sin(pitch_), std::cos(pitch_) * std::cos(yaw_)};
}

glm::vec3 Camera::eye() const { return kDistance * towards_viewer(); }

glm::mat4 Camera::matrix() const {
  return glm::perspective(kFieldOfView, width_ / height_, kNear, kFar) *
         glm::lookAt(eye(), glm::vec3(0), glm::vec3(0, 1, 0));
}

glm::vec2 Camera::project(const glm::vec3& point) const {
  const glm::vec4 clip = matrix() * glm::vec4(point, 1);
  const float w = std::max(clip.w, kNear);
  return {(clip.x / w + 1) / 2 * width_, (1 - clip.y / w) / 2 * height_};
}

glm::vec3 Camera::unproject(const glm::vec2& pixel, const glm::vec3& depth_of) const {
  const glm::mat4 view = glm::lookAt(eye(), glm::vec3(0), glm::vec3(0, 1, 0));
  const float depth = std::min(-kNear, (view * glm::vec4(depth_of, 1)).z);
  const float per_pixel = -2 * depth * std::tan(kFieldOfView / 2) / height_;
  const glm::vec4 seen((pixel.x - width_ / 2) * per_pixel, (height_ / 2 - pixel.y) * per_pixel,
                       depth, 1);
  return {glm::inverse(view) * seen};
}

}  // namespace palpate::runner
