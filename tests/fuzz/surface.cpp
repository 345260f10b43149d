// Any solid of cells, turned and rounded as a file is, and any small motions of a tool: its ideal
// tool is never inside, and the force is stiffness times its displacement. The oracle knows the
// cells alone.

#include "stimuli/surfaces/surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <iostream>
#include <map>
#include <memory>
#include <vector>

#include "rendering/renderer.h"
#include "stimuli/closed_surface.h"
#include "stimuli/polygon_soup.h"

namespace {

using namespace palpate;

constexpr int kCells = 3;       // to each side
constexpr double kCell = 0.01;  // m
constexpr double kStiffness = 1000;
constexpr std::size_t kMostTicks = 200;

/// Bytes one after another; zeros when they are used up.
class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  int next() { return at_ < size_ ? data_[at_++] : 0; }
  int signed_next() { return static_cast<std::int8_t>(next()); }
  bool empty() const { return at_ >= size_; }

 private:
  const std::uint8_t* data_;
  std::size_t size_, at_ = 0;
};

struct Cells {
  std::array<bool, kCells * kCells * kCells> full{};

  bool at(int x, int y, int z) const {
    const auto within = [](int i) { return i >= 0 && i < kCells; };
    return within(x) && within(y) && within(z) &&
           full[static_cast<std::size_t>((z * kCells + y) * kCells + x)];
  }
  /// Whether a cube of 2 `room` about a point, in the frame of the cells, is full.
  bool holds(const Vec3& p, double room) const {
    for (int k = 0; k < 8; ++k) {
      std::array<int, 3> cell{};
      for (int axis = 0; axis < 3; ++axis) {
        const double off = (k >> axis & 1) != 0 ? room : -room;
        cell[static_cast<std::size_t>(axis)] =
            static_cast<int>(std::floor((p[axis] + off) / kCell + 0.5 * kCells));
      }
      if (!at(cell[0], cell[1], cell[2])) return false;
    }
    return true;
  }
  /// The same of some point of a segment: between the places where it goes from cell to cell.
  bool hold_some(const Vec3& from, const Vec3& to, double room) const {
    std::vector<double> places = {0, 1};
    for (int axis = 0; axis < 3; ++axis) {
      for (int i = 0; i <= kCells; ++i) {
        for (const double off : {-room, room}) {
          const double place = (kCell * (i - 0.5 * kCells) + off - from[axis]) / (to - from)[axis];
          if (place > 0 && place < 1) places.push_back(place);
        }
      }
    }
    std::sort(places.begin(), places.end());
    for (std::size_t i = 0; i + 1 < places.size(); ++i) {
      const double middle = 0.5 * (places[i] + places[i + 1]);
      if (holds(from + middle * (to - from), room)) return true;
    }
    return holds(from, room) || holds(to, room);
  }
};

/// Between each full cell and an empty one two triangles.
stimuli::PolygonSoup surface_of(const Cells& cells, const Quat& turn, bool rounded) {
  stimuli::PolygonSoup soup;
  std::map<std::array<int, 3>, std::uint32_t> known;
  const auto corner = [&](const std::array<int, 3>& at) {
    const auto [found, is_new] =
        known.try_emplace(at, static_cast<std::uint32_t>(soup.vertices.size()));
    if (is_new) {
      const Vec3 place = turn * (kCell * (Vec3(at[0], at[1], at[2]) - Vec3(0.5 * kCells)));
      soup.vertices.push_back(rounded ? Vec3(glm::vec3(place)) : place);
    }
    return found->second;
  };
  for (int x = 0; x < kCells; ++x) {
    for (int y = 0; y < kCells; ++y) {
      for (int z = 0; z < kCells; ++z) {
        if (!cells.at(x, y, z)) continue;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          for (const int side : {0, 1}) {
            std::array<int, 3> beyond{x, y, z};
            beyond[axis] += side == 1 ? 1 : -1;
            if (cells.at(beyond[0], beyond[1], beyond[2])) continue;
            std::array<std::uint32_t, 4> quad{};
            for (std::size_t k = 0; k < 4; ++k) {
              std::array<int, 3> at{x, y, z};
              at[axis] += side;
              at[(axis + 1) % 3] += k == 1 || k == 2 ? 1 : 0;
              at[(axis + 2) % 3] += k >= 2 ? 1 : 0;
              quad[side == 1 ? k : 3 - k] = corner(at);
            }
            soup.faces.push_back({quad[0], quad[1], quad[2]});
            soup.faces.push_back({quad[0], quad[2], quad[3]});
          }
        }
      }
    }
  }
  if (rounded) soup.coordinate_error = 2e-9;
  return soup;
}

