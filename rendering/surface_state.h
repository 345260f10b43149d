#pragma once
// The law of surfaces (surface_contact.h): its view of a closed surface in a scene, and its state
// between ticks.

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <memory>
#include <vector>

#include "rendering/active_planes.h"
#include "rendering/near_patches.h"
#include "rendering/surface_patch.h"
#include "stimuli/vec.h"

namespace palpate::rendering {

/// A closed surface as the tick uses it. World frame, m.
struct PlacedSurface {
  std::shared_ptr<const stimuli::Surface> surface;
  Mat3 to_world;  ///< rotation from the surface's frame
  Vec3 position;  ///< of its origin
  Vec3 sphere_centre;
  double sphere_radius = 0;
  double tolerance = 0;              ///< shorter is rounding
  double skin = 0;                   ///< the ideal tool keeps this distance from what it rests on
  int object = 0;                    ///< the first one
  std::vector<int> of_shell;         ///< object of each shell
  std::uint32_t group = 0;           ///< index in Scene::groups()
  std::uint32_t first_material = 0;  ///< of the first shell, in Scene::material_of
  int layer = 0;                     ///< as of SceneObject
  static constexpr std::uint32_t kHolds = 0xffffffff;
  std::uint32_t breaking = kHolds;  ///< index in Scene::breaking(); kHolds: never breaks
  double break_force = 0;           ///< N, where it breaks

  Vec3 local_vector(const Vec3& world) const {
    return {glm::dot(to_world[0], world), glm::dot(to_world[1], world),
            glm::dot(to_world[2], world)};
  }
  Vec3 local_point(const Vec3& world) const { return local_vector(world - position); }
  Vec3 world_vector(const Vec3& local) const {
    return to_world[0] * local.x + to_world[1] * local.y + to_world[2] * local.z;
  }
};

/// A surface's state between ticks. Local frame, m.
struct SurfaceState {
  std::array<SurfacePatch, kMostPlanes> carrying;  ///< held the ideal tool at the last tick
  std::size_t carrying_count = 0;
  /// All that the tool can touch while it is less than `room`, m, off the straight way.
  NearPatches patches;
  PosedTool listed;  ///< where the way begins
  Vec3 listed_way;
  double room = 0;
  double stride = 0;  ///< m, how far the ideal tool is translated in a tick, about
  bool has_list = false;
  /// The tool touches nothing while no end of it is farther than `clear_room`, m, from `clear`.
  PosedTool clear;
  double clear_room = 0;
  double wanted_clear_room = 0;  ///< for the next one
  /// The contacts of the last tick; their friction is in UnionMemory::pairs.
  struct Rubbed {
    Vec3 normal;
    std::uint32_t segment = 0;
    bool used = false;
  };
  std::array<Rubbed, kMostPlanes> rubbed;
};

}  // namespace palpate::rendering
