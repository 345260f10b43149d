#include "rendering/bodies/soft/soft_contact.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <utility>
#include <vector>

#include "rendering/bodies/soft/segment_triangle.h"

namespace palpate::rendering {
namespace {

constexpr double kBehind = 0.5;    // of the radius; deeper points are another side's
constexpr double kSettled = 1e-7;  // of the largest force; stop after a smaller change
constexpr std::uint32_t kEndKey = 0x80000000;

class Search {
 public:
  Search(const SoftMoment& moment, const SoftContactSettings& settings, const Vec3& tip,
         const PlacedTool& tool, double step, SoftContactMemory& memory)
      : moment_(moment),
        settings_(settings),
        tip_(tip),
        tool_(tool),
        margin_(step + 0.25 * settings.radius),
        surface_(1.2 * memory.moved),
        memory_(memory) {
    memory_.found.clear();
    memory_.local.clear();
    memory_.dropped = false;
    memory_.moved = 0;
  }

  void run() {
    for (std::size_t s = 0; s < tool_.count; ++s) {
      const PlacedSegment& placed = tool_.segments[s];
      const Segment axis{tip_ + memory_.shift + placed.from, placed.along};
      const double reach = settings_.radius + margin_ + surface_;
      const Vec3 end = axis.from + axis.along;
      const Vec3 low = glm::min(axis.from, end) - Vec3(reach);
      const Vec3 high = glm::max(axis.from, end) + Vec3(reach);
      const auto& boxes = moment_.view.boxes;
      for (std::size_t c = 0; c < boxes.size(); ++c) {
        if (boxes[c].low.x > high.x || boxes[c].low.y > high.y || boxes[c].low.z > high.z ||
            boxes[c].high.x < low.x || boxes[c].high.y < low.y || boxes[c].high.z < low.z)
          continue;
        look_at(moment_.surface.clusters()[c], static_cast<int>(s), axis);
      }
    }
  }

 private:
  const SoftContactMemory::Node& node(std::uint32_t index) {
    std::uint32_t& slot = memory_.slot[index];
    if (slot < memory_.local.size() && memory_.local[slot].node == index)
      return memory_.local[slot];
    slot = static_cast<std::uint32_t>(memory_.local.size());
    const SoftView& view = moment_.view;
    const Vec3 base = view.x[index] + moment_.fraction * view.ahead[index] - view.by_load[index];
    Vec3 by_force(0);
    for (const NodeForce& f : memory_.forces)
      by_force += multiply(moment_.body.compliance(index, f.surface_node), f.force);
    memory_.moved = std::max(memory_.moved, glm::distance(by_force, view.by_load[index]));
    memory_.local.push_back({index, base, base + by_force});
    return memory_.local.back();
  }

  static Vec3 multiply(const float* m, const Vec3& v) {
    return {m[0] * v.x + m[1] * v.y + m[2] * v.z, m[3] * v.x + m[4] * v.y + m[5] * v.z,
            m[6] * v.x + m[7] * v.y + m[8] * v.z};
  }

  void look_at(const SoftSurface::Cluster& cluster, int segment, const Segment& axis) {
    for (std::uint32_t e = cluster.first_edge; e < cluster.first_edge + cluster.edges; ++e) {
      const SoftSurface::Edge& edge = moment_.surface.edges()[e];
      const Vec3 a = node(edge.nodes[0]).now, b = node(edge.nodes[1]).now;
      const NearestOnSegments at = nearest_on_segments(axis, {a, b - a});
      // A corner belongs to the edge that owns it.
      if ((at.other <= 0 && !edge.owns[0]) || (at.other >= 1 && !edge.owns[1])) continue;
      SoftContact contact;
      contact.key = e | static_cast<std::uint32_t>(segment) << 24;
      contact.nodes = {edge.nodes[0], edge.nodes[1], 0};
      contact.weights = {1 - at.other, at.other, 0};
      contact.count = 2;
      const Vec3 outward =
          moment_.view.normals[edge.triangles[0]] + moment_.view.normals[edge.triangles[1]];
      consider(contact, segment, axis, at.own, a + at.other * (b - a), outward);
    }
    for (std::uint32_t t = cluster.first_triangle; t < cluster.first_triangle + cluster.triangles;
         ++t) {
      for (const double along : {0.0, 1.0}) {
        if (along > 0 && axis.along == Vec3(0)) continue;
        look_at_triangle(t, segment, axis, along);
      }
    }
  }

