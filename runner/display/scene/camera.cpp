#include "runner/display/scene/camera.h"

#include <algorithm>
#include <cmath>
#include <glm/ext/matrix_clip_space.hpp>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>
#include <limits>

namespace palpate::runner::display {
namespace {

constexpr float kFieldOfView = 0.45F;                 // rad, vertical
constexpr float kNear = 0.03F, kFar = 40;             // in distances of the camera
constexpr float kSteepestPitch = 1.5F;                // rad
constexpr float kNearest = 1e-4F, kFarthest = 1e5F;   // m, of the camera from the centre
constexpr float kNearWindow = 0.1F, kFarWindow = 50;  // in distances of the eye
constexpr float kMargin = 1.12F;  // share by which a picture exceeds the fitted points

}  // namespace

glm::vec3 PictureWindow::normal() const {
  return glm::normalize(glm::cross(lower_right - lower_left, upper_left - lower_left));
}

float PictureWindow::distance() const { return glm::dot(eye - lower_left, normal()); }

glm::mat4 PictureWindow::matrix() const {
  const glm::vec3 across = lower_right - lower_left, up = upper_left - lower_left;
  const glm::vec3 x = glm::normalize(across), y = glm::normalize(up), z = normal();
  const glm::vec3 corner = lower_left - eye;
  const float away = distance(), near = kNearWindow * away, share = near / away;
  const float left = glm::dot(x, corner) * share, below = glm::dot(y, corner) * share;
  const glm::mat4 turn = glm::transpose(
      glm::mat4(glm::vec4(x, 0), glm::vec4(y, 0), glm::vec4(z, 0), glm::vec4(0, 0, 0, 1)));
  return glm::frustum(left, left + glm::length(across) * share, below,
                      below + glm::length(up) * share, near, kFarWindow * away) *
         turn * glm::translate(glm::mat4(1), -eye);
}

void Camera::resize(float width, float height) {
  width_ = std::max(width, 1.0F);
  height_ = std::max(height, 1.0F);
}

void Camera::orbit(float right, float up) { look_from(yaw_ + right, pitch_ + up); }

void Camera::look_from(float yaw, float pitch) {
  yaw_ = std::remainder(yaw, 2 * static_cast<float>(M_PI));
  pitch_ = std::clamp(pitch, -kSteepestPitch, kSteepestPitch);
}

void Camera::zoom(float closer) { distance_ = std::clamp(distance_ / closer, kNearest, kFarthest); }

void Camera::pan(const glm::vec2& pixels) {
  centre_ += unproject({width_ / 2 - pixels.x, height_ / 2 - pixels.y}, centre_) - centre_;
}

void Camera::fit(std::span<const glm::vec3> points) {
  if (points.empty()) return;
  const glm::mat3 to_view(view());
  const float up = std::tan(kFieldOfView / 2) / kMargin, right = up * width_ / height_;
  // A point (x, y, z) of the view is in the picture if |x - cx| <= right (d - z). So only the
  // extremes of x + right z and x - right z matter.
  constexpr float kMost = std::numeric_limits<float>::max();
  float left_of = kMost, right_of = -kMost, below = kMost, above = -kMost, deepest = kMost,
        nearest = -kMost;
  for (const glm::vec3& point : points) {
    const glm::vec3 p = to_view * point;
    right_of = std::max(right_of, p.x + right * p.z);
    left_of = std::min(left_of, p.x - right * p.z);
    above = std::max(above, p.y + up * p.z);
    below = std::min(below, p.y - up * p.z);
    deepest = std::min(deepest, p.z);
    nearest = std::max(nearest, p.z);
  }
  const float middle = (deepest + nearest) / 2;
  const float far_enough =
      std::max((right_of - left_of) / (2 * right), (above - below) / (2 * up)) - middle;
  centre_ =
      glm::transpose(to_view) * glm::vec3((right_of + left_of) / 2, (above + below) / 2, middle);
  distance_ =
      std::clamp(std::max(far_enough, (nearest - deepest) / 2 + kNearest), kNearest, kFarthest);
}

glm::vec3 Camera::towards_viewer() const {
  if (window_) return window_->normal();
  return {std::cos(pitch_) * std::sin(yaw_), -std::cos(pitch_) * std::cos(yaw_), std::sin(pitch_)};
}

glm::vec3 Camera::eye() const {
  if (window_) return window_->eye;
  return centre_ + distance_ * towards_viewer();
}

glm::mat4 Camera::view() const { return glm::lookAt(eye(), centre_, glm::vec3(0, 0, 1)); }

float Camera::near() const {
  return window_ ? kNearWindow * window_->distance() : kNear * distance_;
}

glm::mat4 Camera::matrix() const {
  if (window_) return window_->matrix();
  return glm::perspective(kFieldOfView, width_ / height_, near(), kFar * distance_) * view();
}

glm::vec2 Camera::project(const glm::vec3& point) const {
  const glm::vec4 clip = matrix() * glm::vec4(point, 1);
  const float w = std::max(clip.w, near());
  return {(clip.x / w + 1) / 2 * width_, (1 - clip.y / w) / 2 * height_};
}

bool Camera::in_front(const glm::vec3& point) const { return depth(point) > near(); }

float Camera::depth(const glm::vec3& point) const {
  if (window_) return std::max(near(), glm::dot(window_->eye - point, window_->normal()));
  return std::max(near(), -(view() * glm::vec4(point, 1)).z);
}

float Camera::height_at(const glm::vec3& depth_of) const {
  if (window_)
    return glm::length(window_->upper_left - window_->lower_left) * depth(depth_of) /
           window_->distance();
  return 2 * depth(depth_of) * std::tan(kFieldOfView / 2);
}

glm::vec3 Camera::unproject(const glm::vec2& pixel, const glm::vec3& depth_of) const {
  const float per_pixel = height_at(depth_of) / height_;
  const glm::vec4 seen((pixel.x - width_ / 2) * per_pixel, (height_ / 2 - pixel.y) * per_pixel,
                       -depth(depth_of), 1);
  return {glm::inverse(view()) * seen};
}

}  // namespace palpate::runner::display
