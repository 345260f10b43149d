#include "runner/evidence/scenes/feature_costs.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <glm/geometric.hpp>
#include <limits>
#include <string_view>
#include <utility>
#include <vector>

#include "runner/evidence/scenes/meshes.h"
#include "runner/evidence/tick_meters.h"
#include "runner/evidence/verification/surface_stroke.h"
#include "runner/scene_builder.h"
#include "runner/touch/forces.h"

namespace palpate::runner::evidence {
namespace {

using protocols::SceneSpec;
using stimuli::ObjectSpec;

constexpr std::size_t kTicks = 3000;
constexpr int kRounds = 3;

/// A sphere round the first object, as the scene has it.
std::pair<Vec3, double> first_sphere(const rendering::Scene& scene) {
  if (!scene.parts().empty()) {
    Vec3 low(HUGE_VAL), high(-HUGE_VAL);
    for (const rendering::ScenePart& part : scene.parts()) {
      if (part.object != scene.parts().front().object) continue;
      low = glm::min(low, part.sphere_centre - part.sphere_radius);
      high = glm::max(high, part.sphere_centre + part.sphere_radius);
    }
    return {0.5 * (low + high), 0.5 * std::max({high.x - low.x, high.y - low.y, high.z - low.z})};
  }
  if (!scene.surfaces().empty())
    return {scene.surfaces()[0].sphere_centre, scene.surfaces()[0].sphere_radius};
  return {Vec3(0), 0};
}

/// ns, mean over the ticks in the wanted state; of each the least of some rounds, as other programs
/// only make them longer.
std::optional<double> time_of(const rendering::Scene& scene, const rendering::Renderer& renderer,
                              const std::pair<Vec3, double>& sphere, double lifted, bool touching) {
  if (!(sphere.second > 0)) return std::nullopt;
  static const double ns = nanoseconds_per_count();
  std::vector<std::uint64_t> least(kTicks, std::numeric_limits<std::uint64_t>::max());
  std::vector<bool> wanted(kTicks);
  for (int round = 0; round < kRounds; ++round) {
    SurfaceStroke hand({.centre = sphere.first,
                        .radius = sphere.second,
                        .side = renderer.side_contact(),
                        .lifted = lifted});
    rendering::RenderState state = scene.initial_state();
    double depth = 0;
    for (std::size_t i = 0; i < kTicks; ++i) {
      const rendering::LineProbe probe = hand.next(depth);
      const std::uint64_t start = begin_count();
      const rendering::Rendering r = renderer.tick(scene, state, probe, 1e-3);
      least[i] = std::min(least[i], end_count() - start);
      wanted[i] = (r.contacts > 0) == touching;
      depth = r.contacts > 0 ? r.deepest.depth : 0;
    }
  }
  double total = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < kTicks; ++i) {
    if (!wanted[i]) continue;
    total += static_cast<double>(least[i]);
    ++count;
  }
  if (count == 0) return std::nullopt;
  return ns * total / static_cast<double>(count);
}

bool any(const std::vector<ObjectSpec>& objects,
         const std::function<bool(const ObjectSpec&)>& has) {
  return std::ranges::any_of(
      objects, [&](const ObjectSpec& object) { return has(object) || any(object.parts, has); });
}

void each(std::vector<ObjectSpec>& objects, const std::function<void(ObjectSpec&)>& change) {
  for (ObjectSpec& object : objects) {
    change(object);
    each(object.parts, change);
  }
}

/// Of instructions that a feature adds to a tick that uses it.
struct MeasuredCost {
  const char* feature;
  double point, ray;
};

// tests/bench/tick_instructions.py.
constexpr MeasuredCost kCosts[] = {
    {"side contact and torque", 127, 127},
    {"several objects", 195, 254},
    {"unions and tools", 1933, 2147},
    {"closed surfaces", 2829, 5912},
    {"damping", 34, 38},
    {"friction", 103, 119},
};

double cost_of(const char* feature, bool ray) {
  for (const MeasuredCost& cost : kCosts) {
    if (std::string_view(cost.feature) == feature) return ray ? cost.ray : cost.point;
  }
  return 0;
}

}  // namespace

