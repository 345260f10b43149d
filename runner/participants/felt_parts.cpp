#include "runner/participants/felt_parts.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "stimuli/closed_surface.h"
#include "stimuli/inset.h"
#include "stimuli/parts/convex_parts.h"
#include "stimuli/primitives.h"
#include "stimuli/shapes.h"

namespace palpate::runner::participants {
namespace {

/// Depth of the felt surface, m; none: the object has no stiffness anywhere.
std::optional<double> felt_depth(const stimuli::Material& material) {
  if (material.stiffness > 0) return 0;
  for (const stimuli::Layer& layer : material.layers) {
    if (layer.stiffness > 0) return layer.depth;
  }
  return std::nullopt;
}

void add(const stimuli::ObjectSpec& spec, const Pose& parent, std::vector<PlacedPart>& out) {
  const Pose pose = stimuli::compose(parent, spec.pose);
  if (spec.shape == stimuli::ShapeKind::compound) {
    for (const stimuli::ObjectSpec& part : spec.parts) add(part, pose, out);
    return;
  }
  const std::optional<double> depth = felt_depth(spec.material);
  if (!depth) return;
  if (spec.shape == stimuli::ShapeKind::mesh && *depth == 0) {
    const stimuli::PolygonSoup soup = stimuli::polygons_of(spec);
    if (!stimuli::convex_as_it_is(soup)) {
      out.push_back(
          {nullptr, pose,
           std::make_shared<const stimuli::ClosedSurface>(stimuli::closed_surface(soup).surface)});
      return;
    }
  }
  std::vector<std::shared_ptr<const stimuli::ConvexMesh>> meshes;
  for (stimuli::ConvexMesh& part : stimuli::convex_parts(spec))
    meshes.push_back(std::make_shared<const stimuli::ConvexMesh>(std::move(part)));
  if (*depth > 0) meshes = stimuli::inset_union(meshes, *depth);
  for (auto& mesh : meshes) out.push_back({std::move(mesh), pose});
}

}  // namespace

bool can_be_felt(const stimuli::ObjectSpec& stimulus) {
  if (stimulus.shape != stimuli::ShapeKind::compound)
    return felt_depth(stimulus.material).has_value();
  return std::any_of(stimulus.parts.begin(), stimulus.parts.end(), can_be_felt);
}

std::vector<PlacedPart> felt_parts(const stimuli::ObjectSpec& stimulus) {
  std::vector<PlacedPart> parts;
  add(stimulus, Pose{}, parts);
  return parts;
}

}  // namespace palpate::runner::participants
