#pragma once
// The extreme cases, by kind. \see extreme_cases

#include "rendering/renderer.h"
#include "runner/evidence/verification/extreme_cases.h"

namespace palpate::runner::evidence::extremes {

// By shape.
ExtremeResult sliver(const rendering::Renderer& renderer);
ExtremeResult needle(const rendering::Renderer& renderer);
ExtremeResult nearly_coplanar(const rendering::Renderer& renderer);
ExtremeResult duplicate_vertices(const rendering::Renderer& renderer);
ExtremeResult small_object(const rendering::Renderer& renderer);
ExtremeResult large_object(const rendering::Renderer& renderer);
ExtremeResult far_object(const rendering::Renderer& renderer);
ExtremeResult million_triangles(const rendering::Renderer& renderer);

// By motion of the hand.
ExtremeResult thin_plate(const rendering::Renderer& renderer);
ExtremeResult parallel_edge(const rendering::Renderer& renderer);
ExtremeResult through_vertices(const rendering::Renderer& renderer);
ExtremeResult zero_length(const rendering::Renderer& renderer);
ExtremeResult tiny_length(const rendering::Renderer& renderer);
ExtremeResult starts_inside(const rendering::Renderer& renderer);
ExtremeResult teleports(const rendering::Renderer& renderer);
ExtremeResult bad_poses(const rendering::Renderer& renderer);

// By energy over a closed path.
ExtremeResult closed_paths(const rendering::Renderer& renderer);
ExtremeResult closed_paths_lossy(const rendering::Renderer& renderer);
ExtremeResult closed_paths_in_the_blend(const rendering::Renderer& renderer);

}  // namespace palpate::runner::evidence::extremes
