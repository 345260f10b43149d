#include "runner/display/scene_view.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <exception>
#include <glm/geometric.hpp>
#include <utility>

namespace palpate::runner::display {
namespace {

constexpr double kNotch = 0.001;         // m
constexpr double kNotchPlane = 0.004;    // m
constexpr double kFirstPress = 0.0015;   // m; about 1 N at the usual stiffness
constexpr double kPlaneDistance = 0.08;  // m, of the plane; outside the usual home zones
constexpr double kMostPress = 0.03, kFarthestPlane = 0.2;  // m
constexpr double kDepthPerPixel = 0.0004;                  // m
constexpr double kTurnPerPixel = 0.006;                    // rad

constexpr double kThickness = 1.6;  // the view is small beside the panels

}  // namespace

PointerControl::PointerControl(devices::MouseStylus& device, const WorkspaceMap& workspace)
    : device_(device),
      workspace_(workspace),
      target_(device.initial_target()),
      press_depth_(kFirstPress),
      plane_distance_(kPlaneDistance) {
  target_.tip += workspace_.centre;
  device_.set_target(target_.stylus());
}

Vec3 PointerControl::wanted(const glm::vec2& pixel, const Camera& camera,
                            const LineOfSight& object) {
  const glm::vec3 eye = camera.eye();
  const glm::vec3 along = glm::normalize(camera.unproject(pixel, glm::vec3(0)) - eye);
  const std::optional<glm::vec3> surface = object(eye, along);
  if (touches_ && !surface) press_depth_ = kFirstPress;
  touches_ = surface.has_value();
  if (surface) return Vec3(*surface) + press_depth_ * Vec3(along);
  return Vec3(
      camera.unproject(pixel, static_cast<float>(plane_distance_) * camera.towards_viewer()));
}

void PointerControl::rest_at(const rendering::LineProbe& stylus) {
  const rendering::LineProbe there = workspace_.to_device(stylus);
  target_.point(there);
  was_over_ = false;
  device_.set_target(there);
}

void PointerControl::step(const PointerMotion& pointer, const Camera& camera,
                          const LineOfSight& object) {
  if (!pointer.over) {
    was_over_ = false;
    return;
  }
  const bool entered = !was_over_;
  if (entered) pointer_offset_ = {0, 0};
  was_over_ = true;
  const auto virtual_tip = [&] { return workspace_.to_virtual(target_.stylus()).tip; };
  const auto tip = [&] { return glm::vec3(virtual_tip()); };
  const auto follow = [&] {
    const Vec3 to = wanted(pointer.at - pointer_offset_, camera, object);
    const Vec3 by = (to - virtual_tip()) / workspace_.shift_gain();
    target_.move(by);
  };
  const double notches =
      pointer.wheel - (pointer.depth ? kDepthPerPixel / kNotch * pointer.moved.y : 0);
  if (touches_) {
    press_depth_ = std::clamp(press_depth_ + kNotch * notches, 0.0, kMostPress);
  } else {
    plane_distance_ =
        std::clamp(plane_distance_ - kNotchPlane * notches, -kFarthestPlane, kFarthestPlane);
  }
  if (pointer.orbit) {
    pointer_offset_ = pointer.at - camera.project(tip());
  } else if (pointer.turn) {
    target_.turn(kTurnPerPixel * pointer.moved.x, -kTurnPerPixel * pointer.moved.y);
    pointer_offset_ = pointer.at - camera.project(tip());
  } else if (entered || notches != 0 || (!pointer.depth && pointer.moved != glm::vec2(0, 0))) {
    follow();
  }
  device_.set_target(target_.stylus());
}

SceneView::SceneView() : renderer_(SceneRenderer::live_quality()) {}

std::optional<glm::vec3> SceneView::hit(const glm::vec3& from, const glm::vec3& along) const {
  if (!drawing_) return std::nullopt;
  const auto found = drawing_->hit(from, along, poses_);
  if (!found) return std::nullopt;
  return found->place;
}

unsigned SceneView::draw(const Objects& objects, const rendering::Tool& tool,
                         const servo::Sample& sample, std::span<const rendering::BodyPose> bodies,
                         const Camera& camera, int width, int height) {
  if (objects != shown_ || !drawing_) {
    trouble_.clear();
    shown_ = objects;
    try {
      drawing_.emplace(objects != nullptr ? *objects : std::vector<stimuli::ObjectSpec>(), tool);
    } catch (const std::exception& fault) {
      trouble_ = fault.what();
      drawing_.emplace(std::vector<stimuli::ObjectSpec>(), tool);
    }
  }
  poses_.clear();
  if (objects != nullptr) poses_ = object_poses(*objects, bodies);
  SceneMoment moment{sample, {}};
  moment.poses = poses_;
  if (sample.rendering.contacts > 0)
    // Show the commanded force, which may be less than the rendered one.
    moment.contacts.push_back({sample.rendering.deepest.point, sample.device1 + sample.device2});
  ScenePicture picture = drawing_->picture(moment, dark_theme(), {.thickness = kThickness});
  picture.caption.clear();  // the console shows it beside the view
  return renderer_.draw(picture, camera, dark_theme(), width, height);
}

}  // namespace palpate::runner::display
