#include "runner/stability/closed_loop.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <stdexcept>

#include "runner/scene_builder.h"
#include "runner/servo/passivity.h"
#include "stimuli/primitives.h"

namespace palpate::runner {
namespace {

constexpr double kDepth = 1e-3;          // m, at rest
constexpr double kLength = 0.12;         // m
constexpr double kRestAmplitude = 1e-9;  // m, peak to peak: counts as rest
constexpr double kDiverged = 0.02;       // m, from rest: diverged
constexpr int kMaxDelay = 16;            // ticks

Quat turned_about_y(double angle) { return {std::cos(angle / 2), 0, std::sin(angle / 2), 0}; }

rendering::SceneObject object(const stimuli::PolygonSoup& soup, const Pose& pose,
                              const stimuli::Material& material, int index) {
  rendering::SceneObject one;
  one.mesh = std::make_shared<const stimuli::ConvexMesh>(soup);
  one.pose = pose;
  one.material = material;
  one.object = index;
  return one;
}

/// A cube of edge 2 h with one edge on top, along y, at (x, 0).
rendering::SceneObject ridge(double h, double x, const stimuli::Material& material, int index) {
  return object(stimuli::cube(2 * h),
                {{x, 0, -h * std::numbers::sqrt2}, turned_about_y(std::numbers::pi / 4)}, material,
                index);
}

std::vector<rendering::SceneObject> objects_of(ContactCase contact_case, bool ray,
                                               const stimuli::Material& material) {
  constexpr double kHalf = 0.03, kRadius = 0.03, kWall = 0.5;
  switch (contact_case) {
    case ContactCase::wall:
      return {object(stimuli::cube(2 * kWall), {{0, 0, -kWall}, {1, 0, 0, 0}}, material, 0)};
    case ContactCase::edge:
      return {ridge(kHalf, 0, material, 0)};
    case ContactCase::sphere:
      return {
          object(stimuli::icosphere(kRadius, 4), {{0, 0, -kRadius}, {1, 0, 0, 0}}, material, 0)};
    case ContactCase::two_objects: {
      if (ray) return {ridge(0.01, -0.03, material, 0), ridge(0.01, 0.03, material, 1)};
      // Two walls that form a groove, 45 degrees each.
      std::vector<rendering::SceneObject> walls;
      for (const double side : {-1.0, 1.0}) {
        const double lean = -side * std::numbers::pi / 4;
        const Vec3 inward(side * std::numbers::sqrt2 / 2, 0, -std::numbers::sqrt2 / 2);
        walls.push_back(object(stimuli::cube(2 * kWall), {kWall * inward, turned_about_y(lean)},
                               material, side < 0 ? 0 : 1));
      }
      return walls;
    }
  }
  throw std::invalid_argument("no such situation");
}

/// The stylus at height 0, with its lowest point near the origin.
rendering::LineProbe stylus_at_height_0(ContactCase contact_case, bool ray) {
  if (!ray) {
    const double x = contact_case == ContactCase::edge     ? 0.004
                     : contact_case == ContactCase::sphere ? 1e-3
                                                           : 0;
    const Vec3 tip(x, 0.7e-3, 0);
    return {tip, tip + Vec3(0, 0, kLength)};
  }
  if (contact_case == ContactCase::wall) {
    const Vec3 tip(0.001, 0.002, 0);
    return {tip, tip + kLength * glm::normalize(Vec3(1, 0, 1))};
  }
  // Lying across, off-centre, so that the ends get different forces.
  const double fraction = contact_case == ContactCase::two_objects ? 0.5 : 0.35;
  const Vec3 d(kLength, 0, 0);
  const Vec3 tip = Vec3(0, 1e-3, 0) - fraction * d;
  return {tip, tip + d};
}

rendering::LineProbe lowered(const rendering::LineProbe& probe, double tip, double tail) {
  return {probe.tip - Vec3(0, 0, tip), probe.tail - Vec3(0, 0, tail)};
}

/// One end of the stylus, moving along z under a force stylus_at_height_0 over each tick.
class End {
 public:
  End(const LoopSettings& s, double offset) : z_(offset) {
    const double m = s.mass + s.hand.mass, b = s.damping + s.hand.damping, k = s.hand.stiffness;
    const double t = 1 / s.rate;
    friction_step_ = s.friction / m * t;
    // exp of [[0, 1, 0], [-k/m, -b/m, 1/m], [0, 0, 0]] t, by scaling and squaring.
    constexpr int kHalvings = 20;
    const double h = std::ldexp(t, -kHalvings);
    Matrix step = identity(), term = identity();
    const Matrix rate = {{{0, h, 0}, {-k / m * h, -b / m * h, h / m}, {0, 0, 0}}};
    for (int i = 1; i <= 4; ++i) {
      term = product(term, rate, 1.0 / i);
      for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) step[r][c] += term[r][c];
      }
    }
    for (int i = 0; i < kHalvings; ++i) step = product(step, step, 1);
    step_ = step;
  }

  /// m, from rest.
  double z() const { return z_; }
  void advance(double force) {
    const double z = step_[0][0] * z_ + step_[0][1] * v_ + step_[0][2] * force;
    v_ = step_[1][0] * z_ + step_[1][1] * v_ + step_[1][2] * force;
    z_ = z;
    v_ = std::copysign(std::max(0.0, std::abs(v_) - friction_step_), v_);
  }

