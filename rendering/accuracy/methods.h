#pragma once
// The methods for penetration depth, direction and contact point that `palpate accuracy` compares,
// behind one interface: the renderers, variants of their walk, and other libraries. Each is defined
// once, in contact_methods().

#include <memory>
#include <string>
#include <vector>

#include "rendering/probe.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/shapes.h"

namespace palpate::rendering {

/// The result of one method for one pose. Frame of the object.
struct ContactEstimate {
  bool touching = false;
  double depth = 0;  ///< m; NaN: the method gave up
  Vec3 normal;       ///< unit, out of the object
  Vec3 point;        ///< m, contact point on the ideal probe; NaN where the method gives none
};

/// One method over one mesh, with what it remembers between ticks.
class ContactMethod {
 public:
  virtual ~ContactMethod() = default;
  virtual ContactEstimate tick(const LineProbe& probe) = 0;
};

struct MethodDefinition {
  std::string name;          ///< "walk", ...
  std::string description;   ///< a line for a legend
  bool has_history = false;  ///< must get every tick of a path, in order
  bool keeps_side = false;   ///< a god-object: stays on the side by which it entered
  bool visits_all = false;   ///< every facet, at every tick: slow on fine meshes
  std::unique_ptr<ContactMethod> (*make)(const stimuli::ConvexMesh& mesh, bool segment) = nullptr;
};

/// All methods of this build. The mesh must outlive what `make` returns.
/// `segment` false: the probe is its tip alone.
std::vector<MethodDefinition> contact_methods();

}  // namespace palpate::rendering
