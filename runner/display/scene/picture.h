#pragma once
// The contents of a picture of a scene, as plain values. Virtual frame, z up, m; colours sRGB, 0 to
// 1.

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "runner/display/scene/drawn_mesh.h"

namespace palpate::runner::display {

/// No window can be opened or no picture drawn: not built in, no display, or an unsuitable one.
class DisplayError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct DrawnObject {
  /// The renderer caches it while it is drawn: pass the same pointer again if nothing has changed.
  std::shared_ptr<const DrawnMesh> mesh;
  glm::mat4 place{1};
  glm::vec3 colour{0.6F};
  float opacity = 1;  ///< below 1: drawn after opaque objects, the innermost first
  /// Nesting depth among the surfaces with the same object index; 0: the outermost.
  int object = 0, layer = 0;
};

struct DrawnRod {
  glm::vec3 from{0}, to{0};
  float radius = 0.001F;
  glm::vec3 colour{0.2F};
  /// Visibility inside or behind objects: 0 hidden, 1 as in front of them.
  float through = 0;
  /// Largest apparent thickness at its nearer end, as a share of the picture's height; 0: no limit.
  float thickest = 0;
};

struct DrawnBall {
  glm::vec3 centre{0};
  float radius = 0.001F;
  glm::vec3 colour{0.2F};
  float through = 0;  ///< as in DrawnRod
};

struct DrawnArrow {
  glm::vec3 from{0}, by{0};
  float radius = 0.001F;  ///< of the shaft
  glm::vec3 colour{0.2F};
};

/// A turn about an axis, as an arc with a head. Right-handed about `axis`.
struct DrawnTurn {
  glm::vec3 centre{0}, axis{0, 0, 1};
  float radius = 0.01F, thickness = 0.001F;
  float sweep = 5;  ///< rad, from the tail to the point of the head
  glm::vec3 colour{0.2F};
};

struct DrawnLabel {
  glm::vec3 at{0};
  std::string text;  ///< UTF-8
};

struct Theme {
  glm::vec3 above, below;  ///< of the background
  glm::vec3 ground;
  glm::vec3 text, halo;
  glm::vec3 ideal_tool, virtual_tool, grip;
  glm::vec3 force, torque, contact;
};
const Theme& light_theme();  ///< for files
const Theme& dark_theme();   ///< for the console

struct ScenePicture {
  std::vector<DrawnObject> objects;
  std::vector<DrawnRod> rods;
  std::vector<DrawnBall> balls;
  std::vector<DrawnArrow> arrows;
  std::vector<DrawnTurn> turns;
  std::vector<DrawnLabel> labels;
  std::vector<std::string> caption;  ///< lines in the lower left corner
  /// Shadows are drawn within `size` of `middle`; the ground fades beyond.
  glm::vec3 middle{0};
  float size = 0.1F;
  float ground = 0;  ///< height of the ground, z
  bool with_ground = true;
  float grid = 0;  ///< between the lines on the ground; 0: none
  /// Cutting plane: of objects, only the side with dot(plane, (x, y, z, 1)) > 0 is drawn.
  std::optional<glm::vec4> cut;
};

}  // namespace palpate::runner::display
