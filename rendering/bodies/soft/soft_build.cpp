#include "rendering/bodies/soft/soft_build.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>
#include <numeric>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "stimuli/solids/gmsh_file.h"
#include "stimuli/solids/solid_mesh.h"

namespace palpate::rendering {
namespace {

constexpr double kShare = 0.25;                                  // of the time between two steps
constexpr std::array kRates{1000.0, 500.0, 250.0, 125.0, 62.5};  // Hz
// At a lower rate a body keeps swinging under a stiff spring or a thick tool, however long it is
// held; rendering/README.md has the map.
struct LeastRate {
  double below_young;       // Pa
  double damped, undamped;  // Hz
};
constexpr std::array kLeastRates{LeastRate{1e4, 400, 400}, LeastRate{2e4, 200, 200},
                                 LeastRate{1e6, 100, 200}};
constexpr double kHardlyDamped = 0.01;             // s; less than that
constexpr double kLeastFill = 20;                  // times nodes^(4/3), of solids as long as high
constexpr double kBase = 0.01, kBallBase = 0.1;    // of the height
constexpr double kShortest = 0.001, kLongest = 2;  // m, of an object
constexpr int kPlainResolution = 10;               // if a description gives none

stimuli::SolidMesh mesh_of(const stimuli::ObjectSpec& spec, int resolution) {
  if (spec.shape != stimuli::ShapeKind::mesh) return stimuli::mesh_of_primitive(spec, resolution);
  return stimuli::solid_of_file(spec);
}

[[noreturn]] void refuse(const std::string& fault) { throw stimuli::MeshError({fault}); }

/// Converts m to mm, s to ms.
std::string in_thousandths(double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), 1000 * value,
                                 std::chars_format::general, 4);
  return {text.data(), end.ptr};
}

/// m, the longest side of the nodes' bounding box.
double extent(const std::vector<Vec3>& nodes) {
  Vec3 low(std::numeric_limits<double>::infinity()), high = -low;
  for (const Vec3& p : nodes) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  return std::max({high.x - low.x, high.y - low.y, high.z - low.z});
}

void check_extent(const stimuli::SolidMesh& mesh) {
  const double longest = extent(mesh.nodes);
  if (longest >= kShortest && longest <= kLongest) return;
  refuse("/soft: the object is " + in_thousandths(longest) + " mm long; expected " +
         in_thousandths(kShortest) + " to " + in_thousandths(kLongest) + " mm (files are in m)");
}

/// Whether three of the nodes form a triangle: nodes on a line hold a body like a hinge.
bool span_a_plane(const std::vector<Vec3>& nodes, const std::vector<std::uint32_t>& which) {
  constexpr double kFlat = 1e-6;  // of the longest side's square
  if (which.size() < 3) return false;
  const Vec3& first = nodes[which[0]];
  const auto farther = [&](std::uint32_t a, std::uint32_t b) {
    return glm::distance(nodes[a], first) < glm::distance(nodes[b], first);
  };
  const Vec3 along = nodes[*std::max_element(which.begin(), which.end(), farther)] - first;
  return std::any_of(which.begin(), which.end(), [&](std::uint32_t i) {
    return glm::length(glm::cross(along, nodes[i] - first)) > kFlat * glm::dot(along, along);
  });
}

/// The lowest nodes, up to a share of the height or as high as needed to hold the body.
std::vector<std::uint32_t> base_of(const std::vector<Vec3>& nodes, double share) {
  std::vector<std::uint32_t> upwards(nodes.size());
  std::iota(upwards.begin(), upwards.end(), 0U);
  std::stable_sort(upwards.begin(), upwards.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return nodes[a].z < nodes[b].z; });
  const double low = nodes[upwards.front()].z, height = nodes[upwards.back()].z - low;
  std::vector<std::uint32_t> base;
  for (const std::uint32_t i : upwards) {
    const double rise = nodes[i].z - low;
    // Keep nodes of one height together, despite rounding.
    const bool level = !base.empty() && nodes[i].z <= nodes[base.back()].z + 1e-9 * height;
    if (rise > share * height && !level && span_a_plane(nodes, base)) break;
    base.push_back(i);
  }
  return base;
}

std::vector<std::uint32_t> fixed_nodes(const stimuli::ObjectSpec& spec,
                                       const stimuli::SolidMesh& mesh) {
  const std::vector<Vec3>& nodes = mesh.nodes;
  std::set<std::uint32_t> fixed;
  if (spec.soft->fixed == stimuli::Soft::Fixed::base) {
    const std::vector<std::uint32_t> base =
        base_of(nodes, spec.shape == stimuli::ShapeKind::sphere ? kBallBase : kBase);
    fixed.insert(base.begin(), base.end());
  }
  if (spec.soft->fixed == stimuli::Soft::Fixed::points) {
    // The side of an element that is as long as high.
    const double reach =
        extent(nodes) /
        std::cbrt(static_cast<double>(mesh.hexahedra.size() + mesh.tetrahedra.size()));
    for (std::size_t i = 0; i < spec.soft->points.size(); ++i) {
      const Vec3& point = spec.soft->points[i];
      const auto nearest =
          std::min_element(nodes.begin(), nodes.end(), [&](const Vec3& a, const Vec3& b) {
            return glm::distance(a, point) < glm::distance(b, point);
          });
      if (!(glm::distance(*nearest, point) <= reach)) {
        refuse("/soft/fixed/" + std::to_string(i) + ": the nearest node is " +
               in_thousandths(glm::distance(*nearest, point)) +
               " mm away; expected a point of the object, in m and its own frame");
      }
      fixed.insert(static_cast<std::uint32_t>(nearest - nodes.begin()));
    }
  }
  return {fixed.begin(), fixed.end()};
}

