#pragma once
// What the law of surfaces (surface_contact.h) knows of a closed surface in a scene, and what it
// remembers between ticks.

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <memory>
#include <vector>

#include "rendering/active_planes.h"
#include "rendering/surface_patch.h"

namespace palpate::rendering {

/// A closed surface as the tick uses it. World frame, m.
struct PlacedSurface {
  std::shared_ptr<const Surface> surface;
  Mat3 to_world;  ///< rotation from the surface's frame
  Vec3 position;  ///< of its origin
  Vec3 sphere_centre;
  double sphere_radius = 0;
  double tolerance = 0;  ///< shorter is rounding
  double skin = 0;       ///< the ideal tool keeps this distance from what it rests on
  int object = 0;
  std::uint32_t group = 0;           ///< index in Scene::groups()
  std::uint32_t first_material = 0;  ///< of its first shell, in Scene::material_of

  Vec3 local_vector(const Vec3& world) const {
    return {glm::dot(to_world[0], world), glm::dot(to_world[1], world),
            glm::dot(to_world[2], world)};
  }
  Vec3 local_point(const Vec3& world) const { return local_vector(world - position); }
  Vec3 world_vector(const Vec3& local) const {
    return to_world[0] * local.x + to_world[1] * local.y + to_world[2] * local.z;
  }
};

/// A triangle near a segment of the tool, and what of it the two can bring together.
struct NearTriangle {
  std::uint32_t triangle = 0;
  std::uint8_t segment = 0;
  std::uint8_t what = 0;  ///< bits of surface_pair
};

/// A patch near the tool as it is turned in this tick.
struct NearPatch {
  PatchPlane plane;
  SurfacePatch patch;
};

/// What is remembered of a surface. Local frame, m.
struct SurfaceState {
  std::array<SurfacePatch, kMostPlanes> carrying;  ///< that held the ideal tool at the last tick
  std::size_t carrying_count = 0;
  /// All triangles within `room` of the tool where it was at `listed`.
  std::vector<NearTriangle> near;
  PosedTool listed;
  double room = 0;
  double wanted_room = 0;  ///< for the next list
  bool has_list = false;
  std::vector<NearPatch> patches;  ///< of the tick in hand
  /// Of the contacts of the last tick, whose friction is in UnionMemory::pairs.
  struct Rubbed {
    Vec3 normal;
    std::uint32_t segment = 0;
    bool used = false;
  };
  std::array<Rubbed, kMostPlanes> rubbed;
};

/// Triangles of a list at most; where there are more the tree is asked each time.
inline constexpr std::size_t kMostNear = 1024, kMostPatches = 2 * kMostNear;

}  // namespace palpate::rendering
