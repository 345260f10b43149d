#pragma once
// Builds the renderers' scenes from the objects of a protocol or scene file.

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "protocols/protocol.h"
#include "protocols/schedule.h"
#include "rendering/renderer.h"
#include "rendering/scene.h"

namespace palpate::runner {

const rendering::Renderer& renderer_for(protocols::RendererKind kind);

/// Builds a scene of the convex parts of objects; equal shapes share one mesh and its search trees.
class SceneBuilder {
 public:
  /// \throws MeshError where a shape is no solid that falls into convex parts, with the place as a
  /// JSON pointer.
  rendering::Scene build(const std::vector<stimuli::ObjectSpec>& objects, bool side_contact);

 private:
  struct Prepared {
    std::shared_ptr<const stimuli::ConvexMesh> mesh;
    std::shared_ptr<const rendering::ContactTrees> trees;
  };
  const std::vector<Prepared>& prepare(const stimuli::ObjectSpec& spec, bool side_contact);
  void place(const stimuli::ObjectSpec& spec, const Pose& parent, int object, bool side_contact,
             std::vector<rendering::SceneObject>& out);

  std::map<std::string, std::vector<Prepared>> prepared_;  ///< the parts of each shape
};

/// The stimuli of a protocol, built once, and the scene of each trial. Threads may share it.
class StimulusLibrary {
 public:
  /// \throws MeshError naming the stimulus.
  explicit StimulusLibrary(const protocols::Protocol& protocol);

  /// The trial's stimulus in the trial's orientation, about the origin of the workspace.
  rendering::Scene scene(const protocols::Trial& trial) const;
  /// Radius of the sphere about the origin that contains the stimulus in any orientation, m.
  double reach(int stimulus) const { return reaches_[stimulus]; }

 private:
  std::vector<std::vector<rendering::SceneObject>> with_sides_, without_sides_;  ///< by stimulus
  std::vector<double> reaches_;
};

}  // namespace palpate::runner
