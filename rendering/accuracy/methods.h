#pragma once
// The ways of answering "how deep, which way out, touched where" that `palpate accuracy` compares,
// behind one interface: ours, ours with something left out, and other people's.

#include <memory>
#include <string>
#include <vector>

#include "rendering/probe.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/object_spec.h"

namespace palpate::rendering {

/// What a tick came to. Frame of the object.
struct Answer {
  bool touching = false;
  double depth = 0;  ///< m; NaN: the method gave up
  Vec3 normal;
  Vec3 point;  ///< m, where the ideal probe touches; NaN where the method does not tell
};

/// One method over one mesh, with its memory.
class Method {
 public:
  virtual ~Method() = default;
  virtual Answer tick(const LineProbe& probe) = 0;
};

struct MethodKind {
  std::string name;           ///< "walk", ...
  std::string description;    ///< a line for a legend
  bool remembers = false;     ///< needs every tick of a path in order
  bool follows_side = false;  ///< a god-object: keeps to the way out that it came in by
  std::unique_ptr<Method> (*make)(const stimuli::ConvexMesh& mesh, bool segment) = nullptr;
};

/// All methods of this build. The mesh must outlive what they make. \param segment  false: the
/// probe is its tip
std::vector<MethodKind> accuracy_methods();

}  // namespace palpate::rendering