[[noreturn]] void fail(int tick, const char* what) {
  std::cerr << "tick " << tick << ": " << what << "\n";
  std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace palpate::rendering;
  Bytes bytes(data, size);
  Cells cells;
  for (std::size_t i = 0; i < cells.full.size(); i += 8) {
    const int some = bytes.next();
    for (std::size_t k = i; k < std::min(i + 8, cells.full.size()); ++k)
      cells.full[k] = (some >> (k - i) & 1) != 0;
  }
  if (std::none_of(cells.full.begin(), cells.full.end(), [](bool full) { return full; })) return 0;
  const int how = bytes.next();
  const bool rounded = (how & 1) != 0, point = (how & 2) != 0;
  Quat turn(1, 0, 0, 0);
  if ((how & 4) != 0)
    turn = glm::normalize(Quat(128, bytes.signed_next(), bytes.signed_next(), bytes.signed_next()));
  Tool tool;
  const int segments = how >> 3 & 3;  // 0: the stylus alone
  for (int i = 0; i < segments; ++i) {
    const auto end = [&] {
      return 0.001 * Vec3(bytes.next() % 24, bytes.next() % 24, bytes.next() % 48);
    };
    const Vec3 from = end(), to = end();
    if (from != to) tool.segments.push_back({from, to});
  }
  stimuli::Material material;
  material.stiffness = kStiffness;
  const std::vector<stimuli::SurfaceShell> shells = {
      {std::make_shared<const stimuli::ClosedSurface>(
           stimuli::closed_surface(surface_of(cells, turn, rounded)).surface),
       Pose{}, material}};
  const Renderer& renderer = point ? point_renderer() : ray_renderer();
  const Scene scene({}, true, tool, nullptr,
                    {{std::make_shared<const stimuli::Surface>(shells), Pose{}, 0}});
  RenderState state = scene.initial_state();
  const Quat back = glm::conjugate(turn);
  const double room = rounded ? 1e-7 : 1e-9;
  // All of it begins outside, and does not get far.
  Vec3 tip(0.03, 0.03, 0.04);
  Quat held(1, 0, 0, 0);
  for (int tick = 0; tick < static_cast<int>(kMostTicks) && !(tick > 0 && bytes.empty()); ++tick) {
    if (tick > 0) {
      const int what = bytes.next();
      const double amount = bytes.signed_next();
      Vec3 axis(0);
      axis[what % 3] = 1;
      if (what % 4 == 3) {
        held = glm::normalize(glm::angleAxis(amount * 0.01, axis) * held);
      } else {
        tip += ((what & 64) != 0 ? 1e-5 : 1e-4) * amount * axis;
        tip = glm::clamp(tip, Vec3(-0.02), Vec3(0.03, 0.03, 0.04));
      }
    }
    const LineProbe probe{tip, tip + held * Vec3(0, 0, 0.12)};
    state.measured_side = held * Vec3(1, 0, 0);
    const Rendering r = renderer.tick(scene, state, probe, 1e-3);
    for (const Vec3& v : {r.force, r.torque, r.device1, r.device2}) {
      if (!std::isfinite(v.x + v.y + v.z)) fail(tick, "not finite");
    }
    const ObjectState& object = state.unions.objects[0];
    if (object.off || object.releasing || object.strength < 1) continue;
    const GroupState& group = state.unions.groups[0];
    if (!group.touching) {
      if (r.force != Vec3(0)) fail(tick, "a force without a contact");
    }
    const ToolPose ideal =
        group.touching ? group.ideal : ToolPose{probe.tip, probe.tail - probe.tip, Mat3(1)};
    if (group.touching && glm::distance(r.force, kStiffness * group.shift) >
                              1e-6 * kStiffness * glm::length(group.shift) + 1e-9)
      fail(tick, "the force is not stiffness times displacement");
    if (point || tool.segments.empty()) {
      const Vec3 from = back * ideal.tip, to = back * (ideal.tip + (point ? Vec3(0) : ideal.d));
      if (cells.hold_some(from, to, room)) fail(tick, "the ideal stylus is inside");
      continue;
    }
    const Mat3 frame = group.touching ? ideal.frame : glm::mat3_cast(held);
    for (const ToolSegment& segment : tool.segments) {
      const Vec3 from = back * (ideal.tip + frame * segment.from),
                 to = back * (ideal.tip + frame * segment.to);
      if (cells.hold_some(from, to, room)) fail(tick, "the ideal tool is inside");
    }
  }
  return 0;
}
