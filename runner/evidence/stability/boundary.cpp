#include "runner/evidence/stability/boundary.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <numbers>
#include <stdexcept>
#include <utility>
#include <vector>

#include "rendering/bodies/moving_scene.h"
#include "runner/scene_builder.h"
#include "runner/servo/passivity.h"
#include "stimuli/closed_surface.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/inset.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"

namespace palpate::runner::evidence {
namespace {

constexpr double kDepth = 1e-3;     // m, at rest
constexpr double kLength = 0.12;    // m
constexpr double kAtRest = 0.01;    // share of the initial swing; less counts as rest
constexpr double kDiverged = 0.02;  // m, from rest; beyond it the loop has diverged
constexpr int kMaxDelay = 16;       // ticks

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
  constexpr double kHalf = 0.03, kRadius = 0.03, kWall = 0.5, kThick = 0.02;
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
    case ContactCase::body:
      return {
          object(stimuli::cube(2 * kWall), {{0, 0, -kWall - kThick}, {1, 0, 0, 0}}, material, 0),
          object(stimuli::box({0.1, 0.1, kThick}), {{0, 0, -0.5 * kThick}, {1, 0, 0, 0}}, material,
                 1)};
    case ContactCase::groove: {
      std::vector<rendering::SceneObject> walls;
      for (const double side : {-1.0, 1.0}) {
        const double lean = std::numbers::pi / 3;
        const Vec3 inward(side * std::sin(lean), 0, -std::cos(lean));
        walls.push_back(object(stimuli::cube(2 * kWall),
                               {kWall * inward, turned_about_y(-side * lean)}, material, 0));
      }
      return walls;
    }
    case ContactCase::tool:
      return {ridge(0.004, -0.006, material, 0), ridge(0.004, 0.006, material, 0)};  // one object
    case ContactCase::concave_edge:
      return {};
  }
  throw std::invalid_argument("no such situation");
}

/// A block with a valley of 90 degrees along y, its bottom at the origin.
rendering::SceneSurface valley(const stimuli::Material& material) {
  constexpr double kHalf = 0.03, kDown = 0.02;  // m
  const std::pair<double, double> corners[] = {
      {-kHalf, -kDown}, {kHalf, -kDown}, {kHalf, kHalf}, {0, 0}, {-kHalf, kHalf}};
  constexpr std::uint32_t kCorners = 5;
  stimuli::PolygonSoup soup;
  for (const double y : {-kHalf, kHalf}) {
    for (const auto& [x, z] : corners) soup.vertices.emplace_back(x, y, z);
  }
  soup.faces = {{0, 1, 2, 3, 4}, {9, 8, 7, 6, 5}};
  for (std::uint32_t i = 0; i < kCorners; ++i) {
    const std::uint32_t next = (i + 1) % kCorners;
    soup.faces.push_back({i, i + kCorners, next + kCorners, next});
  }
  stimuli::Material plain = material;
  plain.layers.clear();
  const std::vector<stimuli::SurfaceShell> shells = {
      {std::make_shared<const stimuli::ClosedSurface>(stimuli::closed_surface(soup).surface),
       Pose{}, plain}};
  return {std::make_shared<const stimuli::Surface>(shells), Pose{}, 0, {}};
}

/// Adds the layers of materials as further objects.
std::vector<rendering::SceneObject> with_layers(std::vector<rendering::SceneObject> objects) {
  std::vector<rendering::SceneObject> out;
  for (rendering::SceneObject& surface : objects) {
    const std::vector<stimuli::Layer> layers = std::exchange(surface.material.layers, {});
    out.push_back(surface);
    for (std::size_t i = 0; i < layers.size(); ++i) {
      rendering::SceneObject under = surface;
      under.mesh = stimuli::inset(*surface.mesh, layers[i].depth);
      under.material = {};
      under.material.stiffness = layers[i].stiffness;
      under.material.damping = layers[i].damping;
      under.layer = static_cast<int>(i) + 1;
      out.push_back(std::move(under));
    }
  }
  return out;
}

