#include "rendering/bodies/soft/soft_scene.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

#include "rendering/probe.h"
#include "rendering/renderer.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/solids/solid_mesh.h"

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

constexpr double kEarly = 1e-9;        // s; sums of ticks fall short of a step by rounding
constexpr double kFarthestAhead = 2;   // steps beyond the view, covered by clusters' boxes
constexpr double kFarthestNode = 1e3;  // m

void add_impulse(SoftObjectState& state, double dt) {
  for (const NodeForce& f : state.contact.forces) {
    Vec3& impulse = state.impulse[f.surface_node];
    if (impulse == Vec3(0)) state.impelled.push_back(f.surface_node);
    impulse += dt * f.force;
    if (impulse == Vec3(0)) state.impelled.pop_back();
  }
}

/// Requests a step with the mean force since the last one.
void ask_for_step(SoftObjectState& state) {
  state.mean.clear();
  for (const std::uint32_t node : state.impelled) {
    state.mean.push_back({node, state.impulse[node] / state.since_step});
    state.impulse[node] = Vec3(0);
  }
  state.impelled.clear();
  state.since_step = 0;
  state.waiting = true;
  if (state.stepper != nullptr) state.stepper->ask(state.mean);
}

void take_step(const SoftObject& object, SoftObjectState& state) {
  const bool good = state.stepper != nullptr
                        ? state.stepper->take(state.view)
                        : step_and_look(object, state.body, state.mean, state.view);
  state.failed = state.failed || !good;
  state.view_age = state.since_step;
  state.waiting = false;
}

/// Takes a due step if one may arrive in this tick.
void take_due_step(const SoftObject& object, SoftObjectState& state) {
  if (state.pace == SoftPace::hold || !state.waiting || !step_is_due(object, state, 0)) return;
  take_step(object, state);
  if (state.pace == SoftPace::this_tick) state.pace = SoftPace::hold;
}

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

constexpr double kLongestTick = 0.001;   // s; longer ticks are split, with the hand moving evenly
constexpr double kStride = 0.5;          // of the radius; the tool's motion in a piece of a tick
constexpr int kMostPieces = 10'000;      // a gap of more than 10 s in a path counts as 10 s
constexpr int kMostPiecesOfServo = 256;  // the servo gets at most one step a tick
constexpr double kFarthestPose = 1e6;    // m; a reading beyond it is a fault, as for other objects

class SoftMotionState final : public MotionState {
 public:
  RenderState others;
  std::vector<SoftObjectState> soft;
  ToolPose last;
  bool has_last = false, by_tick = false, hold = false;

  std::unique_ptr<MotionState> clone() const override {
    auto copy = std::make_unique<SoftMotionState>(*this);
    for (std::size_t i = 0; i < soft.size(); ++i) {
      copy->soft[i].stepper = nullptr;
      keep_room(soft[i], copy->soft[i]);
    }
    return copy;
  }
  std::span<const BodyPose> bodies() const override { return others.motion.bodies(); }
};

bool is_pose(const Vec3& v) { return glm::dot(v, v) <= kFarthestPose * kFarthestPose; }

/// m, motion of the tool's segments from one pose to the other, at most.
double way(const PlacedTool& from, const Vec3& tip, const PlacedTool& to, const Vec3& to_tip) {
  double most = 0;
  for (std::size_t k = 0; k < from.count; ++k) {
    const Vec3 start = to_tip + to.segments[k].from - tip - from.segments[k].from;
    const Vec3 end = start + to.segments[k].along - from.segments[k].along;
    most = std::max({most, glm::length(start), glm::length(end)});
  }
  return most;
}

