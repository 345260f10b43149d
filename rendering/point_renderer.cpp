#include "rendering/point_probe.h"
#include "rendering/render.h"
#include "rendering/renderer.h"

namespace palpate::rendering {
namespace {

class PointRenderer final : public Renderer {
 public:
  const char* name() const override { return "point"; }
  bool side_contact() const override { return false; }
  Rendering tick(const Scene& scene, RenderState& state, const LineProbe& probe,
                 double dt) const noexcept override {
    return tick::render<tick::PointProbe>(scene, state, probe, dt);
  }
};

}  // namespace

const Renderer& point_renderer() {
  static const PointRenderer renderer;
  return renderer;
}

}  // namespace palpate::rendering