rendering::Scene scene_of(ContactCase contact_case, bool ray, const stimuli::Material& material) {
  std::vector<rendering::SceneObject> objects =
      with_layers(objects_of(contact_case, ray, material));
  if (contact_case == ContactCase::concave_edge)
    return rendering::Scene({}, ray, {}, nullptr, {valley(material)});
  rendering::Tool tool;
  if (contact_case == ContactCase::tool) {
    constexpr double kArm = 0.01;  // m
    tool.segments = {{Vec3(0), Vec3(0, 0, kLength)},
                     {Vec3(-kArm, 0, 0), Vec3(kArm, 0, 0)},
                     {Vec3(0, -kArm, 0), Vec3(0, kArm, 0)}};
  }
  if (contact_case != ContactCase::body)
    return rendering::Scene(std::move(objects), ray, std::move(tool));
  constexpr double kMass = 0.01;  // kg
  rendering::MovingObject body{1, {}, objects.back().pose};
  body.body.mass = kMass;
  return rendering::moving_scene(std::move(objects), {body}, Vec3(0), ray);
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
  if (contact_case == ContactCase::wall || contact_case == ContactCase::body) {
    const Vec3 tip(0.001, 0.002, 0);
    return {tip, tip + kLength * glm::normalize(Vec3(1, 0, 1))};
  }
  if (contact_case == ContactCase::groove || contact_case == ContactCase::concave_edge) {
    const Vec3 tip(0, 0.7e-3, 0);  // it leans along the groove
    return {tip, tip + kLength * glm::normalize(Vec3(0, 1, 1))};
  }
  if (contact_case == ContactCase::tool) return {Vec3(0), Vec3(0, 0, kLength)};
  // It lies across the edge, off-centre, so that the ends carry different forces.
  const double fraction = contact_case == ContactCase::two_objects ? 0.5 : 0.35;
  const Vec3 d(kLength, 0, 0);
  const Vec3 tip = Vec3(0, 1e-3, 0) - fraction * d;
  return {tip, tip + d};
}

rendering::LineProbe lowered(const rendering::LineProbe& probe, double tip, double tail) {
  return {probe.tip - Vec3(0, 0, tip), probe.tail - Vec3(0, 0, tail)};
}

/// One end of the stylus, moving along z under a force held over each tick.
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

/// A swing's limits.
struct Range {
  double low = HUGE_VAL, high = -HUGE_VAL;
  void add(double x) {
    low = std::min(low, x);
    high = std::max(high, x);
  }
  double size() const { return high > low ? high - low : 0; }
};

double lever2(const LoopCase& loop) {
  return loop.settings.reach ? rendering::stiffness_gain(*loop.settings.reach, 0) : 1;
}

double felt_stiffness(const LoopCase& loop, double stiffness) {
  return stiffness * (1 + loop.layer_share) * lever2(loop);
}

/// A hand, two devices and a renderer in a loop, tick by tick.
class Loop {
 public:
  Loop(const LoopSettings& s, const LoopScene& scene)
      : s_(s),
        scene_(scene),
        state_(scene.scene().initial_state()),
        rest_(s.reach ? unstretched(*s.reach, scene.rest()) : scene.rest()),
        balance_(on_hand({Vec3(0, 0, scene.force_tip()), Vec3(0, 0, scene.force_tail())})),
        stiffness_((scene.force_tip() + scene.force_tail()) / kDepth),
        tip_(s, kReleasedTip),
        tail_(s, kReleasedTail),
        controller_({0.5 * s.mass * s.rate}, 1 / s.rate) {
    // Approach from above, so that the renderer finds a first contact.
    const double up = -scene.approach();
    scene.renderer().tick(scene.scene(), state_, lowered(scene.rest(), up, up), 1 / s.rate);
    for (auto& forces : under_way_) forces = {balance_.tip.z, balance_.tail.z};
    const double felt_stiffness = stiffness_ * (s.reach ? stiffness_gain(*s.reach, 0) : 1);
    const double period = std::max(
        16.0, 2 * std::numbers::pi *
                  std::sqrt((s.mass + s.hand.mass) / (felt_stiffness + s.hand.stiffness)) * s.rate);
    block_ = static_cast<std::uint64_t>(10 * period);
  }

  /// Runs until it has this many blocks of ten periods, a multiple of four.
  LoopOutcome run(std::uint64_t blocks) {
    while (swings_.size() < blocks && !diverged_) {
      swings_.emplace_back();
      for (std::uint64_t i = 0; i < block_ && !diverged_; ++i) swings_.back().add(tick());
    }
    LoopOutcome out;
    out.ticks = ticks_;
    out.initial_swing = 2 * std::abs(first_ - balance_height());
    out.floor = std::max(3 * s_.resolution, kAtRest * out.initial_swing);
    out.early_swing = over(blocks / 4, blocks / 2);
    out.late_swing = diverged_ ? HUGE_VAL : over(3 * blocks / 4, blocks);
    return out;
  }

 private:
  static constexpr double kReleasedTip = 1e-4, kReleasedTail = 0.6e-4;  // m, from rest

  rendering::EndForces on_hand(const rendering::EndForces& forces) const {
    return s_.reach ? felt(*s_.reach, forces) : forces;
  }

  double over(std::uint64_t first, std::uint64_t end) const {
    Range all;
    for (std::uint64_t i = first; i < std::min<std::uint64_t>(end, swings_.size()); ++i) {
      all.add(swings_[i].low);
      all.add(swings_[i].high);
    }
    return all.size();
  }

