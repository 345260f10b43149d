#include "runner/participants/felt_parts.h"

#include <algorithm>
#include <utility>

#include "stimuli/parts/convex_parts.h"

namespace palpate::runner {
namespace {

void add(const stimuli::ObjectSpec& spec, const Pose& parent, std::vector<PlacedPart>& out) {
  const Pose pose{parent.orientation * spec.pose.position + parent.position,
                  parent.orientation * spec.pose.orientation};
  if (spec.shape == stimuli::ShapeKind::compound) {
    for (const stimuli::ObjectSpec& part : spec.parts) add(part, pose, out);
    return;
  }
  for (stimuli::ConvexMesh& part : stimuli::convex_parts(spec))
    out.push_back({std::make_shared<const stimuli::ConvexMesh>(std::move(part)), pose});
}

bool is_stiff(const stimuli::Material& material) {
  return material.stiffness > 0 ||
         std::any_of(material.layers.begin(), material.layers.end(),
                     [](const stimuli::Layer& layer) { return layer.stiffness > 0; });
}

}  // namespace

bool can_be_felt(const stimuli::ObjectSpec& stimulus) {
  if (stimulus.shape != stimuli::ShapeKind::compound) return is_stiff(stimulus.material);
  return std::any_of(stimulus.parts.begin(), stimulus.parts.end(), can_be_felt);
}

std::vector<PlacedPart> felt_parts(const stimuli::ObjectSpec& stimulus) {
  std::vector<PlacedPart> parts;
  add(stimulus, Pose{}, parts);
  return parts;
}

}  // namespace palpate::runner
