#pragma once
// The stages of a tick over a scene: which run, which are left out and why, and their costs. Read
// from the compiled scene. Not for the servo.

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "rendering/renderer.h"

namespace palpate::runner::evidence {

/// When a stage of the tick runs.
enum class StageTime { once, tick, free, entry, contact };

const char* to_string(StageTime time);  ///< "once a scene", "every tick", "in free space", ...

/// One stage of a tick, from the pose to the forces.
struct TickStage {
  std::string name;
  StageTime time = StageTime::tick;
  bool runs = false;  ///< false: left out
  std::string why;    ///< its purpose, or why it is not needed
};

/// All stages, in the order in which they run. A stage runs if and only if the renderer's tick over
/// this scene contains it: Scene::features(), the trees that were built, the renderer.
std::vector<TickStage> explain(const rendering::Scene& scene, const rendering::Renderer& renderer);

/// A stage of explain(), or a whole tick, as a function to be timed in isolation over recorded
/// ticks.
struct StageTiming {
  std::string name;               ///< TickStage::name; kTickInContact or kTickInFreeSpace
  std::size_t calls = 0;          ///< of the stage in one run; 0: it did not occur on the path
  std::function<void()> prepare;  ///< before each run
  std::function<double()> run;    ///< the value only keeps the compiler from removing the work
};

inline constexpr const char* kTickInContact = "whole tick in contact";
inline constexpr const char* kTickInFreeSpace = "whole tick in free space";

/// Records a hand that strokes the scene's first part (SurfaceStroke). Scene and renderer must
/// outlive the result. Stages that cannot be separated from others, and the building of trees, are
/// not timed. Empty for a scene without parts.
std::vector<StageTiming> stage_timings(const rendering::Scene& scene,
                                       const rendering::Renderer& renderer);

}  // namespace palpate::runner::evidence
