#pragma once
// What a tick over a scene consists of, and what was left out of it: read off the scene as it was
// compiled. Not for the servo.

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "rendering/renderer.h"

namespace palpate::rendering {

/// When a stage runs.
enum class StageTime { once, tick, free, entry, contact };

const char* to_string(StageTime time);  ///< "once a scene", "every tick", "in free space", ...

/// One stage of the way from a scene and a pose to forces.
struct Stage {
  std::string name;
  StageTime time = StageTime::tick;
  bool runs = false;  ///< false: left out
  std::string why;    ///< what it does here, or why it is not needed
};

/// All stages there are, in the order in which they run. A stage runs if and only if the renderer's
/// tick over this scene contains it: Scene::features(), the trees that were built, the renderer.
std::vector<Stage> explain(const Scene& scene, const Renderer& renderer);

/// A stage of explain(), or a whole tick, to be timed in isolation over recorded ticks.
struct Rehearsal {
  std::string name;               ///< Stage::name; kTickInContact or kTickInFreeSpace
  std::size_t calls = 0;          ///< of the stage in one run; 0: it did not happen on the path
  std::function<void()> prepare;  ///< before each run
  std::function<double()> run;    ///< the value has no meaning but that it was computed
};

inline constexpr const char* kTickInContact = "whole tick in contact";
inline constexpr const char* kTickInFreeSpace = "whole tick in free space";

/// Lets a hand stroke the scene's first part (StrokingHand) and records it. Scene and renderer must
/// outlive what is returned. Stages that cannot be told apart from others have no rehearsal.
/// Building trees is not rehearsed. Empty for a scene without parts.
std::vector<Rehearsal> rehearse(const Scene& scene, const Renderer& renderer);

}  // namespace palpate::rendering
