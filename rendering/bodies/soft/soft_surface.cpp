#include "rendering/bodies/soft/soft_surface.h"

#include <algorithm>
#include <cstddef>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <map>
#include <numeric>
#include <utility>

namespace palpate::rendering {
namespace {

constexpr std::size_t kClusterTriangles = 16;

/// Halves a list of items with places along their longest extent.
void halve(std::vector<std::uint32_t>& order, std::size_t from, std::size_t to,
           const std::vector<Vec3>& places, std::vector<std::size_t>& ends) {
  if (to - from <= kClusterTriangles) {
    ends.push_back(to);
    return;
  }
  stimuli::Box box;
  for (std::size_t i = from; i < to; ++i) box.add(places[order[i]]);
  const Vec3 size = box.high - box.low;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : (size.y >= size.z ? 1 : 2);
  std::stable_sort(
      order.begin() + static_cast<std::ptrdiff_t>(from),
      order.begin() + static_cast<std::ptrdiff_t>(to),
      [&](std::uint32_t a, std::uint32_t b) { return places[a][axis] < places[b][axis]; });
  const std::size_t middle = from + (to - from) / 2;
  halve(order, from, middle, places, ends);
  halve(order, middle, to, places, ends);
}

}  // namespace

SoftSurface::SoftSurface(const SoftBody& body) {
  const auto& surface = body.surface();
  std::vector<Vec3> places;
  places.reserve(surface.size());
  for (const stimuli::SolidFace& t : surface) {
    places.push_back((body.mesh().nodes[t[0]] + body.mesh().nodes[t[1]] + body.mesh().nodes[t[2]]) /
                     3.0);
  }
  std::vector<std::uint32_t> order(surface.size());
  std::iota(order.begin(), order.end(), 0U);
  std::vector<std::size_t> ends;
  halve(order, 0, order.size(), places, ends);
  for (const std::uint32_t t : order) {
    triangles_.push_back({body.surface_index(surface[t][0]), body.surface_index(surface[t][1]),
                          body.surface_index(surface[t][2])});
  }
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> known;
  std::vector<bool> owned(body.surface_nodes().size(), false);
  std::uint32_t first = 0;
  for (const std::size_t end : ends) {
    Cluster cluster{first, static_cast<std::uint32_t>(end) - first,
                    static_cast<std::uint32_t>(edges_.size()), 0};
    for (std::uint32_t t = first; t < end; ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = triangles_[t][k], b = triangles_[t][(k + 1) % 3];
        const auto [found, is_new] = known.try_emplace(std::minmax(a, b), edges_.size());
        if (!is_new) {
          edges_[found->second].triangles[1] = t;
          continue;
        }
        edges_.push_back({{a, b}, {t, t}, {!owned[a], !owned[b]}});
        owned[a] = owned[b] = true;
      }
    }
    cluster.edges = static_cast<std::uint32_t>(edges_.size()) - cluster.first_edge;
    clusters_.push_back(cluster);
    first = static_cast<std::uint32_t>(end);
  }
}

SoftView SoftSurface::first_view(const SoftBody& body, const SoftState& state) const {
  SoftView view;
  for (auto* const field : {&view.x, &view.ahead, &view.by_load})
    field->resize(body.surface_nodes().size());
  view.normals.resize(triangles_.size());
  view.boxes.resize(clusters_.size());
  look(body, state, view);
  return view;
}

void SoftSurface::look(const SoftBody& body, const SoftState& state,
                       SoftView& view) const noexcept {
  const auto& nodes = body.surface_nodes();
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    view.x[i] = state.x[nodes[i]];
    view.ahead[i] = state.ahead[nodes[i]];
    view.by_load[i] = state.by_load[nodes[i]];
  }
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    const auto& [a, b, c] = triangles_[t];
    const Vec3 normal = glm::cross(view.x[b] - view.x[a], view.x[c] - view.x[a]);
    const double length = glm::length(normal);
    view.normals[t] = length > 0 ? normal / length : Vec3(0);
  }
  for (std::size_t c = 0; c < clusters_.size(); ++c) {
    stimuli::Box box;
    const auto add = [&](std::uint32_t node) {
      box.add(view.x[node]);
      box.add(view.x[node] + 2.0 * view.ahead[node]);
    };
    const Cluster& of = clusters_[c];
    for (std::uint32_t t = of.first_triangle; t < of.first_triangle + of.triangles; ++t) {
      for (const std::uint32_t node : triangles_[t]) add(node);
    }
    view.boxes[c] = box;
  }
}

}  // namespace palpate::rendering
