#include "rendering/renderer.h"

#include <array>
#include <utility>

#include "rendering/probes.h"
#include "rendering/tick.h"

namespace palpate::rendering {
namespace {

/// The two renderers are one tick over two kinds of probe, compiled for every combination of
/// features that a scene may need.
template <class Probe>
class ProbeRenderer final : public Renderer {
 public:
  const char* name() const override { return Probe::kSegment ? "ray" : "point"; }
  bool side_contact() const override { return Probe::kSegment; }
  Rendering tick(const Scene& scene, RenderState& state, const LineProbe& probe,
                 double dt) const noexcept override {
    return kTicks[scene.features_index()](scene, state, probe, dt);
  }

 private:
  static Rendering render_motion(const Scene& scene, RenderState& state, const LineProbe& probe,
                                 double dt) noexcept {
    return scene.motion()->tick(Probe::kSegment ? ray_renderer() : point_renderer(), state, probe,
                                dt);
  }

  static Rendering render_effects(const Scene& scene, RenderState& state, const LineProbe& probe,
                                  double dt) noexcept {
    Rendering felt = kTicks[scene.features_index() - Scene::kWithEffects](scene, state, probe, dt);
    add_effects(scene, state, probe, dt, Probe::kSegment, felt);
    return felt;
  }

  using TickFunction = Rendering (*)(const Scene&, RenderState&, const LineProbe&, double) noexcept;
  static constexpr auto kTicks = []<std::size_t... i>(std::index_sequence<i...>) {
    return std::array<TickFunction, 2 * Scene::kWithEffects>{
        (i >= Scene::kWithEffects    ? &render_effects
         : i >= TickFeatures::kCount ? &render_motion
                                     : &tick::render_tick<Probe, TickFeatures::of(i)>)...};
  }
  (std::make_index_sequence<2 * Scene::kWithEffects>());
};

}  // namespace

const Renderer& point_renderer() {
  static const ProbeRenderer<tick::PointProbe> renderer;
  return renderer;
}

const Renderer& ray_renderer() {
  static const ProbeRenderer<tick::SegmentProbe> renderer;
  return renderer;
}

}  // namespace palpate::rendering
