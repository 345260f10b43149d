#include "runner/layer_surfaces.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <sstream>
#include <utility>

namespace palpate::runner {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();  // N

std::string key_of(const std::vector<LayeredShape>& all, const LayerSurfaces::Wanted& wanted) {
  std::ostringstream key;
  key.precision(17);
  key << wanted.layer.depth;
  for (const LayeredShape& shape : all) {
    const bool own = std::ranges::find(wanted.shapes, shape.spec) != wanted.shapes.end();
    const auto& [p, q] = shape.pose;
    key << ' ' << own << ' ' << shape.key << ' ' << p.x << ' ' << p.y << ' ' << p.z << ' ' << q.w
        << ' ' << q.x << ' ' << q.y << ' ' << q.z;
  }
  return key.str();
}

}  // namespace

const LayerSurfaces::Made& LayerSurfaces::make(const std::vector<LayeredShape>& all,
                                               const Wanted& wanted) {
  const std::string key = key_of(all, wanted);
  if (const auto known = made_.find(key); known != made_.end()) return known->second;
  std::vector<stimuli::PlacedShell> whole, own;
  for (const LayeredShape& shape : all) {
    whole.push_back({shape.surface.get(), shape.pose});
    if (std::ranges::find(wanted.shapes, shape.spec) != wanted.shapes.end())
      own.push_back(whole.back());
  }
  const stimuli::SolidDepth solid(whole);
  std::optional<stimuli::SolidDepth> part;
  if (own.size() < whole.size()) part.emplace(own);
  const stimuli::SolidDepth* const within = part ? &*part : nullptr;
  stimuli::LayerSurface layer = stimuli::layer_surface(solid, wanted.layer.depth, within);
  Made made;
  if (layer.surface.triangles.empty() || layer.error > wanted.layer.depth)
    made.deepest = stimuli::deepest_layer(solid, within);
  if (!layer.surface.triangles.empty()) {
    made.error = layer.error;
    made.surface = std::make_shared<const stimuli::ClosedSurface>(std::move(layer.surface));
  }
  return made_.emplace(key, std::move(made)).first->second;
}

LayerShells::Shells& LayerShells::of(int number, double break_force) {
  const auto known = std::ranges::find_if(all_, [&](const Shells& shells) {
    return shells.number == number && shells.break_force == break_force;
  });
  if (known != all_.end()) return *known;
  return all_.emplace_back(Shells{number, break_force, {}, {}});
}

void LayerShells::add(const LayerSurfaces::Wanted& wanted, int object,
                      std::shared_ptr<const stimuli::ClosedSurface> surface) {
  stimuli::Material material;
  material.stiffness = wanted.layer.stiffness;
  material.damping = wanted.layer.damping;
  Shells& shells = of(wanted.number, wanted.layer.break_force.value_or(kNever));
  shells.shells.push_back({std::move(surface), Pose{}, std::move(material)});
  shells.objects.push_back(object);
}

void LayerShells::add_bound(const LayeredShape& shape) {
  stimuli::Material material;
  material.stiffness = 0;
  Shells& shells = of(rendering::kNotFelt, kNever);
  shells.shells.push_back({shape.surface, shape.pose, std::move(material)});
  shells.objects.push_back(shape.object);
}

std::vector<rendering::SceneSurface> LayerShells::surfaces(const Pose& pose, int solid) const {
  std::vector<rendering::SceneSurface> out;
  for (const Shells& shells : all_) {
    out.push_back({std::make_shared<const stimuli::Surface>(shells.shells), pose, solid,
                   shells.objects, shells.number, shells.break_force});
  }
  std::ranges::stable_sort(out, {}, &rendering::SceneSurface::layer);
  return out;
}

}  // namespace palpate::runner