  void look_at_triangle(std::uint32_t t, int segment, const Segment& axis, double along) {
    const auto& nodes = moment_.surface.triangles()[t];
    const Vec3 a = node(nodes[0]).now, b = node(nodes[1]).now, c = node(nodes[2]).now;
    SoftContact contact;
    if (!foot_in_triangle(axis.from + along * axis.along, a, b, c, contact.weights)) return;
    contact.key = kEndKey | t | static_cast<std::uint32_t>(2 * segment + (along > 0)) << 24;
    contact.nodes = nodes;
    contact.count = 3;
    consider(contact, segment, axis, along,
             contact.weights[0] * a + contact.weights[1] * b + contact.weights[2] * c,
             moment_.view.normals[t]);
  }

  void consider(SoftContact& contact, int segment, const Segment& axis, double along,
                const Vec3& place, const Vec3& outward) {
    const Vec3 on_axis = axis.from + along * axis.along;
    const Vec3 off = on_axis - place;
    const double distance = glm::length(off), radius = settings_.radius;
    if (distance > radius + margin_) return;
    // A known contact keeps the tool's side, so that a fold of the surface does not push the tool
    // across. A new contact begins from outside: from within, it is ignored unless its nodes are
    // fixed, as on a table.
    const SoftContact* const known = last(contact.key);
    bool behind = glm::dot(off, known != nullptr ? known->normal : outward) < 0;
    if (known == nullptr && behind) {
      if (!is_held(contact)) return;
      behind = false;
    }
    if (behind && distance > kBehind * radius) return;
    if (distance > 1e-6 * radius) {
      contact.normal = off / (behind ? -distance : distance);
    } else if (known != nullptr) {
      contact.normal = known->normal;
    } else {
      const double length = glm::length(outward);
      if (!(length > 0)) return;
      contact.normal = outward / length;
    }
    contact.now = (behind ? -distance : distance) - radius;
    contact.segment = segment;
    contact.along = along;
    contact.axis_point = on_axis - memory_.shift;
    keep(contact);
  }

  /// From the last tick; null: new.
  const SoftContact* last(std::uint32_t key) const {
    for (const SoftContact& contact : memory_.contacts) {
      if (contact.key == key) return &contact;
    }
    return nullptr;
  }

  bool is_held(const SoftContact& contact) const {
    for (std::uint32_t a = 0; a < contact.count; ++a) {
      if (!moment_.body.is_fixed(moment_.body.surface_nodes()[contact.nodes[a]])) return false;
    }
    return true;
  }

  void keep(const SoftContact& contact) {
    if (memory_.found.size() < settings_.most) {
      memory_.found.push_back(contact);
      return;
    }
    memory_.dropped = true;
    const auto farthest =
        std::max_element(memory_.found.begin(), memory_.found.end(),
                         [](const auto& a, const auto& b) { return a.now < b.now; });
    if (contact.now < farthest->now) *farthest = contact;
  }

