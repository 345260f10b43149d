#pragma once
// Builds the renderers' scenes from the objects of a protocol or scene file.

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "protocols/protocol.h"
#include "protocols/scene_spec.h"
#include "protocols/schedule.h"
#include "rendering/bodies/moving_scene.h"
#include "rendering/bodies/soft/soft_object.h"
#include "rendering/renderer.h"
#include "rendering/scene.h"
#include "rendering/tool.h"
#include "runner/layer_surfaces.h"
#include "runner/sharp_edges.h"
#include "runner/workspace_map.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/shapes.h"

namespace palpate::runner {

const rendering::Renderer& renderer_for(protocols::RendererKind kind);

/// The fields and knocks of objects.
std::vector<rendering::ObjectEffects> effects_of(const std::vector<stimuli::ObjectSpec>& objects);

rendering::Tool tool_of(const protocols::ToolSpec& spec);
/// \param length  m, of the real stylus. \param grip  m from its tip; beyond the tail: the tail
rendering::Reach reach_of(const protocols::ReachSpec& spec, double length, double grip);
WorkspaceMap workspace_of(const protocols::Protocol& protocol);
/// m, virtual frame: how far along the stylus the hand is from the virtual tip.
double grip_from_virtual_tip(const protocols::Protocol& protocol);

/// A mesh file as it was read.
struct LoadedMesh {
  Vec3 size = Vec3(0);  ///< m, of its box
  std::size_t faces = 0;
  bool has_groups = false;
  /// If it is made of convex groups that abut without gaps and steps.
  std::vector<std::shared_ptr<const stimuli::ConvexMesh>> parts;
  std::shared_ptr<const stimuli::ClosedSurface> surface;  ///< else
  std::vector<std::string> notes;                         ///< what was cleaned to get the surface
};

/// Builds a scene of objects: of the convex parts of their surfaces and layers, or of closed
/// surfaces where those are not convex; equal shapes share one mesh and its search trees. A mesh
/// file is read once, however many scenes are built.
class SceneBuilder {
 public:
  static constexpr double kSceneGrip = 0.06;  ///< m, of scenes, which do not say where the hand is
  /// Reads a mesh file, other than of tetrahedra, if that has not been done.
  /// \throws MeshError, std::runtime_error for an unreadable file
  const LoadedMesh& mesh(const stimuli::ObjectSpec& spec);
  /// Null: it is smooth. In the object's frame. \throws MeshError: its steepest slope exceeds 2, or
  /// it is deeper than the object is thick
  std::shared_ptr<const stimuli::Texture> texture_of(const stimuli::ObjectSpec& spec);
  /// \throws MeshError with the place as a JSON pointer: a layer is empty, or a moving object
  /// exceeds a limit. \param gravity m/s^2, on what moves or gives \param soft_radius  m, of the
  /// tool where it touches what gives \param grip  m, from the virtual tip: where fields at the
  /// grip act
  rendering::Scene build(const std::vector<stimuli::ObjectSpec>& objects, bool side_contact,
                         const rendering::Tool& tool = {}, const Vec3& gravity = Vec3(0),
                         double soft_radius = protocols::kSoftRadius, double grip = kSceneGrip);
  /// How exact the layers of an object are in the scene built last; empty: exact.
  std::vector<std::string> layer_notes(int object) const;
  /// The indices of all objects, in sets that one ideal tool feels: fixed objects that touch or
  /// cross each other, and each other object alone.
  std::vector<std::vector<int>> solids_of(const std::vector<stimuli::ObjectSpec>& objects);
  /// Those of the objects that move. \throws MeshError
  std::vector<rendering::MovingObject> moving_of(const std::vector<stimuli::ObjectSpec>& objects);

