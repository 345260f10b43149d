#include "runner/display/scene_view.h"

#include <exception>

namespace palpate::runner {
namespace {

constexpr double kThickness = 1.6;  // the view is small beside the panels

}  // namespace

SceneView::SceneView() : renderer_(SceneRenderer::live_quality()) {}

std::optional<glm::vec3> SceneView::hit(const glm::vec3& from, const glm::vec3& along) const {
  if (!drawing_) return std::nullopt;
  const auto found = drawing_->hit(from, along, poses_);
  if (!found) return std::nullopt;
  return found->place;
}

unsigned SceneView::draw(const Objects& objects, const rendering::Tool& tool, const Sample& sample,
                         std::span<const rendering::BodyPose> bodies, const Camera& camera,
                         int width, int height) {
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
    // The force that was commanded, which may be less than the rendered one.
    moment.contacts.push_back({sample.rendering.deepest.point, sample.device1 + sample.device2});
  ScenePicture picture = drawing_->picture(moment, dark_theme(), {.thickness = kThickness});
  picture.caption.clear();  // the console says it beside the view
  return renderer_.draw(picture, camera, dark_theme(), width, height);
}

}  // namespace palpate::runner