  const SoftMoment& moment_;
  const SoftContactSettings& settings_;
  const Vec3& tip_;
  const PlacedTool& tool_;
  const double margin_;   // m; contacts may arise within this distance in a tick
  const double surface_;  // m; forces may move the surface this far from the view
  SoftContactMemory& memory_;
};

/// m/N; opening of contact i by a force at contact j.
double opening(const SoftBody& body, const SoftContact& i, const SoftContact& j, double spring) {
  double sum = spring * glm::dot(i.normal, j.normal);
  for (std::uint32_t a = 0; a < i.count; ++a) {
    for (std::uint32_t b = 0; b < j.count; ++b) {
      const float* const m = body.compliance(i.nodes[a], j.nodes[b]);
      const Vec3 moved(m[0] * j.normal.x + m[1] * j.normal.y + m[2] * j.normal.z,
                       m[3] * j.normal.x + m[4] * j.normal.y + m[5] * j.normal.z,
                       m[6] * j.normal.x + m[7] * j.normal.y + m[8] * j.normal.z);
      sum += i.weights[a] * j.weights[b] * glm::dot(i.normal, moved);
    }
  }
  return sum;
}

void prepare(const SoftBody& body, double spring, SoftContactMemory& memory) {
  std::vector<SoftContact>& found = memory.found;
  for (SoftContact& contact : found) {
    Vec3 base(0);
    for (std::uint32_t a = 0; a < contact.count; ++a)
      base += contact.weights[a] * memory.local[memory.slot[contact.nodes[a]]].base;
    // Along the normal, the axis is one radius plus the gap away from the surface.
    Vec3 now(0);
    for (std::uint32_t a = 0; a < contact.count; ++a)
      now += contact.weights[a] * memory.local[memory.slot[contact.nodes[a]]].now;
    contact.gap = contact.now + glm::dot(contact.normal, now - base - memory.shift);
    for (const SoftContact& old : memory.contacts) {
      if (old.key == contact.key) contact.force = old.force;
    }
  }
  for (std::size_t i = 0; i < found.size(); ++i) {
    for (std::size_t j = i; j < found.size(); ++j) {
      memory.matrix[i * found.size() + j] = memory.matrix[j * found.size() + i] =
          opening(body, found[i], found[j], spring);
    }
  }
}

void solve_contacts(std::vector<SoftContact>& found, const std::vector<double>& matrix,
                    int sweeps) {
  const std::size_t n = found.size();
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    double changed = 0, largest = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const double* const row = matrix.data() + i * n;
      double gap = found[i].gap;
      for (std::size_t j = 0; j < n; ++j) gap += row[j] * found[j].force;
      const double force = std::max(0.0, found[i].force - gap / row[i]);
      changed = std::max(changed, std::abs(force - found[i].force));
      largest = std::max(largest, force);
      found[i].force = force;
    }
    if (changed <= kSettled * largest) return;
  }
}

void add_node_forces(SoftContactMemory& memory) {
  memory.forces.clear();
  for (const SoftContact& contact : memory.found) {
    if (!(contact.force > 0)) continue;
    for (std::uint32_t a = 0; a < contact.count; ++a) {
      const Vec3 force = -contact.weights[a] * contact.force * contact.normal;
      const auto same =
          std::find_if(memory.forces.begin(), memory.forces.end(),
                       [&](const NodeForce& f) { return f.surface_node == contact.nodes[a]; });
      if (same != memory.forces.end()) {
        same->force += force;
      } else {
        memory.forces.push_back({contact.nodes[a], force});
      }
    }
  }
}

}  // namespace

SoftContactMemory::SoftContactMemory(const SoftBody& body, const SoftContactSettings& settings) {
  contacts.reserve(settings.most);
  found.reserve(settings.most);
  forces.reserve(3 * settings.most);
  local.reserve(body.surface_nodes().size());
  slot.assign(body.surface_nodes().size(), 0);
  matrix.resize(settings.most * settings.most);
}

Vec3 follow_surface(const SoftMoment& moment, const SoftContactSettings& settings, const Vec3& tip,
                    const PlacedTool& tool, double step, SoftContactMemory& memory) noexcept {
  Search(moment, settings, tip, tool, step, memory).run();
  const double spring = 1 / settings.stiffness;
  prepare(moment.body, spring, memory);
  solve_contacts(memory.found, memory.matrix, settings.sweeps);
  Vec3 force(0);
  for (const SoftContact& contact : memory.found) force += contact.force * contact.normal;
  if (!std::isfinite(force.x + force.y + force.z)) {
    memory.found.clear();
    force = Vec3(0);
  }
  add_node_forces(memory);
  memory.shift = spring * force;
  std::swap(memory.contacts, memory.found);
  return force;
}

bool is_inside(const SoftMoment& moment, double radius, const Vec3& tip,
               const PlacedTool& tool) noexcept {
  for (std::size_t s = 0; s < tool.count; ++s) {
    const Segment axis{tip + tool.segments[s].from, tool.segments[s].along};
    double turns = 0;  // solid angle of the surface, seen from the segment's start
    for (const auto& [i, j, k] : moment.surface.triangles()) {
      const auto& x = moment.view.x;
      if (distance_to_triangle(axis, x[i], x[j], x[k]) < radius) return true;
      turns += solid_angle(axis.from, x[i], x[j], x[k]);
    }
    if (turns > 6) return true;  // 4 pi inside, 0 outside
  }
  return false;
}

}  // namespace palpate::rendering
