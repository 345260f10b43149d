#pragma once
// Pictures of a scene as it is touched: from what a tick was to what is drawn.

#include <array>
#include <cstddef>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "rendering/bodies/soft/soft_scene.h"
#include "rendering/scene.h"
#include "rendering/tool.h"
#include "runner/display/scene/camera.h"
#include "runner/display/scene/picture.h"
#include "runner/servo/sample.h"
#include "runner/servo/touched_places.h"
#include "stimuli/shapes.h"

namespace palpate::runner {

/// A label in a picture. Pixels from the upper left corner.
struct LabelBox {
  glm::vec2 centre{0, 0}, size{0, 0};
  float distance = 0;  ///< of what it names, from the viewer, m
  const std::string* text = nullptr;
  bool shown = true;
};

/// Moves labels so that they lie in the picture and on none of the others, the nearest things'
/// first. Not shown is what names things outside of the picture, and what finds no room.
void place_labels(std::vector<LabelBox>& boxes, const glm::vec2& picture);

// Where the unit cylinder, cone and sphere go to be rods, arrows and balls.

/// Takes the unit z axis from `from` to `to`, x and y to `radius`.
glm::mat4 rod_place(const glm::vec3& from, const glm::vec3& to, float radius);
/// The radius with which the rod is drawn.
float radius_seen(const DrawnRod& rod, const Camera& camera);
glm::mat4 ball_place(const glm::vec3& centre, float radius);

struct ArrowPlaces {
  glm::mat4 shaft, head;
};
/// The head ends at `to`; of a short arrow it is half.
ArrowPlaces arrow_places(const glm::vec3& from, const glm::vec3& to, float radius);

/// Points along the arc; the last three steps are its head.
std::vector<glm::vec3> points_of(const DrawnTurn& turn);

// What the stylus carries, as the console's view draws it. Virtual frame, m.

/// The segments of the tool, as one of them is drawn: in the hand or as the ideal tool.
struct DrawnTool {
  rendering::LineProbe stylus;
  std::vector<rendering::LineProbe> segments;  ///< without a tool the stylus alone
};

/// The tool in the hand: where the stylus is, with the roll of the ideal tool (they differ by its
/// lag alone).
DrawnTool tool_in_hand(const rendering::Tool& tool, const Sample& sample);

/// The ideal tool of the deepest contact; in free space where the hand is.
DrawnTool ideal_tool(const rendering::Tool& tool, const Sample& sample);

/// All places of a tick; of a scene in which something rigid moves the deepest alone, with all of
/// the force. \param state  after it
std::vector<ContactPlace> contact_places(const rendering::Scene& scene,
                                         const rendering::RenderState& state,
                                         const rendering::Rendering& rendering);

/// Of the objects after a tick. Empty where nothing moves.
std::vector<Pose> object_poses(const std::vector<stimuli::ObjectSpec>& objects,
                               const rendering::RenderState& state);

/// Where the surface of a soft object is.
struct SoftSurfaceNow {
  int object = 0;
  std::vector<glm::vec3> places;  ///< m, of the surface's nodes
};

/// Of the soft objects after a tick.
std::vector<std::shared_ptr<const SoftSurfaceNow>> soft_surfaces(
    const rendering::Scene& scene, const rendering::RenderState& state);

/// What a picture shows of one tick.
struct SceneMoment {
  Sample sample;
  std::vector<ContactPlace> contacts;
  /// The stylus in the hand, where the virtual one reaches farther.
  std::optional<rendering::LineProbe> held = std::nullopt;
  std::vector<Pose> poses =
      {};  ///< of the objects, where they have moved; empty: as the scene has it
  /// Of soft objects; those that are not there are drawn at rest.
  std::vector<std::shared_ptr<const SoftSurfaceNow>> soft = {};
};

/// Of objects of which some have moved; empty where none can.
std::vector<Pose> object_poses(const std::vector<stimuli::ObjectSpec>& objects,
                               std::span<const rendering::BodyPose> bodies);

struct SceneDrawingSettings {
  bool sides = true;             ///< the side of the stylus touches, not its tip alone
  bool labels = false;           ///< of the objects
  double thickness = 1;          ///< of the tool, times what files have
  double metres_per_newton = 0;  ///< of the arrows; 0: by the size of the scene, 6 N as long as it
  double radians_per_newton_metre = 0;  ///< of the turn that shows torque; 0: 1 N m is 8 rad
};

/// The parts of a scene that do not change from picture to picture.
class SceneDrawing {
 public:
  /// \throws MeshError, std::runtime_error where a file is no mesh
  SceneDrawing(const std::vector<stimuli::ObjectSpec>& objects, rendering::Tool tool);

  /// What only the compiled scene knows: layers (the surfaces about them become translucent), and
  /// the surfaces of soft objects, which are coloured by how far they have given way, red from a
  /// tenth of the object's size on.
  void add_compiled(const rendering::Scene& scene);

  ScenePicture picture(const SceneMoment& moment, const Theme& theme,
                       const SceneDrawingSettings& settings) const;

  /// What a camera should have in its picture: of the objects as the scene has them.
  std::vector<glm::vec3> outline() const;
  /// Of the tool and the forces at a tick: of the plain stylus what is near the objects.
  void add_outline(const SceneMoment& moment, const SceneDrawingSettings& settings,
                   std::vector<glm::vec3>& points) const;

  /// The object, and where, that a line meets first from outside.
  struct Hit {
    std::size_t object;
    glm::vec3 place;
  };
  std::optional<Hit> hit(const glm::vec3& from, const glm::vec3& along,
                         const std::vector<Pose>& poses = {}) const;

  double size() const { return size_; }  ///< m, radius about the objects
  /// How long arrows and turns are, in words: "5 N: 80 mm" and "200 mN m: 92 degrees".
  std::array<std::string, 2> scale_words(const SceneDrawingSettings& settings) const;
  const std::string& label(std::size_t object) const { return objects_[object].label; }
  std::size_t objects() const { return objects_.size(); }

 private:
  struct Object {
    std::shared_ptr<const DrawnMesh> mesh;  ///< its own frame
    Pose pose;
    glm::vec3 colour;
    std::string label;
    std::vector<std::shared_ptr<const DrawnMesh>> layers;
    glm::vec3 low{0}, high{0};  ///< m, of its box in its own frame
    float reach = 0;            ///< m, of its farthest point from its origin
    bool felt = true;
    std::shared_ptr<const rendering::SoftObject> soft = nullptr;
  };
  void add_layers(const rendering::Scene& scene);
  static std::shared_ptr<const DrawnMesh> drawn_soft(const Object& object,
                                                     const SoftSurfaceNow& now);
  void add_objects(const SceneMoment& moment, const SceneDrawingSettings& settings,
                   ScenePicture& out) const;
  void add_tool(const SceneMoment& moment, const Theme& theme, const SceneDrawingSettings& settings,
                ScenePicture& out) const;
  void add_forces(const SceneMoment& moment, const Theme& theme,
                  const SceneDrawingSettings& settings, ScenePicture& out) const;

  std::vector<Object> objects_;
  rendering::Tool tool_;
  glm::vec3 middle_{0};
  double size_ = 0.05;
  float ground_ = 0;
};

/// N m, about the middle of the stylus that the hand holds; both devices' forces, so without
/// torsion about the stylus.
Vec3 torque_on_hand(const SceneMoment& moment);

}  // namespace palpate::runner
