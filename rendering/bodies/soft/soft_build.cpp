#include "rendering/bodies/soft/soft_build.h"

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

#include "stimuli/input_file.h"
#include "stimuli/solids/gmsh_file.h"
#include "stimuli/solids/solid_mesh.h"

namespace palpate::rendering {
namespace {

constexpr double kShare = 0.25;                                  // of the time between two steps
constexpr std::array kRates{1000.0, 500.0, 250.0, 125.0, 62.5};  // Hz
// A soft body at the lowest rate swings under a thick tool with a stiff spring (a tenth of the
// force at 62.5 Hz and 10 kPa): rendering/README.md has the map.
constexpr double kLowRate = 100;                 // Hz
constexpr double kLowRateYoung = 1e5;            // Pa
constexpr std::size_t kMostSoftNodes = 6000;     // beyond it building takes minutes
constexpr double kBase = 0.01, kBallBase = 0.1;  // of the height

stimuli::SolidMesh mesh_of(const stimuli::ObjectSpec& spec) {
  if (spec.shape != stimuli::ShapeKind::mesh)
    return stimuli::mesh_of_primitive(spec, spec.soft->resolution);
  return stimuli::read_gmsh(
      spec.file, spec.file_bytes ? *spec.file_bytes : stimuli::read_whole(spec.file, 1U << 31));
}

std::vector<std::uint32_t> fixed_nodes(const stimuli::ObjectSpec& spec,
                                       const std::vector<Vec3>& nodes) {
  std::set<std::uint32_t> fixed;
  if (spec.soft->fixed == stimuli::Soft::Fixed::base) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const Vec3& p : nodes) {
      low = std::min(low, p.z);
      high = std::max(high, p.z);
    }
    const double share = spec.shape == stimuli::ShapeKind::sphere ? kBallBase : kBase;
    for (std::uint32_t i = 0; i < nodes.size(); ++i) {
      if (nodes[i].z <= low + share * (high - low)) fixed.insert(i);
    }
  }
  if (spec.soft->fixed == stimuli::Soft::Fixed::points) {
    for (const Vec3& point : spec.soft->points) {
      const auto nearest =
          std::min_element(nodes.begin(), nodes.end(), [&](const Vec3& a, const Vec3& b) {
            return glm::distance(a, point) < glm::distance(b, point);
          });
      fixed.insert(static_cast<std::uint32_t>(nearest - nodes.begin()));
    }
  }
  return {fixed.begin(), fixed.end()};
}

[[noreturn]] void refuse(const std::string& fault) { throw stimuli::MeshError({fault}); }

SoftBody body_of(const stimuli::SolidMesh& mesh, const std::vector<std::uint32_t>& fixed,
                 SoftSettings settings) {
  const std::size_t hexahedra = mesh.hexahedra.size(), tetrahedra = mesh.tetrahedra.size();
  settings.compliance = false;
  const SoftBody trial(mesh, fixed, settings);  // to count the entries of its factor
  const double cost = step_cost(hexahedra, tetrahedra, trial.factor_entries());
  const auto rate =
      std::find_if(kRates.begin(), kRates.end(), [&](double r) { return cost <= kShare / r; });
  if (rate == kRates.end()) {
    refuse("/soft: " + std::to_string(hexahedra + tetrahedra) + " elements take " +
           std::to_string(1000 * cost) + " ms a step; expected at most " +
           std::to_string(1000 * kShare / kRates.back()) +
           " ms, a quarter of the time at 62.5 Hz: a lower resolution");
  }
  if (*rate < kLowRate && settings.material.young < kLowRateYoung) {
    refuse(
        "/soft: " + std::to_string(hexahedra + tetrahedra) + " elements leave time for " +
        std::to_string(static_cast<int>(*rate)) +
        " steps a second, at which less than 100000 Pa may swing; expected a lower resolution or "
        "a stiffer material");
  }
  settings.step = 1 / *rate;
  settings.compliance = true;
  return {mesh, fixed, settings};
}

}  // namespace

double step_cost(std::size_t hexahedra, std::size_t tetrahedra, std::size_t factor_entries) {
  return 2 * (8e-7 * static_cast<double>(hexahedra) + 6e-7 * static_cast<double>(tetrahedra) +
              2.5e-9 * static_cast<double>(factor_entries));
}

std::shared_ptr<const SoftObject> build_soft_object(const stimuli::ObjectSpec& spec,
                                                    const Pose& pose, const SoftTouch& touch) {
  stimuli::SolidMesh mesh = mesh_of(spec);
  if (mesh.nodes.size() > kMostSoftNodes) {
    refuse("/soft: " + std::to_string(mesh.nodes.size()) + " nodes; expected at most " +
           std::to_string(kMostSoftNodes) + ": a lower resolution");
  }
  const std::vector<std::uint32_t> fixed = fixed_nodes(spec, mesh.nodes);
  if (fixed.size() == mesh.nodes.size()) refuse("/soft/fixed: expected something left to move");
  for (Vec3& node : mesh.nodes) node = pose.orientation * node + pose.position;
  const stimuli::Soft& soft = *spec.soft;
  const SoftSettings settings{.material = {soft.young, soft.poisson, soft.density, soft.damping},
                              .gravity = touch.gravity};
  try {
    auto body = std::make_shared<const SoftBody>(body_of(mesh, fixed, settings));
    return std::make_shared<const SoftObject>(
        std::move(body),
        SoftContactSettings{.radius = touch.radius, .stiffness = spec.material.stiffness},
        touch.object);
  } catch (const std::invalid_argument& error) {
    refuse(std::string("/soft: ") + error.what());
  }
}

}  // namespace palpate::rendering
