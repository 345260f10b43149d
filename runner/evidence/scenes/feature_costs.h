#pragma once
// Cost of a scene's features in a tick: those that it has in nanoseconds, here and now; those
// that it does not need in instructions, from a table that was measured once.

#include <optional>
#include <string>
#include <vector>

#include "protocols/parse.h"
#include "rendering/renderer.h"

namespace palpate::runner::evidence {

/// ns of a whole tick, over a hand that strokes the first object and hovers over it.
struct WholeTick {
  std::optional<double> contact_ns, free_ns;  ///< empty: did not happen
};
WholeTick time_whole_tick(const rendering::Scene& scene, const rendering::Renderer& renderer);

/// A feature that the scene has.
struct FeatureTime {
  std::string name;          ///< "layers"
  std::string without;       ///< what the scene is compared with: "the same without layers"
  std::optional<double> ns;  ///< more for a tick in contact; empty: cannot be separated
};
/// By difference: the tick of the scene, and of the scene without the feature, each over a hand of
/// its own that strokes the same object. Layers, moving and soft bodies, tools, and concave meshes
/// (beside their convex hulls). \throws stimuli::MeshError
std::vector<FeatureTime> feature_times(const std::string& name, const protocols::SceneSpec& spec,
                                       const rendering::Renderer& renderer);

/// A feature that the scene does not need.
struct FeatureSaved {
  std::string name;
  double instructions = 0;  ///< of a tick, that it would add
};
/// Where the table's numbers are from, a sentence.
extern const char* const kCostsMeasured;
/// \param scene  compiled
std::vector<FeatureSaved> features_saved(const rendering::Scene& scene,
                                         const rendering::Renderer& renderer);

}  // namespace palpate::runner::evidence
