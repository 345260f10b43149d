#include "rendering/render.h"
#include "rendering/renderer.h"
#include "rendering/segment_probe.h"

namespace palpate::rendering {
namespace {

class RayRenderer final : public Renderer {
 public:
  const char* name() const override { return "ray"; }
  bool side_contact() const override { return true; }
  Rendering tick(const Scene& scene, RenderState& state, const LineProbe& probe,
                 double dt) const noexcept override {
    return tick::render<tick::SegmentProbe>(scene, state, probe, dt);
  }
};

}  // namespace

const Renderer& ray_renderer() {
  static const RayRenderer renderer;
  return renderer;
}

}  // namespace palpate::rendering
