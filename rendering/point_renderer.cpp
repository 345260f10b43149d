#include "rendering/render.h"
#include "rendering/renderer.h"

namespace palpate {
namespace {

/// The probe shrunk to its tip.
struct PointProbe {
  static constexpr bool kSegment = false;

  static Approach approach(const ConvexMesh& mesh, MinkowskiFacet start, const LineProbe& before,
                           const LineProbe& after) {
    return approach_point(mesh, start, before, after);
  }

  static FirstContact first_contact(const ConvexMesh& mesh, const ContactTrees& trees,
                                    const LineProbe& before, const LineProbe& after,
                                    double tolerance) {
    return first_contact_point(mesh, trees, before.tip, after.tip, tolerance);
  }

  static void describe(const ConvexMesh&, const WalkResult&, const Vec3&, const Vec3&, double,
                       LoadedContact& c) {
    c.contact.type = ContactType::point_polygon;
  }
};

class PointRenderer final : public Renderer {
 public:
  const char* name() const override { return "point"; }
  bool side_contact() const override { return false; }
  Rendering tick(const Scene& scene, RenderState& state, const LineProbe& probe,
                 double dt) const noexcept override {
    return tick::render<PointProbe>(scene, state, probe, dt);
  }
};

}  // namespace

const Renderer& point_renderer() {
  static const PointRenderer renderer;
  return renderer;
}

}  // namespace palpate