/// Adds the contacts of one soft object to a rendering.
void add_contacts(const SoftObject& object, const SoftObjectState& state, const ToolPose& tool,
                  bool sides, bool has_tool, Rendering& r) {
  const SoftContact* strongest = nullptr;
  const double length = sides ? glm::length(tool.d) : 0;
  const Vec3 axis = length > 0 ? tool.d / length : Vec3(0);
  Vec3 force(0), torque(0), device2(0);
  for (const SoftContact& c : state.contact.contacts) {
    if (!(c.force > 0)) continue;
    const Vec3 lever = c.axis_point + state.contact.shift - tool.tip, own = c.force * c.normal;
    force += own;
    ++r.contacts;
    if (sides) torque += glm::cross(lever, own);
    if (length > 0) device2 += glm::dot(lever, axis) / length * glm::dot(own, axis) * axis;
    if (strongest == nullptr || c.force > strongest->force) strongest = &c;
  }
  if (state.contact.dropped) r.faults |= render_fault::kContactsDropped;
  if (state.off) r.faults |= render_fault::kStartedInside;
  if (strongest == nullptr) return;
  if (length > 0) device2 += glm::cross(torque, axis) / length;
  r.force += force;
  r.torque += torque;
  r.device2 += device2;
  r.device1 += force - device2;
  const double depth = glm::length(state.contact.shift);
  if (r.object >= 0 && r.deepest.depth >= depth) return;
  const bool at_end = strongest->along <= 0 || strongest->along >= 1;
  r.deepest.point = strongest->axis_point + state.contact.shift;
  r.deepest.normal = depth > 0 ? state.contact.shift / depth : strongest->normal;
  r.deepest.depth = depth;
  r.deepest.along = sides ? glm::dot(r.deepest.point - tool.tip - state.contact.shift, axis) : 0;
  r.deepest.type = at_end || !sides ? ContactType::point_polygon : ContactType::segment_edge;
  r.ideal = {tool.tip + state.contact.shift, tool.tip + tool.d + state.contact.shift};
  r.object = object.object;
  if (has_tool) r.segment = strongest->segment;
}

class SoftMotion final : public SceneMotion {
 public:
  SoftMotion(Scene others, std::vector<std::shared_ptr<const SoftObject>> soft)
      : others_(std::move(others)), soft_(std::move(soft)) {}

  const std::vector<std::shared_ptr<const SoftObject>>& soft() const { return soft_; }

  std::unique_ptr<MotionState> initial_state() const override {
    auto state = std::make_unique<SoftMotionState>();
    state->others = others_.initial_state();
    state->soft.reserve(soft_.size());  // growth would copy them without their capacity
    for (const auto& object : soft_) state->soft.push_back(rendering::initial_state(*object));
    return state;
  }

  Rendering tick(const Renderer& renderer, RenderState& outer, const LineProbe& probe,
                 double dt) const noexcept override {
    auto& state = static_cast<SoftMotionState&>(*outer.motion.get());
    if (!is_pose(probe.tip) || !is_pose(probe.tail) || !is_pose(outer.measured_side) ||
        !std::isfinite(dt)) {
      Rendering none;
      none.ideal = outer.last;
      none.faults = render_fault::kNonFinite;
      return none;
    }
    state.others.measured_side = outer.measured_side;
    Rendering result;
    result.ideal = probe;
    if (!others_.parts().empty() || others_.motion() != nullptr)
      result = renderer.tick(others_, state.others, probe, dt);
    const bool sides = renderer.side_contact();
    const Tool* const tool = others_.tool();
    ToolPose pose{probe.tip, probe.tail - probe.tip};
    if (tool != nullptr)
      pose.frame =
          tool_frame(pose.d, state.has_last ? &state.last.frame : nullptr, outer.measured_side);
    if (state.by_tick) result.faults |= pace(state, std::max(0.0, dt));
    follow(state, pose, tool, sides, std::max(0.0, dt));
    if (tool != nullptr) result.ideal_side = pose.frame[0];
    for (std::size_t i = 0; i < soft_.size(); ++i)
      add_contacts(*soft_[i], state.soft[i], pose, sides, tool != nullptr, result);
    const Vec3 all = result.force + result.torque;
    const bool failed = std::ranges::any_of(state.soft, &SoftObjectState::failed);
    const bool stalled = std::ranges::any_of(state.soft, is_stalled);
    if (failed || stalled || !std::isfinite(all.x + all.y + all.z)) {
      Rendering none;
      none.ideal = probe;
      none.faults =
          result.faults | (stalled ? render_fault::kSoftStalled : render_fault::kNonFinite);
      result = none;
    }
    state.last = pose;
    state.has_last = true;
    outer.last = probe;
    outer.has_last = true;
    return result;
  }