  /// Force over stiffness, m, so that a rotation about the contact does not count as its
  /// oscillation.
  double height_of(double tip_force, double tail_force) const {
    return (tip_force + 0.7 * tail_force) / stiffness_;
  }
  double balance_height() const { return height_of(scene_.force_tip(), scene_.force_tail()); }

  double read(double z) const {
    return s_.resolution > 0 ? s_.resolution * std::round(z / s_.resolution) : z;
  }

  /// \return height_of
  double tick() {
    const rendering::LineProbe held = lowered(rest_, -read(tip_.z()), -read(tail_.z()));
    const rendering::Rendering r = scene_.renderer().tick(
        scene_.scene(), state_, s_.reach ? stretched(*s_.reach, held) : held, 1 / s_.rate);
    const rendering::EndForces shown = on_hand({r.device1, r.device2});
    servo::DeviceForces forces{shown.tip, shown.tail, false};
    if (s_.passivity_controller) {
      const servo::DeviceForces damping = controller_.damping({held.tip, held.tail}, forces);
      forces.device1 += damping.device1;
      forces.device2 += damping.device2;
      controller_.commanded(forces);
    }
    under_way_[ticks_ % under_way_.size()] = {forces.device1.z, forces.device2.z};
    const auto& now = under_way_[(ticks_ + under_way_.size() - static_cast<std::size_t>(s_.delay)) %
                                 under_way_.size()];
    tip_.advance(now[0] - balance_.tip.z);
    // With a reach, a contact at the tip acts on both ends.
    if (scene_.renderer().side_contact() || s_.reach) tail_.advance(now[1] - balance_.tail.z);
    const double height = height_of(r.device1.z, r.device2.z);
    if (ticks_++ == 0) first_ = height;
    diverged_ = !(std::max(std::abs(tip_.z()), std::abs(tail_.z())) < kDiverged);
    return height;
  }

  const LoopSettings& s_;
  const LoopScene& scene_;
  rendering::RenderState state_;
  rendering::LineProbe rest_;     // of the real stylus
  rendering::EndForces balance_;  // of the hand, at rest
  double stiffness_;              // N/m, of the contact
  End tip_, tail_;
  servo::PassivityController controller_;
  std::array<std::array<double, 2>, kMaxDelay + 1> under_way_{};
  std::uint64_t block_ = 0, ticks_ = 0;  // ticks
  double first_ = 0;                     // m
  bool diverged_ = false;
  std::vector<Range> swings_;  // of each block
};

bool has_grown(const LoopOutcome& o) {
  constexpr double kGrown = 2;  // times the initial swing; more than rounding or a second mode
  return !(o.late_swing <= kGrown * std::max(o.initial_swing, o.floor));
}

constexpr double kClose = 1.002;     // ratio of the bounds that ends the bisection
constexpr double kNoDamping = 1e-6;  // N s/m, practically none

stimuli::Material material_of(const LoopCase& loop, double stiffness) {
  stimuli::Material material;
  material.stiffness = stiffness;
  material.damping = loop.virtual_damping;
  constexpr double kLayerDepth = 0.5e-3;  // m; the contact is 1 mm deep
  if (loop.layer_share > 0)
    material.layers = {{.depth = kLayerDepth, .stiffness = loop.layer_share * stiffness}};
  return material;
}

LoopSettings settings_at(const LoopCase& loop, double stiffness, double damping) {
  LoopSettings settings = loop.settings;
  settings.damping = damping;
  if (loop.heavy)
    settings.mass = 100 * felt_stiffness(loop, stiffness) / (settings.rate * settings.rate);
  return settings;
}

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
    case ContactCase::body:
      return "body on a wall";
    case ContactCase::groove:
      return "groove";
    case ContactCase::concave_edge:
      return "concave edge";
    case ContactCase::tool:
      return "tool across two edges";
  }
  return "";
}

LoopScene::LoopScene(ContactCase contact_case, protocols::RendererKind kind,
                     const stimuli::Material& material)
    : renderer_(&renderer_for(kind)),
      scene_(scene_of(contact_case, renderer_->side_contact(), material)) {
  // s; slow ticks, in which damping hardly acts. A body needs shorter ones.
  constexpr double kStep = 1e-6;
  settle(stylus_at_height_0(contact_case, renderer_->side_contact()),
         contact_case == ContactCase::body ? 0.05 : 1, kStep);
}

LoopScene::LoopScene(rendering::Scene scene, const rendering::Renderer& renderer,
                     const rendering::LineProbe& start)
    : renderer_(&renderer), scene_(std::move(scene)), approach_(2e-3) {
  constexpr double kStep = 1e-5;
  settle(start, scene_.motion() != nullptr ? 1e-3 : 1, kStep);
}

double LoopScene::stiffness() const { return (force_tip_ + force_tail_) / kDepth; }

