#pragma once
// 3D view of object and stylus for the console, rendered off screen into a texture.

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "runner/display/scene/scene_drawing.h"
#include "runner/display/scene/scene_renderer.h"
#include "runner/servo/sample.h"

namespace palpate::runner {

/// Needs a current OpenGL 3.3 context, also to be destroyed.
class SceneView {
 public:
  /// \throws DisplayError
  SceneView();

  using Objects = std::shared_ptr<const std::vector<stimuli::ObjectSpec>>;
  /// \return the OpenGL texture, `width` by `height` px, valid until the next draw
  /// \param bodies  where objects that move are
  unsigned draw(const Objects& objects, const rendering::Tool& tool, const Sample& sample,
                std::span<const rendering::BodyPose> bodies, const Camera& camera, int width,
                int height);
  /// The first point where a line meets, from outside, the objects drawn last, where they were.
  std::optional<glm::vec3> hit(const glm::vec3& from, const glm::vec3& along) const;
  /// Why the objects could not be drawn; empty: they were.
  const std::string& trouble() const { return trouble_; }

 private:
  SceneRenderer renderer_;
  Objects shown_;
  std::optional<SceneDrawing> drawing_;  ///< of these
  std::vector<Pose> poses_;              ///< of the objects; empty: none can move
  std::string trouble_;
};

}  // namespace palpate::runner
