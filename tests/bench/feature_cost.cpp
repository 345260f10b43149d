// One configuration of the tick over a fixed path, for callgrind to count the instructions of.
// feature_cost.py runs pairs of them.
//
// Usage: feature_cost CASE TICKS, or feature_cost --list

#include <charconv>
#include <cstdio>
#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "rendering/probes.h"
#include "rendering/tick.h"
#include "runner/evidence/verification/random_draws.h"
#include "runner/evidence/verification/surface_stroke.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"
#include "tests/bench/least_tick.h"
#include "tests/bench/measured_tick.h"

namespace palpate::bench {
namespace {

using rendering::tick::PointProbe;
using rendering::tick::SegmentProbe;
using Tick = rendering::Rendering (*)(const rendering::Scene&, rendering::RenderState&,
                                      const rendering::LineProbe&, double) noexcept;

/// A renderer that is one given tick and no other.
class Only final : public rendering::Renderer {
 public:
  explicit Only(Tick chosen) : tick_(chosen) {}
  const char* name() const override { return "only"; }
  bool side_contact() const override { return true; }
  rendering::Rendering tick(const rendering::Scene& scene, rendering::RenderState& state,
                            const rendering::LineProbe& probe, double dt) const noexcept override {
    return tick_(scene, state, probe, dt);
  }

 private:
  Tick tick_;
};

/// Two parts or more that are all in reach all the time: no broad phase.
template <class Probe>
rendering::Rendering without_broad_phase(const rendering::Scene& scene,
                                         rendering::RenderState& state,
                                         const rendering::LineProbe& probe, double) noexcept {
  rendering::tick::Tick<Probe> under_way{scene, state, probe,
                                         Probe::kSegment ? glm::length(probe.tail - probe.tip) : 0};
  if (!rendering::tick::within_range(probe.tip) || !rendering::tick::within_range(probe.tail))
    return rendering::tick::no_contact(state.last, rendering::render_fault::kNonFinite);
  under_way.template add_contacts<false>();
  const std::span<rendering::LoadedContact> contacts(state.contacts);
  rendering::load(contacts);
  state.last = probe;
  state.has_last = true;
  if (!contacts.empty()) return rendering::tick::sum_contacts<Probe, false>(under_way, contacts);
  return rendering::tick::no_contact(probe, under_way.faults);
}

/// A scene as a trial would make it.
struct World {
  stimuli::PolygonSoup shape = stimuli::icosphere(0.03, 0);
  stimuli::Material material;
  int near = 1;  ///< objects side by side, all in reach
  int far = 0;   ///< objects that are never in reach
  std::size_t scanned =
      rendering::ContactTrees::kScanLimit;  ///< so many facets or edges get no tree
  bool side_contact = true;

