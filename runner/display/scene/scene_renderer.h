#pragma once
// Draws scenes: one drawing code for windows and files. OpenGL 3.3 forward renderer with several
// samples a pixel, soft shadows of a lamp and of the sky, and a hemisphere light.

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "runner/display/scene/camera.h"
#include "runner/display/scene/drawn_mesh.h"
#include "runner/display/scene/gl_objects.h"
#include "runner/display/scene/gl_text.h"
#include "runner/display/scene/picture.h"

namespace palpate::runner::display {

struct DrawingQuality {
  int samples = 4;        ///< a pixel
  int taps = 16;          ///< a shadow
  int shadow_map = 2048;  ///< px a side
};

/// Needs a current context of OpenGL 3.3, also to be destroyed.
class SceneRenderer {
 public:
  /// \throws DisplayError naming the missing part of OpenGL
  explicit SceneRenderer(const DrawingQuality& quality = {});

  /// Quality for a window at many frames a second; lower if the CPU draws.
  static DrawingQuality live_quality();

  /// \param width, height  px \return the OpenGL texture, valid until the next draw
  /// \throws DisplayError
  unsigned draw(const ScenePicture& picture, const Camera& camera, const Theme& theme, int width,
                int height);
  /// The picture drawn last: rows from the top, three bytes a pixel (red, green, blue).
  std::string pixels() const { return canvas_.pixels(); }

 private:
  /// An opaque mesh, its place and its looks.
  struct Item {
    const GlMesh* mesh;
    glm::mat4 place;
    glm::vec3 colour;
    float through;
    bool is_sign = false;  ///< an arrow or a turn: casts no shadow
  };
  const GlMesh& uploaded(const std::shared_ptr<const DrawnMesh>& mesh);
  void forget_unused();
  std::vector<Item> tool_items(const ScenePicture& picture, const Camera& camera) const;
  void draw_shadows(const ScenePicture& picture, const std::vector<Item>& items);
  void prepare_light(const ScenePicture& picture, const Camera& camera, const Theme& theme) const;
  void draw_background(const Theme& theme) const;
  void draw_ground(const ScenePicture& picture, const Camera& camera) const;
  void draw_item(const Item& item) const;
  void draw_opaque_objects(const ScenePicture& picture) const;
  void draw_translucent_objects(const ScenePicture& picture, const Camera& camera) const;
  void draw_over_translucent(const ScenePicture& picture, const std::vector<Item>& items) const;
  void draw_hidden(const std::vector<Item>& items) const;
  void draw_texts(const ScenePicture& picture, const Camera& camera, const Theme& theme,
                  const glm::vec2& size);

  const DrawingQuality quality_;
  GlProgram solid_, shadow_, background_;
  GlMesh cylinder_, cone_, sphere_, square_;
  GlDepthMap lamp_map_, sky_map_;
  GlText text_;
  GlCanvas canvas_;
  struct Uploaded {
    std::shared_ptr<const DrawnMesh> mesh;
    std::unique_ptr<GlMesh> on_card;
    bool used = false;
  };
  std::map<const DrawnMesh*, Uploaded> meshes_;
  glm::vec3 lamp_{0, 0, 1};
  glm::mat4 lamp_view_{1}, sky_view_{1};
};

}  // namespace palpate::runner::display