/// The rate of steps of a mesh with fixed nodes, or why it has none.
struct Rate {
  double rate = 0;    ///< Hz; 0: none
  std::string fault;  ///< without the place
};

/// Hz, the lowest rate at which the coupling is stable.
double least_rate(const SoftMaterial& material) {
  double least = kRates.front();
  for (const double rate : kRates) {
    if (coupling_is_stable(material, rate)) least = rate;
  }
  return least;
}

Rate rate_of(const stimuli::SolidMesh& mesh, const std::vector<std::uint32_t>& fixed,
             SoftSettings settings) {
  const std::size_t hexahedra = mesh.hexahedra.size(), tetrahedra = mesh.tetrahedra.size();
  const double least = least_rate(settings.material);
  const auto too_slow = [&](double cost) -> Rate {
    return {0, std::to_string(hexahedra + tetrahedra) + " elements take " + in_thousandths(cost) +
                   " ms a step; expected at most " + in_thousandths(kShare / least) +
                   " ms, a quarter of the time at " + in_thousandths(least / 1000) +
                   " Hz, the lowest rate at which such a material comes to rest under a tool"};
  };
  // No factor of so many nodes has fewer entries, so reject the largest meshes without computing
  // one.
  const double few = kLeastFill * std::pow(static_cast<double>(mesh.nodes.size()), 4.0 / 3);
  const double at_least = step_cost(hexahedra, tetrahedra, static_cast<std::size_t>(few));
  if (at_least > kShare / least) return too_slow(at_least);
  settings.compliance = false;
  const SoftBody trial(mesh, fixed, settings);  // to count the entries of its factor
  const double cost = step_cost(hexahedra, tetrahedra, trial.factor_entries());
  for (const double rate : kRates) {
    if (cost <= kShare / rate && coupling_is_stable(settings.material, rate)) return {rate, {}};
  }
  return too_slow(cost);
}

struct Meshed {
  stimuli::SolidMesh mesh;  ///< local frame
  std::vector<std::uint32_t> fixed;
  Rate rate;
};

Meshed mesh_at(const stimuli::ObjectSpec& spec, int resolution, const SoftSettings& settings) {
  Meshed out{mesh_of(spec, resolution), {}, {}};
  check_extent(out.mesh);
  out.fixed = fixed_nodes(spec, out.mesh);
  if (out.fixed.size() == out.mesh.nodes.size())
    refuse("/soft/fixed: expected at least one node free to move");
  out.rate = rate_of(out.mesh, out.fixed, settings);
  return out;
}

/// Meshes at the requested resolution; without one, at the highest up to kPlainResolution that has
/// a rate of steps.
Meshed meshed(const stimuli::ObjectSpec& spec, const SoftSettings& settings) {
  const bool is_file = spec.shape == stimuli::ShapeKind::mesh;
  const int asked = spec.soft->resolution;
  int resolution = asked > 0 ? asked : kPlainResolution;
  Meshed out = mesh_at(spec, resolution, settings);
  const std::string fault = out.rate.fault;
  while (out.rate.rate == 0 && !is_file && resolution > stimuli::kLeastResolution)
    out = mesh_at(spec, --resolution, settings);
  const bool found = out.rate.rate > 0;
  if (fault.empty() || (found && asked == 0)) return out;
  refuse((is_file ? "/soft: " : "/soft/resolution: ") + fault + ": " +
         (!found ? "expected fewer elements or a stiffer material"
                 : "expected a resolution of at most " + std::to_string(resolution) +
                       " or a stiffer material"));
}

}  // namespace

bool coupling_is_stable(const SoftMaterial& material, double rate) {
  for (const LeastRate& least : kLeastRates) {
    if (material.young < least.below_young)
      return rate >= (material.damping < kHardlyDamped ? least.undamped : least.damped);
  }
  return true;
}

double step_cost(std::size_t hexahedra, std::size_t tetrahedra, std::size_t factor_entries) {
  return 2 * (7e-7 * static_cast<double>(hexahedra) + 5e-7 * static_cast<double>(tetrahedra) +
              1e-9 * static_cast<double>(factor_entries));
}

std::shared_ptr<const SoftObject> build_soft_object(const stimuli::ObjectSpec& spec,
                                                    const Pose& pose, const SoftTouch& touch) {
  const stimuli::Soft& soft = *spec.soft;
  SoftSettings settings{.material = {soft.young, soft.poisson, soft.density, soft.damping},
                        .gravity = touch.gravity};
  try {
    Meshed found = meshed(spec, settings);
    for (Vec3& node : found.mesh.nodes) node = pose.orientation * node + pose.position;
    settings.step = 1 / found.rate.rate;
    return std::make_shared<const SoftObject>(
        std::make_shared<const SoftBody>(std::move(found.mesh), found.fixed, settings),
        SoftContactSettings{.radius = touch.radius, .stiffness = spec.material.stiffness},
        touch.object);
  } catch (const std::invalid_argument& error) {
    refuse(std::string("/soft: ") + error.what());
  }
}

}  // namespace palpate::rendering