  rendering::Scene build() const {
    const auto mesh = std::make_shared<const stimuli::ConvexMesh>(shape);
    const auto trees =
        std::make_shared<const rendering::ContactTrees>(*mesh, side_contact, scanned);
    std::vector<rendering::SceneObject> objects;
    for (int i = 0; i < near + far; ++i) {
      Pose pose;
      // Apart from each other: one is touched, the others are near.
      pose.position.x = i < near ? 0.061 * i : 0.15 + 0.07 * i;
      objects.push_back({mesh, pose, material, i, trees});
    }
    return rendering::Scene(std::move(objects), side_contact);
  }
};

struct Case {
  std::string name;
  World world;
  bool ray = true;
  Tick pipeline = nullptr;  ///< null: the renderer as shipped
};

const rendering::Renderer& shipped(bool ray) {
  return ray ? rendering::ray_renderer() : rendering::point_renderer();
}

/// A hand that strokes the first object and lifts off a third of the time, as the shipped renderer
/// leads it: so the path is the same for both cases of a pair.
std::vector<rendering::LineProbe> path_over(const rendering::Scene& scene, bool ray,
                                            std::size_t ticks) {
  runner::evidence::SurfaceStrokeSettings settings;
  settings.centre = scene.parts()[0].sphere_centre;
  settings.radius = scene.parts()[0].sphere_radius;
  settings.side = ray;
  settings.lifted = 0.3;
  settings.lift_period = 250;
  runner::evidence::SurfaceStroke hand(settings);
  rendering::RenderState state = scene.initial_state();
  std::vector<rendering::LineProbe> poses;
  poses.reserve(ticks);
  double depth = 0;
  for (std::size_t i = 0; i < ticks; ++i) {
    poses.push_back(hand.next(depth));
    depth = shipped(ray).tick(scene, state, poses.back(), 1e-3).deepest.depth;
  }
  return poses;
}

stimuli::Material with(double damping, double friction) {
  stimuli::Material material;
  material.damping = damping;
  material.friction_static = material.friction_dynamic = friction;
  return material;
}

std::vector<Case> cases() {
  std::vector<Case> all;
  for (const bool ray : {false, true}) {
    const std::string probe = ray ? "ray" : "point";
    const auto add = [&](const std::string& name, const World& world, Tick pipeline = nullptr) {
      all.push_back({probe + '-' + name, world, ray, pipeline});
      all.back().world.side_contact = ray;
    };
    const auto pick = [&](Tick of_ray, Tick of_point) { return ray ? of_ray : of_point; };
    World plain, near, far, forced, large, bare;
    near.near = 2;
    far.near = 2;
    far.far = 1000;
    forced.scanned = 0;
    large.shape = bare.shape = stimuli::icosphere(0.03, 4);
    bare.scanned = SIZE_MAX;
    add("plain", plain);
    add("plain-least", plain, pick(&least_tick<SegmentProbe>, &least_tick<PointProbe>));
    add("plain-alone", plain,
        pick(&rendering::tick::render_tick<SegmentProbe, rendering::TickFeatures{}>,
             &rendering::tick::render_tick<PointProbe, rendering::TickFeatures{}>));
    if (ray) add("torqueless", plain, &least_tick<SegmentProbe, false>);
    add("large", large);
    add("large-bare", bare);
    add("forced-trees", forced);
    add("near", near);
    add("near-without-broad-phase", near,
        pick(&without_broad_phase<SegmentProbe>, &without_broad_phase<PointProbe>));
    add("far", far);
    World damped = plain, rough = plain;
    damped.material = with(2, 0);
    rough.material = with(0, 0.3);
    add("damping", damped);
    add("friction", rough);
    // The other, and a tick in which this one is not even compiled.
    constexpr rendering::TickFeatures kNoDamping{.friction = true}, kNoFriction{.damping = true};
    add("all-but-damping", rough);
    add("all-but-damping-least", rough,
        pick(&rendering::tick::render_tick<SegmentProbe, kNoDamping>,
             &rendering::tick::render_tick<PointProbe, kNoDamping>));
    add("all-but-friction", damped);
    add("all-but-friction-least", damped,
        pick(&rendering::tick::render_tick<SegmentProbe, kNoFriction>,
             &rendering::tick::render_tick<PointProbe, kNoFriction>));
  }
  return all;
}

double run(const Case& chosen, std::size_t ticks) {
  constexpr std::size_t kApproach = 400;  // ticks until the hand has arrived
  const rendering::Scene scene = chosen.world.build();
  const auto poses = path_over(scene, chosen.ray, kApproach + ticks);
  const Only only(chosen.pipeline);
  const rendering::Renderer& renderer = chosen.pipeline ? only : shipped(chosen.ray);
  rendering::RenderState state = scene.initial_state();
  // The trial begins near the first two objects; not all pipelines have a broad phase.
  const rendering::LineProbe between{{0.03, 0, 0}, {0.03, 0, 0}};
  if (scene.features().several_parts) rendering::update_near_parts(scene, state, between);
  for (std::size_t i = 0; i < kApproach; ++i) renderer.tick(scene, state, poses[i], 1e-3);
  double total = 0;
  for (std::size_t i = kApproach; i < poses.size(); ++i)
    total += measured_tick(renderer, scene, state, poses[i]);
  return total;
}

int main_with(int argc, char** argv) {
  const std::vector<Case> all = cases();
  if (argc == 2 && std::strcmp(argv[1], "--list") == 0) {
    for (const Case& c : all) std::printf("%s\n", c.name.c_str());
    return 0;
  }
  std::size_t ticks = 0;
  if (argc != 3 ||
      std::from_chars(argv[2], argv[2] + std::strlen(argv[2]), ticks).ec != std::errc{}) {
    std::fprintf(stderr, "usage: feature_cost CASE TICKS | --list\n");
    return 2;
  }
  for (const Case& c : all) {
    if (c.name != argv[1]) continue;
    // The forces themselves must be the same in both cases of a pair.
    std::printf("%.17g\n", run(c, ticks));
    return 0;
  }
  std::fprintf(stderr, "feature_cost: no case '%s'\n", argv[1]);
  return 2;
}

}  // namespace
}  // namespace palpate::bench

int main(int argc, char** argv) {
  try {
    return palpate::bench::main_with(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "feature_cost: %s\n", error.what());
    return 1;
  }
}
