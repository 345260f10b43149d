#pragma once
// Contact of a tool with a radius and a soft body, at the servo's rate: the body's place and
// compliance between two of its steps. World frame, SI units. Nothing here throws or allocates,
// except construction of the memory.
//
// The ideal tool is the virtual one, moved (not turned) by a spring of the contact stiffness. Every
// edge of the surface near a segment of the tool, and every triangle near an end of the tool, must
// stay outside the tool's radius: gap_i = g_i + sum of W_ij F_j >= 0, F_i >= 0, gap_i F_i = 0. W is
// the body's compliance at those places within a step (Saupin, Duriez & Cotin 2008, "Contact model
// for haptic medical simulations") with the spring in series, so the number of places changes no
// stiffness. Solved by projected Gauss-Seidel.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "rendering/bodies/soft/soft_body.h"
#include "rendering/bodies/soft/soft_surface.h"
#include "rendering/tool.h"
#include "stimuli/vec.h"

namespace palpate::rendering {

/// One contact place of a segment of the tool with the surface.
struct SoftContact {
  std::uint32_t key = 0;  ///< edge, or triangle and segment end; identifies the contact
  int segment = 0;
  std::array<std::uint32_t, 3> nodes{};  ///< surface nodes that bear the force
  std::array<double, 3> weights{};
  std::uint32_t count = 0;  ///< of nodes
  Vec3 normal;              ///< unit, from the surface to the tool's axis
  Vec3 axis_point;          ///< m, on the axis of the virtual segment
  double along = 0;         ///< of the segment: 0 to 1
  double gap = 0;           ///< m, without any force
  double now = 0;           ///< m, the gap with the last forces
  double force = 0;         ///< N
};

struct SoftContactSettings {
  double radius = 0.002;   ///< m, of the tool
  double stiffness = 800;  ///< N/m, of the spring between virtual and ideal tool
  std::size_t most = 64;   ///< contacts at once; of more, the deepest are kept
  int sweeps = 60;         ///< of Gauss-Seidel, at most
};

/// State between ticks.
struct SoftContactMemory {
  SoftContactMemory() = default;
  SoftContactMemory(const SoftBody& body, const SoftContactSettings& settings);

  Vec3 shift{0, 0, 0};                ///< m, from the virtual to the ideal tool
  std::vector<SoftContact> contacts;  ///< of the last tick; some without force
  std::vector<NodeForce> forces;      ///< on the body, of the last tick
  double moved = 0;                   ///< m, motion of the surface by those forces, at most
  bool dropped = false;               ///< there were more contacts than are kept

  // Of the current tick:
  struct Node {
    std::uint32_t node;
    Vec3 base;  ///< m, without any force
    Vec3 now;   ///< m, with the last forces
  };
  std::vector<SoftContact> found;
  std::vector<Node> local;
  std::vector<std::uint32_t> slot;  ///< by surface node; valid if local[slot].node equals it
  std::vector<double> matrix;
};

/// One body's surface at one moment.
struct SoftMoment {
  const SoftBody& body;
  const SoftSurface& surface;
  const SoftView& view;
  double fraction = 0;  ///< of a step since the view
};

/// Moves the ideal tool.
/// \param tip   m, of the virtual tool
/// \param tool  its segments, relative to the tip
/// \param step  m, by which the virtual tool moved since the last call, at most
/// \return the force on the tool, N
Vec3 follow_surface(const SoftMoment& moment, const SoftContactSettings& settings, const Vec3& tip,
                    const PlacedTool& tool, double step, SoftContactMemory& memory) noexcept;

/// Whether the tool's axis is inside the surface, or closer to it than the tool's radius.
bool is_inside(const SoftMoment& moment, double radius, const Vec3& tip,
               const PlacedTool& tool) noexcept;

}  // namespace palpate::rendering
