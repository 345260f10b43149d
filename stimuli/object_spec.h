#pragma once
// What a scene file or a protocol says of an object, as plain values (contracts: "Scene").

#include <array>
#include <string>
#include <vector>

#include "stimuli/vec.h"

namespace palpate {

enum class ShapeKind { sphere, cone, cylinder, cube, mesh, compound };

/// How an object feels.
struct Material {
  double stiffness = 800;  ///< N/m, along the contact normal
  double damping = 0;      ///< N s/m, along the contact normal; 0 leaves the term out
};

/// Local frames: sphere, cube and cylinder centred, cylinder axis +z; cone axis +z, apex at
/// +height/2, base at -height/2.
struct ObjectSpec {
  ShapeKind shape = ShapeKind::sphere;
  double radius = 0.03;           ///< m; sphere, cone, cylinder
  double height = 0.06;           ///< m; cone, cylinder
  double edge = 0.06;             ///< m; cube
  int subdivisions = 4;           ///< sphere: an icosphere of 20 * 4^subdivisions triangles
  int segments = 64;              ///< cone, cylinder: corners of the rim
  std::string file;               ///< mesh: resolved path of an .obj or .stl file
  std::vector<ObjectSpec> parts;  ///< compound: placed relative to the compound
  Pose pose;
  Material material;
};

}  // namespace palpate