const char* const kCostsMeasured =
    "Instructions that the feature adds to a tick on a ball of 1,280 triangles, from a table: "
    "measured "
    "on 2026-11-28, virtual AMD EPYC, release build (g++ 12), by tests/bench/tick_instructions.py. "
    "Not "
    "measured here.";

WholeTick time_whole_tick(const rendering::Scene& scene, const rendering::Renderer& renderer) {
  const auto sphere = first_sphere(scene);
  return {time_of(scene, renderer, sphere, 0, true), time_of(scene, renderer, sphere, 1, false)};
}

std::vector<FeatureTime> feature_times(const std::string& name, const SceneSpec& spec,
                                       const rendering::Renderer& renderer) {
  std::vector<FeatureTime> out;
  const auto compiled = [&](const SceneSpec& one) {
    SceneBuilder builder;
    return touch::build_scene(builder, name, one, renderer);
  };
  const rendering::Scene whole = compiled(spec);
  auto sphere = first_sphere(whole);
  if (!(sphere.second > 0)) sphere = {spec.objects.front().pose.position, 0.03};
  const std::optional<double> with = time_of(whole, renderer, sphere, 0, true);
  const auto compare = [&](const char* feature, const char* than, SceneSpec other) {
    FeatureTime row{feature, than, std::nullopt};
    try {
      const std::optional<double> without = time_of(compiled(other), renderer, sphere, 0, true);
      if (with && without) row.ns = *with - *without;
    } catch (const stimuli::MeshError&) {
      // Such a scene cannot be made.
    }
    out.push_back(std::move(row));
  };
  if (any(spec.objects, [](const ObjectSpec& one) { return !one.material.layers.empty(); })) {
    SceneSpec other = spec;
    each(other.objects, [](ObjectSpec& one) { one.material.layers.clear(); });
    compare("layers", "the same without layers", std::move(other));
  }
  if (any(spec.objects, [](const ObjectSpec& one) { return one.texture.has_value(); })) {
    SceneSpec other = spec;
    each(other.objects, [](ObjectSpec& one) { one.texture.reset(); });
    compare("texture", "the same, all smooth", std::move(other));
  }
  if (any(spec.objects, [](const ObjectSpec& one) { return !one.fields.empty(); })) {
    SceneSpec other = spec;
    each(other.objects, [](ObjectSpec& one) { one.fields.clear(); });
    compare("fields", "the same without fields", std::move(other));
  }
  if (any(spec.objects, [](const ObjectSpec& one) { return one.body.has_value(); })) {
    SceneSpec other = spec;
    each(other.objects, [](ObjectSpec& one) { one.body.reset(); });
    compare("moving bodies", "the same, all standing still", std::move(other));
  }
  if (any(spec.objects, [](const ObjectSpec& one) { return one.soft.has_value(); })) {
    SceneSpec other = spec;
    each(other.objects, [](ObjectSpec& one) { one.soft.reset(); });
    compare("soft bodies", "the same, all rigid", std::move(other));
  }
  if (!spec.tool.segments.empty()) {
    SceneSpec other = spec;
    other.tool.segments.clear();
    compare("tool", "the same with the plain stylus", std::move(other));
  }
  if (!whole.surfaces().empty()) {
    SceneSpec other = spec;
    int number = 0;
    for (ObjectSpec& object : other.objects) object = hull_of(object, number++);
    compare("concave meshes", "the same with convex hulls", std::move(other));
  }
  return out;
}

std::vector<FeatureSaved> features_saved(const rendering::Scene& scene,
                                         const rendering::Renderer& renderer) {
  const bool ray = renderer.side_contact();
  const rendering::TickFeatures features = scene.features();
  std::vector<FeatureSaved> out;
  const auto leave_out = [&](const char* name, bool needed) {
    if (!needed) out.push_back({name, cost_of(name, ray)});
  };
  leave_out("side contact and torque", ray);
  leave_out("several objects", features.several_parts);
  leave_out("unions and tools", features.unions);
  leave_out("closed surfaces", !scene.surfaces().empty());
  leave_out("damping", features.damping);
  leave_out("friction", features.friction);
  return out;
}

}  // namespace palpate::runner::evidence
