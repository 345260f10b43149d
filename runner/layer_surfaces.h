#pragma once
// The layers of an object, or of objects that touch, as closed surfaces. Frame of the object, or
// world where there are several. SI units.

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "rendering/scene.h"
#include "stimuli/layers/layer_surface.h"
#include "stimuli/shapes.h"

namespace palpate::runner {

/// A closed shape of a solid.
struct LayeredShape {
  const stimuli::ObjectSpec* spec;  ///< with its material
  std::shared_ptr<const stimuli::ClosedSurface> surface;
  Pose pose;
  int object = 0;   ///< index in the scene
  std::string key;  ///< equal for equal surfaces
};

/// Makes each layer once, however often it is asked for.
class LayerSurfaces {
 public:
  /// A layer where some of the shapes have it.
  struct Wanted {
    stimuli::Layer layer;
    int number = 1;  ///< from 1 on, from the outside
    std::vector<const stimuli::ObjectSpec*> shapes;
  };
  struct Made {
    std::shared_ptr<const stimuli::ClosedSurface> surface;  ///< null: nothing is left
    double error = 0;                                       ///< m, of its depth
    double deepest = 0;  ///< m; if nothing is left, or too thin a layer: here something is
  };
  /// \param all  shapes of the solid: what lies between two of them is no surface
  /// \throws MeshError  if it is no closed surface
  const Made& make(const std::vector<LayeredShape>& all, const Wanted& wanted);

 private:
  std::map<std::string, Made> made_;
};

/// Layers of one solid that are felt with one ideal tool each: those of a number that break alike.
class LayerShells {
 public:
  void add(const LayerSurfaces::Wanted& wanted, int object,
           std::shared_ptr<const stimuli::ClosedSurface> surface);
  /// Shapes that are not felt; they say where their object ends.
  void add_bound(const LayeredShape& shape);
  /// \param solid  index of the object, or of the first one
  std::vector<rendering::SceneSurface> surfaces(const Pose& pose, int solid) const;

 private:
  struct Shells {
    int number;
    double break_force;  // N
    std::vector<stimuli::SurfaceShell> shells;
    std::vector<int> objects;
  };
  Shells& of(int number, double break_force);
  std::vector<Shells> all_;
};

}  // namespace palpate::runner