 private:
  struct Prepared {
    std::shared_ptr<const stimuli::ConvexMesh> mesh;
    std::shared_ptr<const rendering::ContactTrees> trees;
  };
  /// A shape where it stands in its object.
  struct PlacedShape {
    const stimuli::ObjectSpec* spec;
    Pose pose;
    int object;
  };
  using Meshes = std::vector<std::shared_ptr<const stimuli::ConvexMesh>>;
  static std::vector<Prepared> with_trees(const Meshes& meshes, bool side_contact);
  Meshes surface_of(const stimuli::ObjectSpec& spec, bool side_contact);
  /// In the object's frame.
  Meshes surfaces_of(const std::vector<PlacedShape>& shapes, bool side_contact);
  /// Its convex parts. \param depth  m, by which its surface is moved inwards: empty where nothing
  /// is left
  const std::vector<Prepared>& prepare(const stimuli::ObjectSpec& spec, double depth,
                                       bool side_contact);
  struct Placing;
  void place(const stimuli::ObjectSpec& spec, const Pose& parent, int object, Placing& placing);
  struct Placed {
    std::vector<rendering::SceneObject> parts;
    std::vector<rendering::SceneSurface> surfaces;
    std::vector<rendering::SceneSurface> solids;  ///< whole ones, for collisions
  };
  /// \param solid  indices of one object, or of all those that touch each other
  Placed placed(const std::vector<stimuli::ObjectSpec>& objects, const std::vector<int>& solid,
                bool side_contact);
  void place_parts(const std::vector<stimuli::ObjectSpec>& objects, const std::vector<int>& solid,
                   Placing& placing, Placed& out);
  void add_corners(const stimuli::ObjectSpec& spec, const Pose& parent, std::vector<Vec3>& corners);
  /// Whether the object is felt as one closed surface, not as convex parts.
  bool is_surface(const stimuli::ObjectSpec& spec);
  bool has_concave(const stimuli::ObjectSpec& spec);
  void take_large_surface(const stimuli::ObjectSpec& spec, stimuli::PolygonSoup soup,
                          LoadedMesh& loaded);
  void add_shells(const stimuli::ObjectSpec& spec, const Pose& in_object, bool felt,
                  std::vector<stimuli::SurfaceShell>& shells);
  void place_layers(int object, Placing& placing);
  std::vector<Prepared> layer_of(const std::vector<PlacedShape>& shapes, double depth,
                                 const Placing& placing, Pose& pose);
  bool place_layer_in_parts(int object, const std::vector<PlacedShape>& shapes,
                            const stimuli::Layer& layer, int number, Placing& placing,
                            double& deepest);
  bool place_layer_surface(int object, const std::vector<PlacedShape>& shapes,
                           const stimuli::Layer& layer, int number, Placing& placing,
                           double& deepest);
  std::shared_ptr<const stimuli::ClosedSurface> closed_surface_of(const stimuli::ObjectSpec& spec);
  void add_shapes(const stimuli::ObjectSpec& spec, const Pose& in_frame, int object,
                  std::vector<LayeredShape>& shapes);

  std::map<std::string, std::vector<Prepared>> prepared_;  ///< the parts of each shape
  std::map<std::string, LoadedMesh> meshes_;               ///< by shape
  std::map<std::string, std::shared_ptr<const stimuli::ClosedSurface>> convex_;  ///< by shape
  std::map<std::string, std::shared_ptr<const stimuli::Surface>> surfaces_;
  LayerSurfaces layer_surfaces_;
  std::map<int, std::vector<std::string>> layer_notes_;  ///< by object, of the last build
  std::map<std::string, std::shared_ptr<const stimuli::Texture>> textures_;
};

/// The stimuli of a protocol, and each at every level known in advance (levels.h), built
/// once, and the scene of each trial. Threads may share it.
class StimulusLibrary {
 public:
  /// \throws MeshError naming the stimulus.
  explicit StimulusLibrary(const protocols::Protocol& protocol, SceneBuilder builder = {});

  /// The trial's stimulus in the trial's orientation, about the origin of the workspace.
  rendering::Scene scene(const protocols::Trial& trial) const;
  std::size_t size() const { return reaches_.size(); }  ///< stimuli
  /// Nothing to feel, as the trial's renderer has it.
  rendering::Scene empty_scene(protocols::RendererKind renderer) const;
  /// Null: it is smooth.
  const stimuli::Texture* texture(std::size_t stimulus) const { return textures_[stimulus].get(); }
  /// Radius of the sphere about the origin that contains the stimulus in any orientation, m.
  double reach(int stimulus) const { return reaches_[stimulus]; }
  /// Of the stimulus as the protocol has it, not turned.
  const SharpEdges& edges(int stimulus) const { return edges_[static_cast<std::size_t>(stimulus)]; }
  /// Null: the stimulus is not soft.
  const rendering::SoftObject* soft(std::size_t stimulus) const { return soft_[stimulus].get(); }

 private:
  std::vector<std::vector<rendering::SceneObject>> with_sides_, without_sides_;  ///< by stimulus
  std::vector<std::vector<rendering::SceneSurface>> surfaces_;                   ///< by stimulus
  /// By stimulus: itself as it stands in the protocol, or nothing.
  std::vector<std::shared_ptr<const rendering::SoftObject>> soft_;
  std::vector<stimuli::ObjectSpec> specs_;  ///< of the soft ones; others are left empty
  double soft_radius_;
  std::vector<std::vector<rendering::MovingObject>> moving_;  ///< by stimulus: itself or nothing
  std::vector<std::shared_ptr<const stimuli::Texture>> textures_;  ///< by stimulus
  std::vector<double> reaches_;
  std::vector<bool> felt_;  ///< by stimulus; others are only seen
  std::vector<SharpEdges> edges_;
  Vec3 gravity_;  ///< m/s^2
  rendering::Tool tool_;
  double grip_;                                                 ///< m, from the virtual tip
  std::vector<std::vector<rendering::ObjectEffects>> effects_;  ///< by stimulus: none or one
};

}  // namespace palpate::runner
