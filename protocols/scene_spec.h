#pragma once
// The parts of a scene or protocol besides its objects, the tool on the stylus and the extended
// probe, and a scene file as a whole, as plain values. Keys: scene.schema.json. SI units.

#include <cstddef>
#include <optional>
#include <vector>

#include "stimuli/shapes.h"
#include "stimuli/vec.h"

namespace palpate::protocols {

/// One straight piece of a tool, in the frame of the stylus: origin at its tip, +z from tip to
/// tail. m, of a length above 0.
struct ToolSegmentSpec {
  Vec3 from, to;
};

/// The tool on the stylus; without segments the plain stylus from tip to tail.
struct ToolSpec {
  static constexpr std::size_t kMostSegments = 16;
  std::vector<ToolSegmentSpec> segments;
  double radius = 0;  ///< m, on soft objects; 0: kSoftRadius. Rigid ones are touched by lines
};

/// m, default for tools and styluses on soft objects: a line without thickness would sink into an
/// elastic solid without end.
inline constexpr double kSoftRadius = 0.002;

/// The extended probe: the virtual stylus is the real one stretched by `factor` about a pivot.
struct ReachSpec {
  enum class Pivot {
    grip,   ///< the point of the stylus that the hand holds
    tail,   ///< the stylus's end
    point,  ///< a point that stands still in the world
  };
  double factor = 1;
  Pivot pivot = Pivot::grip;
  Vec3 point{0, 0, 0};  ///< m, world frame, of Pivot::point
};

/// A scene file as plain values.
struct SceneSpec {
  std::vector<stimuli::ObjectSpec> objects;
  ToolSpec tool;
  std::optional<ReachSpec> reach;
  Vec3 gravity{0, 0, 0};  ///< m/s^2, on moving objects
};

}  // namespace palpate::protocols