 private:
  /// Decides which steps arrive in a tick of dt.
  /// \return kSoftLate: a step was due and none arrived
  std::uint32_t pace(SoftMotionState& state, double dt) const noexcept {
    bool due = false, late = state.hold;
    for (std::size_t i = 0; i < soft_.size(); ++i) {
      SoftObjectState& own = state.soft[i];
      const bool own_due = step_is_due(*soft_[i], own, dt);
      own.pace = own_due ? SoftPace::this_tick : SoftPace::hold;
      due = due || own_due;
      late = late || (own_due && own.stepper != nullptr && !own.stepper->ready());
    }
    if (!due || !late) return 0;
    for (SoftObjectState& own : state.soft) own.pace = SoftPace::hold;
    return render_fault::kSoftLate;
  }

  /// Advances all bodies while the hand moves evenly from the last pose to this one.
  void follow(SoftMotionState& state, const ToolPose& to, const Tool* tool, bool sides,
              double dt) const noexcept {
    const ToolPose from = state.has_last ? state.last : to;
    const double moved = way(place(tool, sides, from), from.tip, place(tool, sides, to), to.tip);
    for (std::size_t i = 0; i < soft_.size(); ++i) {
      const double stride = std::min(soft_[i]->contact.radius * kStride, kLongestStride);
      const double wanted =
          std::max({1.0, std::ceil(moved / stride - 1e-9), std::ceil(dt / kLongestTick - 1e-6)});
      const int most = state.by_tick ? kMostPiecesOfServo : kMostPieces;
      const int pieces = static_cast<int>(std::min<double>(wanted, most));
      const double piece = state.by_tick ? dt / pieces : std::min(dt / pieces, kLongestTick);
      for (int k = 1; k <= pieces; ++k) {
        const ToolPose at = k < pieces ? between(from, to, static_cast<double>(k) / pieces) : to;
        advance(*soft_[i], state.soft[i], at.tip, place(tool, sides, at), moved / pieces, piece);
      }
    }
  }

  static constexpr double kLongestStride = 0.002;  // m; for tools thicker than elements

  Scene others_;
  std::vector<std::shared_ptr<const SoftObject>> soft_;
};

