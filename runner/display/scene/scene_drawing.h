#pragma once
// Pictures of a scene that is touched: converts a tick's record to elements to draw.

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

#include "rendering/bodies/soft/soft_object.h"
#include "rendering/scene.h"
#include "rendering/tool.h"
#include "runner/display/scene/camera.h"
#include "runner/display/scene/picture.h"
#include "runner/servo/sample.h"
#include "runner/servo/touched_places.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/shapes.h"

namespace palpate::runner::display {

/// A label in a picture. Pixels from the upper left corner.
struct LabelBox {
  glm::vec2 centre{0, 0}, size{0, 0};
  float distance = 0;  ///< of the named thing from the viewer, m
  const std::string* text = nullptr;
  bool shown = true;
};

/// Moves labels so that they lie in the picture and do not overlap, those of the nearest things
/// first. Hides labels of things outside the picture and labels without room.
void place_labels(std::vector<LabelBox>& boxes, const glm::vec2& picture);

/// Matrix that makes a rod of the unit cylinder; likewise a ball of the sphere, an arrow of
/// cylinder and cone. Maps the unit z axis to `from`...`to`, and scales x and y by `radius`.
glm::mat4 rod_place(const glm::vec3& from, const glm::vec3& to, float radius);
/// The radius with which the rod is drawn.
float radius_seen(const DrawnRod& rod, const Camera& camera);
glm::mat4 ball_place(const glm::vec3& centre, float radius);

struct ArrowPlaces {
  glm::mat4 shaft, head;
};
/// The head ends at `to`; in a short arrow it takes half the length.
ArrowPlaces arrow_places(const glm::vec3& from, const glm::vec3& to, float radius);

/// Points along the arc; the last three steps are its head.
std::vector<glm::vec3> points_of(const DrawnTurn& turn);

/// The tool on the stylus, as the console's view draws it: that in the hand, or the ideal tool.
/// Virtual frame, m.
struct DrawnTool {
  rendering::LineProbe stylus;
  std::vector<rendering::LineProbe> segments;  ///< without a tool: the stylus alone
};

/// The tool in the hand: at the stylus, with the roll of the ideal tool (they differ only by its
/// lag).
DrawnTool tool_in_hand(const rendering::Tool& tool, const servo::Sample& sample);

/// The ideal tool of the deepest contact; in free space that in the hand.
DrawnTool ideal_tool(const rendering::Tool& tool, const servo::Sample& sample);

/// All contact places of a tick. In a scene with a rigid moving object: the deepest only, with the
/// total force. \param state  after the tick
std::vector<servo::ContactPlace> contact_places(const rendering::Scene& scene,
                                                const rendering::RenderState& state,
                                                const rendering::Rendering& rendering);

/// Poses of the objects after a tick. Empty if none moves.
std::vector<Pose> object_poses(const std::vector<stimuli::ObjectSpec>& objects,
                               const rendering::RenderState& state);

/// The deformed surface of a soft object.
struct SoftSurfaceNow {
  int object = 0;
  std::vector<glm::vec3> places;  ///< m, of the surface's nodes
};

/// Surfaces of the soft objects after a tick.
std::vector<std::shared_ptr<const SoftSurfaceNow>> soft_surfaces(
    const rendering::Scene& scene, const rendering::RenderState& state);

/// The parts of one tick that a picture shows.
struct SceneMoment {
  servo::Sample sample;
  std::vector<servo::ContactPlace> contacts;
  /// The stylus in the hand, if the virtual one reaches farther.
  std::optional<rendering::LineProbe> held = std::nullopt;
  std::vector<Pose> poses = {};  ///< of the objects that may have moved; empty: as in the scene
  /// Surfaces of soft objects; missing ones are drawn at rest.
  std::vector<std::shared_ptr<const SoftSurfaceNow>> soft = {};
};

/// Poses of all objects, from those of the bodies that move; empty if none moves.
std::vector<Pose> object_poses(const std::vector<stimuli::ObjectSpec>& objects,
                               std::span<const rendering::BodyPose> bodies);

struct SceneDrawingSettings {
  bool sides = true;                    ///< the side of the stylus touches, not its tip alone
  bool labels = false;                  ///< name the objects
  double thickness = 1;                 ///< factor on the tool's thickness in files
  double metres_per_newton = 0;         ///< of the arrows; 0: 6 N is as long as the scene
  double radians_per_newton_metre = 0;  ///< of the arc that shows torque; 0: 1 N m is 8 rad
};

/// The parts of a scene that do not change from picture to picture.
class SceneDrawing {
 public:
  /// \throws MeshError, std::runtime_error if a file is not a mesh
  SceneDrawing(const std::vector<stimuli::ObjectSpec>& objects, rendering::Tool tool);

  /// Adds parts that only the compiled scene knows: layers (surfaces around them become
  /// translucent), and the surfaces of soft objects. These are coloured by their deformation, red
  /// from a tenth of the object's size on.
  void add_compiled(const rendering::Scene& scene);

  ScenePicture picture(const SceneMoment& moment, const Theme& theme,
                       const SceneDrawingSettings& settings) const;

  /// Points that the camera should show: of the objects at their initial poses.
  std::vector<glm::vec3> outline() const;
  /// Adds points of the tool and the forces at a tick; of the stylus only the part near the
  /// objects.
  void add_outline(const SceneMoment& moment, const SceneDrawingSettings& settings,
                   std::vector<glm::vec3>& points) const;

  /// The object that a line meets first from outside, and the place.
  struct Hit {
    std::size_t object;
    glm::vec3 place;
  };
  std::optional<Hit> hit(const glm::vec3& from, const glm::vec3& along,
                         const std::vector<Pose>& poses = {}) const;

  double size() const { return size_; }  ///< m, radius about the objects
  /// The scales of arrows and arcs, in words: "5 N: 80 mm" and "200 mN m: 92 degrees".
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

/// Torque of both devices' forces about the middle of the stylus in the hand, N m. It has no
/// component about the stylus.
Vec3 torque_on_hand(const SceneMoment& moment);

}  // namespace palpate::runner::display