 private:
  using Matrix = std::array<std::array<double, 3>, 3>;
  static Matrix identity() { return {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}; }
  static Matrix product(const Matrix& a, const Matrix& b, double scale) {
    Matrix out{};
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) {
        for (int i = 0; i < 3; ++i) out[r][c] += scale * a[r][i] * b[i][c];
      }
    }
    return out;
  }

  double z_, v_ = 0, friction_step_ = 0;
  Matrix step_{};
};

struct Range {
  double low = HUGE_VAL, high = -HUGE_VAL;
  void add(double x) {
    low = std::min(low, x);
    high = std::max(high, x);
  }
  double size() const { return high > low ? high - low : 0; }
};

}  // namespace

const char* to_string(ContactCase contact_case) {
  switch (contact_case) {
    case ContactCase::wall:
      return "wall";
    case ContactCase::edge:
      return "edge";
    case ContactCase::sphere:
      return "sphere";
    case ContactCase::two_objects:
      return "two objects";
  }
  return "";
}

LoopScene::LoopScene(ContactCase contact_case, protocols::RendererKind kind,
                     const stimuli::Material& material)
    : renderer_(&renderer_for(kind)),
      scene_(objects_of(contact_case, renderer_->side_contact(), material),
             renderer_->side_contact()) {
  const rendering::LineProbe start = stylus_at_height_0(contact_case, renderer_->side_contact());
  rendering::RenderState state = scene_.initial_state();
  rendering::Rendering r;
  constexpr double kStep = 1e-6;
  // Lowered from above to the wanted depth, as first contact needs a path from outside.
  for (double down = -2e-3; r.deepest.depth < kDepth; down += kStep) {
    rest_ = lowered(start, down, down);
    r = renderer_->tick(scene_, state, rest_, 1);
    if (down > 0.05) throw std::logic_error("nothing under the stylus");
  }
  r = renderer_->tick(scene_, state, rest_, 1);  // a second tick at rest: without damping force
  force_tip_ = r.device1.z;
  force_tail_ = r.device2.z;
  contacts_ = static_cast<int>(r.contacts);
}

LoopOutcome run_loop(const LoopSettings& s, const LoopScene& loop) {
  const rendering::Renderer& renderer = loop.renderer();
  rendering::RenderState state = loop.scene().initial_state();
  const double tick = 1 / s.rate;
  // From above, so that the renderer finds a first contact.
  renderer.tick(loop.scene(), state, lowered(loop.rest(), -5e-3, -5e-3), tick);
  End tip(s, 1e-4), tail(s, 0.6e-4);
  const double stiffness = loop.force_tip() + loop.force_tail() > 0
                               ? (loop.force_tip() + loop.force_tail()) / kDepth
                               : 1;
  const double mass = s.mass + s.hand.mass;
  const double period = std::max(
      16.0, 2 * std::numbers::pi * std::sqrt(mass / (stiffness + s.hand.stiffness)) * s.rate);
  const auto ticks = static_cast<std::uint64_t>(40 * period);
  PassivityController controller({0.5 * s.mass * s.rate}, tick);
  std::array<std::array<double, 2>, kMaxDelay + 1> under_way{};
  for (auto& forces : under_way) forces = {loop.force_tip(), loop.force_tail()};
  const auto read = [&](double z) {
    return s.resolution > 0 ? s.resolution * std::round(z / s.resolution) : z;
  };
  LoopOutcome outcome;
  Range early, late;
  for (std::uint64_t i = 0; i < ticks; ++i) {
    const rendering::LineProbe probe = lowered(loop.rest(), -read(tip.z()), -read(tail.z()));
    const rendering::Rendering r = renderer.tick(loop.scene(), state, probe, tick);
    DeviceForces forces{r.device1, r.device2, false};
    if (s.passivity_controller) {
      const DeviceForces damping = controller.damping({probe.tip, probe.tail}, forces);
      forces.device1 += damping.device1;
      forces.device2 += damping.device2;
      controller.commanded(forces);
    }
    under_way[i % under_way.size()] = {forces.device1.z, forces.device2.z};
    const auto& now =
        under_way[(i + under_way.size() - static_cast<std::size_t>(s.delay)) % under_way.size()];
    tip.advance(now[0] - loop.force_tip());
    if (renderer.side_contact()) tail.advance(now[1] - loop.force_tail());
    ++outcome.ticks;
    const double z = std::abs(tip.z()) > std::abs(tail.z()) ? tip.z() : tail.z();
    if (!(std::abs(z) < kDiverged)) {
      outcome.late_amplitude = HUGE_VAL;
      return outcome;
    }
    // Force over stiffness, m: a rotation about the contact is not an oscillation of the contact.
    Range* const part = i >= ticks / 4 && i < ticks / 2 ? &early
                        : i >= 3 * ticks / 4            ? &late
                                                        : nullptr;
    if (part) part->add((r.device1.z + 0.7 * r.device2.z) / stiffness);
  }
  outcome.early_amplitude = early.size();
  outcome.late_amplitude = late.size();
  outcome.stable = outcome.late_amplitude <=
                   std::max({outcome.early_amplitude, 3 * s.resolution, kRestAmplitude});
  return outcome;
}

}  // namespace palpate::runner