const SoftMotion* soft_motion(const Scene& scene) {
  return dynamic_cast<const SoftMotion*>(scene.motion());
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

double SoftObject::node_spacing() const {
  double area = 0;
  for (const auto& [i, j, k] : surface.triangles())
    area += 0.5 * glm::length(glm::cross(rest[j] - rest[i], rest[k] - rest[i]));
  return std::sqrt(area / static_cast<double>(rest.size()));
}

SoftObjectState initial_state(const SoftObject& object) {
  SoftObjectState state;
  state.body = object.body->rest();
  state.view = object.surface.first_view(*object.body, state.body);
  state.contact = SoftContactMemory(*object.body, object.contact);
  state.impulse.assign(object.body->surface_nodes().size(), Vec3(0));
  state.impelled.reserve(2 * state.impulse.size());
  state.mean.reserve(2 * state.impulse.size());
  return state;
}

void keep_room(const SoftObjectState& original, SoftObjectState& copy) {
  copy.contact.contacts.reserve(original.contact.contacts.capacity());
  copy.contact.found.reserve(original.contact.found.capacity());
  copy.contact.forces.reserve(original.contact.forces.capacity());
  copy.contact.local.reserve(original.contact.local.capacity());
  copy.impelled.reserve(original.impelled.capacity());
  copy.mean.reserve(original.mean.capacity());
}

bool step_is_due(const SoftObject& object, const SoftObjectState& state, double dt) noexcept {
  return state.waiting &&
         state.since_step + dt >= object.delay * object.body->settings().step - kEarly;
}

bool is_stalled(const SoftObjectState& state) noexcept {
  return state.waiting && state.since_step > kStalledAfter;
}

bool step_and_look(const SoftObject& object, SoftState& body, std::span<const NodeForce> forces,
                   SoftView& view) noexcept {
  object.body->step(body, forces);
  object.surface.look(*object.body, body, view);
  double most = 0;
  bool numbers = std::isfinite(body.energy);
  for (std::size_t i = 0; i < view.x.size(); ++i) {
    const Vec3& x = view.x[i];
    const Vec3& ahead = view.ahead[i];
    numbers = numbers && std::isfinite(x.x + x.y + x.z + ahead.x + ahead.y + ahead.z);
    most = std::max({most, std::abs(x.x), std::abs(x.y), std::abs(x.z)});
  }
  return numbers && most <= kFarthestNode;
}

Vec3 advance(const SoftObject& object, SoftObjectState& state, const Vec3& tip,
             const PlacedTool& tool, double step, double dt) noexcept {
  const double h = object.body->settings().step;
  state.since_step += dt;
  state.view_age += dt;
  take_due_step(object, state);
  if (state.failed) return Vec3(0);
  const double fraction = std::min(state.view_age / h, kFarthestAhead);
  const SoftMoment moment{*object.body, object.surface, state.view, fraction};
  Vec3 force(0);
  if (!state.started || state.off) {
    const bool inside = is_inside(moment, object.contact.radius, tip, tool);
    state.off = inside;
    state.started = true;
  }
  if (!state.off) force = follow_surface(moment, object.contact, tip, tool, step, state.contact);
  add_impulse(state, dt);
  // Wait for a late step: the next one gets the mean force of the whole time.
  if (!state.waiting && state.since_step >= h - kEarly) {
    ask_for_step(state);
    if (object.delay * h <= kEarly) take_due_step(object, state);
  }
  return force;
}

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

Scene soft_scene(Scene others, std::vector<SceneObject> shown,
                 std::vector<std::shared_ptr<const SoftObject>> soft, bool side_contact,
                 const Tool& tool) {
  return Scene(std::move(shown), side_contact, tool,
               std::make_shared<const SoftMotion>(std::move(others), std::move(soft)));
}

void visit_soft_contacts(const RenderState& state, SoftContactVisit visit, void* whom) noexcept {
  const auto* const own = dynamic_cast<const SoftMotionState*>(state.motion.get());
  if (own == nullptr) return;
  for (const SoftObjectState& soft : own->soft) {
    for (const SoftContact& contact : soft.contact.contacts) {
      if (contact.force > 0)
        visit(whom, contact.axis_point + soft.contact.shift, contact.force * contact.normal);
    }
  }
}

void pace_by_tick(RenderState& state) {
  if (auto* const own = dynamic_cast<SoftMotionState*>(state.motion.get())) own->by_tick = true;
}

void hold_steps(RenderState& state, bool held) noexcept {
  if (auto* const own = dynamic_cast<SoftMotionState*>(state.motion.get())) own->hold = held;
}

void step_elsewhere(RenderState& state, std::span<SoftStepper* const> steppers) {
  pace_by_tick(state);
  auto* const own = dynamic_cast<SoftMotionState*>(state.motion.get());
  if (own == nullptr) return;
  for (std::size_t i = 0; i < own->soft.size() && i < steppers.size(); ++i)
    own->soft[i].stepper = steppers[i];
}

std::vector<SoftShape> soft_shapes(const Scene& scene, const RenderState& state) {
  std::vector<SoftShape> shapes;
  const SoftMotion* const motion = soft_motion(scene);
  const auto* const own = dynamic_cast<const SoftMotionState*>(state.motion.get());
  if (motion == nullptr || own == nullptr) return shapes;
  for (std::size_t i = 0; i < own->soft.size(); ++i) {
    const SoftObject& object = *motion->soft()[i];
    shapes.push_back({object.object, object.rest, own->soft[i].view.x, object.surface.triangles()});
  }
  return shapes;
}

std::span<const std::shared_ptr<const SoftObject>> soft_objects(const Scene& scene) {
  const SoftMotion* const motion = soft_motion(scene);
  if (motion == nullptr) return {};
  return motion->soft();
}

}  // namespace palpate::rendering