/// Lowers the stylus from above to the wanted depth: first contact needs a path from outside.
void LoopScene::settle(const rendering::LineProbe& start, double slow, double step) {
  rendering::RenderState state = scene_.initial_state();
  rendering::Rendering r;
  for (double down = -2e-3; r.deepest.depth < kDepth; down += step) {
    rest_ = lowered(start, down, down);
    r = renderer_->tick(scene_, state, rest_, slow);
    if (down > 0.05) throw std::runtime_error("nothing under the stylus");
  }
  // A second tick at rest gives the force without damping.
  r = renderer_->tick(scene_, state, rest_, slow);
  force_tip_ = r.device1.z;
  force_tail_ = r.device2.z;
  contacts_ = static_cast<int>(r.contacts);
}

Verdict verdict_on(const LoopOutcome& o, bool linear) {
  constexpr double kShrunk = 0.9;  // from the second quarter to the last; less may be chance
  if (has_grown(o)) return Verdict::unstable;
  if (o.late_swing <= o.floor) return Verdict::stable;
  if (linear) return o.late_swing <= o.early_swing ? Verdict::stable : Verdict::unstable;
  return o.late_swing <= kShrunk * o.early_swing ? Verdict::open : Verdict::unstable;
}

LoopOutcome run_loop(const LoopSettings& s, const LoopScene& loop) {
  Loop running(s, loop);
  constexpr int kDoublings = 6;
  LoopOutcome outcome;
  for (int doubling = 0; doubling <= kDoublings; ++doubling) {
    outcome = running.run(std::uint64_t{4} << doubling);
    const Verdict verdict = verdict_on(outcome, s.linear());
    outcome.stable = verdict != Verdict::unstable;
    // A swing that hardly shrinks in a short run may shrink in a longer one.
    if (verdict == Verdict::stable || s.linear() || has_grown(outcome)) break;
  }
  return outcome;
}

double passive_damping(const LoopCase& loop, double stiffness) {
  return felt_stiffness(loop, stiffness) / loop.settings.rate * (0.5 + loop.settings.delay) +
         std::abs(loop.virtual_damping) * lever2(loop);
}

bool is_stable(const LoopCase& loop, double stiffness, double damping) {
  const LoopScene scene(loop.contact_case, loop.renderer, material_of(loop, stiffness));
  return run_loop(settings_at(loop, stiffness, damping), scene).stable;
}

BoundaryPoint boundary_at(const LoopCase& loop, double stiffness) {
  const LoopSettings& s = loop.settings;
  BoundaryPoint point;
  point.stiffness = stiffness;
  point.theory = passive_damping(loop, stiffness);
  point.promised =
      s.resolution == 0 || felt_stiffness(loop, stiffness) <= 2 * s.friction / s.resolution;
  const LoopScene scene(loop.contact_case, loop.renderer, material_of(loop, stiffness));
  const auto stable = [&](double damping) {
    return run_loop(settings_at(loop, stiffness, damping), scene).stable;
  };
  double low = kNoDamping, high = point.theory;
  if (stable(low)) return point;
  while (!stable(high)) {
    low = high;
    high *= 2;
  }
  while (high > kClose * low) {
    const double middle = std::sqrt(low * high);
    (stable(middle) ? high : low) = middle;
  }
  point.measured = high;
  return point;
}

double least_stable_damping(const LoopSettings& settings, const LoopScene& scene, double close) {
  constexpr double kMost = 1e9;  // N s/m
  const auto stable = [&](double damping) {
    LoopSettings with = settings;
    with.damping = damping;
    return run_loop(with, scene).stable;
  };
  double low = kNoDamping;
  if (stable(low)) return 0;
  const double gain = settings.reach ? stiffness_gain(*settings.reach, 0) : 1;
  double high =
      std::max(kNoDamping * 2, scene.stiffness() * gain / settings.rate * (0.5 + settings.delay));
  while (!stable(high)) {
    low = high;
    high *= 2;
    if (high > kMost) return HUGE_VAL;
  }
  while (high > close * low) {
    const double middle = std::sqrt(low * high);
    (stable(middle) ? high : low) = middle;
  }
  return high;
}

double stiffest_stable(const LoopCase& loop, double damping) {
  const auto stable = [&](double stiffness) { return is_stable(loop, stiffness, damping); };
  // Search in steps first: a stable stiffness beyond an unstable one must not count.
  constexpr double kStep = 1.15, kMost = 1e7;
  double low = 1;
  while (low < kMost && stable(kStep * low)) low *= kStep;
  if (low >= kMost) return kMost;
  double high = kStep * low;
  while (high > kClose * low) {
    const double middle = std::sqrt(low * high);
    (stable(middle) ? low : high) = middle;
  }
  return low;
}

}  // namespace palpate::runner::evidence
