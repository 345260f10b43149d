// Contacts with textured surfaces, against closed forms: force, stiffness, energy, continuity.

#include "rendering/texture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <glm/geometric.hpp>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "data/base/random.h"
#include "rendering/renderer.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/primitives.h"
#include "stimuli/texture.h"
#include "tests/shared/render_checks.h"

namespace palpate::rendering {
namespace {

using Kind = stimuli::TextureSpec::Kind;
using testing::kTick;

constexpr double kTop = 0.01;  // m, of the plate's upper face
constexpr double kStiffness = 800;
constexpr double kLength = 0.12;  // m, of the stylus

stimuli::TextureSpec sine(double period = 0.002, double depth = 0.0004) {
  stimuli::TextureSpec out;
  out.period = period;
  out.depth = depth;
  return out;
}

double curvature(const stimuli::TextureSpec& spec) {
  return 0.5 * spec.depth * std::pow(2 * std::numbers::pi / spec.period, 2);
}

stimuli::Material material(const stimuli::TextureSpec& spec) {
  stimuli::Material out;
  out.stiffness = kStiffness;
  out.texture = std::make_shared<const stimuli::Texture>(spec, 0.02);
  return out;
}

SceneObject plate(const stimuli::Material& of, const Vec3& size = {0.1, 0.1, 2 * kTop},
                  const Pose& pose = {}) {
  SceneObject out =
      testing::placed_object(std::make_shared<const stimuli::ConvexMesh>(stimuli::box(size)), pose);
  out.material = of;
  return out;
}

/// A textured plate felt from above.
class Plate {
 public:
  explicit Plate(const stimuli::TextureSpec& spec, const Renderer& renderer = point_renderer())
      : Plate(std::vector{plate(material(spec))}, renderer) {}
  Plate(std::vector<SceneObject> objects, const Renderer& renderer)
      : renderer_(renderer), scene_(std::move(objects)), state_(scene_.initial_state()) {
    upright({0, 0}, -0.02);
  }

  Rendering tick(const Vec3& tip, const Vec3& tail) {
    return renderer_.tick(scene_, state_, {tip, tail}, kTick);
  }
  /// The stylus upright, its tip `depth` below the crests.
  Rendering upright(const glm::dvec2& at, double depth) {
    const Vec3 tip(at.x, at.y, kTop - depth);
    return tick(tip, tip + Vec3(0, 0, kLength));
  }
  RenderState& state() { return state_; }
  const Scene& scene() const { return scene_; }

 private:
  const Renderer& renderer_;
  Scene scene_;
  RenderState state_;
};

TEST(TexturedContact, CrestAndValleyPushStraightUp) {
  for (const Renderer* renderer : {&point_renderer(), &ray_renderer()}) {
    Plate felt(sine(), *renderer);
    // Deeper, where curvature times depth exceeds 1, it would slide off the crest.
    const Rendering crest = felt.upright({0.002, 0.01}, 0.0003);
    EXPECT_NEAR(crest.force.z, kStiffness * 0.0003, 1e-12);
    EXPECT_NEAR(crest.force.x, 0, 1e-9);
    felt.upright({0.001, 0.01}, -0.01);
    const Rendering valley = felt.upright({0.001, 0.01}, 0.001);
    EXPECT_NEAR(valley.force.z, kStiffness * (0.001 - 0.0004), 1e-12);
    EXPECT_NEAR(valley.force.x, 0, 1e-9);
    EXPECT_EQ(valley.contacts, 1);
  }
}

TEST(TexturedContact, NothingIsFeltAboveTheGroove) {
  Plate felt(sine());
  const Rendering none = felt.upright({0.001, 0}, 0.0003);
  EXPECT_EQ(none.force, Vec3(0));
  EXPECT_EQ(none.contacts, 0);
  EXPECT_EQ(none.object, -1);
}

TEST(TexturedContact, FlankPushesAlongItsNormal) {
  const stimuli::TextureSpec spec = sine();
  Plate felt(spec);
  for (double x = 0.0001; x < 0.004; x += 0.00013) {
    const Rendering flank = felt.upright({x, 0}, 0.0005);
    const double q = 2 * std::numbers::pi / spec.period;
    const double u = flank.ideal.tip.x;
    const double slope = -0.5 * spec.depth * q * std::sin(q * u);
    EXPECT_NEAR(flank.force.x / flank.force.z, -slope, 1e-8);
    EXPECT_NEAR(flank.ideal.tip.z, kTop - 0.5 * spec.depth * (1 - std::cos(q * u)), 1e-14);
    EXPECT_NEAR(glm::length(flank.force), kStiffness * flank.deepest.depth, 1e-12);
    EXPECT_NEAR(glm::length(glm::cross(flank.force, flank.deepest.normal)), 0, 1e-12);
  }
}

TEST(TexturedContact, MeanForceEqualsMeanHeight) {
  const stimuli::TextureSpec spec = sine(0.002, 0.00001);
  Plate felt(spec);
  double sum = 0;
  constexpr int kPlaces = 1000;
  for (int i = 0; i < kPlaces; ++i)
    sum += felt.upright({0.002 * i / kPlaces, 0}, 0.0003).force.z / kPlaces;
  EXPECT_NEAR(sum, kStiffness * (0.0003 - 0.000005), 1e-3 * sum);
}

/// The virtual probe `over` m below the valley.
double stiffness_across_valley(const stimuli::TextureSpec& spec, double over) {
  Plate felt(spec);
  constexpr double kStep = 1e-8;
  felt.upright({0.001, 0}, spec.depth + over);
  const double right = felt.upright({0.001 + kStep, 0}, spec.depth + over).force.x;
  const double left = felt.upright({0.001 - kStep, 0}, spec.depth + over).force.x;
  return (left - right) / (2 * kStep);
}

TEST(TexturedContact, ValleyIsSofterThanTheMaterial) {
  const stimuli::TextureSpec spec = sine();
  const double kappa = curvature(spec);
  for (const auto& [over, figure] :
       {std::pair{0.0002, 226.4346}, {0.001, 530.9949}, {0.002, 638.3133}}) {
    const double expected = kStiffness * kappa * over / (1 + kappa * over);
    EXPECT_NEAR(expected, figure, 1e-4);
    EXPECT_NEAR(stiffness_across_valley(spec, over), expected, 1e-5 * expected);
  }
}

/// J, and the length of the path weighted by force; of closed paths.
struct Work {
  double work = 0, way = 0;
  double largest_step = 0;  ///< N, of the force
};

/// A smooth closed path in x and depth.
Work round_a_loop(Plate& felt, Random& random, int steps, double depth, double swing) {
  std::array<double, 12> a;
  for (double& one : a) one = random.normal();
  const auto at = [&](double s) {
    double x = 0, y = 0, z = 0;
    for (std::size_t k = 1; k <= 2; ++k) {
      const double angle = 2 * std::numbers::pi * static_cast<double>(k) * s;
      x += (a[k] * std::sin(angle) + a[k + 2] * std::cos(angle)) / static_cast<double>(k);
      y += (a[k + 4] * std::sin(angle) + a[k + 6] * std::cos(angle)) / static_cast<double>(k);
      z += (a[k + 7] * std::sin(angle) + a[k + 9] * std::cos(angle)) / static_cast<double>(k);
    }
    return Vec3(0.003 * x, 0.003 * y, kTop - depth - swing * std::tanh(z));
  };
  Work sum;
  Vec3 last_place, last_force;
  for (int lap = 0; lap < 2; ++lap) {
    for (int i = 0; i <= steps; ++i) {
      const Vec3 tip = at(static_cast<double>(i) / steps);
      const Vec3 force = felt.tick(tip, tip + Vec3(0, 0, kLength)).force;
      if (lap == 1 && i > 0) {
        const Vec3 step = tip - last_place, mean = 0.5 * (force + last_force);
        sum.work += glm::dot(mean, step);
        sum.way += glm::length(mean) * glm::length(step);
        sum.largest_step = std::max(sum.largest_step, glm::length(force - last_force));
      }
      last_place = tip;
      last_force = force;
    }
  }
  return sum;
}

TEST(TexturedContact, ClosedPathsMakeNoEnergy) {
  Random random(11);
  for (const double depth : {0.0003, 0.0008, 0.002}) {
    const stimuli::TextureSpec spec = sine();
    Plate felt(spec);
    for (int loop = 0; loop < 8; ++loop) {
      const Work sum = round_a_loop(felt, random, 40'000, depth, 0.0002);
      EXPECT_LE(sum.work, 1e-6 * sum.way) << depth;
      // Shallow enough, it never snaps from groove to groove.
      if (curvature(spec) * (depth + 0.0002) < 0.999) {
        EXPECT_NEAR(sum.work, 0, 1e-6 * sum.way) << depth;
      }
    }
  }
}

TEST(TexturedContact, TwoDimensionalKindsMakeNoEnergy) {
  Random random(12);
  for (const Kind kind : {Kind::cones, Kind::noise}) {
    stimuli::TextureSpec spec = sine(0.003, 0.0002);
    spec.kind = kind;
    spec.ramp = 0.0006;
    Plate felt(spec);
    for (int loop = 0; loop < 6; ++loop) {
      const Work sum = round_a_loop(felt, random, 20'000, 0.0008, 0.0003);
      EXPECT_LE(sum.work, 2e-6 * sum.way);
    }
  }
}

/// J round a closed path of poses of the stylus, tip and direction, over the path's force times
/// way. \param pose  of a share of the path, 0 to 1
template <class PoseAt>
Work round_poses(Plate& felt, const PoseAt& pose, int steps) {
  Work sum;
  Vec3 last_tip, last_d, last_force, last_torque;
  for (int i = 0; i <= 2 * steps; ++i) {
    const auto [tip, d] = pose(static_cast<double>(i % steps) / steps);
    const Rendering now = felt.tick(tip, tip + d);
    if (i > steps) {
      const Vec3 force = 0.5 * (now.force + last_force), torque = 0.5 * (now.torque + last_torque);
      const Vec3 turn = glm::cross(0.5 * (d + last_d), d - last_d) / (kLength * kLength);
      sum.work += glm::dot(force, tip - last_tip) + glm::dot(torque, turn);
      sum.way += glm::length(force) * glm::length(tip - last_tip) +
                 glm::length(torque) * glm::length(turn);
    }
    last_tip = tip;
    last_d = d;
    last_force = now.force;
    last_torque = now.torque;
  }
  return sum;
}

TEST(TexturedContact, TurningStylusMakesNoEnergyOnAFace) {
  Random random(21);
  Plate felt(sine(), ray_renderer());
  for (int loop = 0; loop < 6; ++loop) {
    const double a = random.normal(), b = random.normal(), c = random.normal();
    const Work sum = round_poses(
        felt,
        [&](double s) {
          const double angle = 2 * std::numbers::pi * s;
          const Vec3 d = kLength * glm::normalize(Vec3(0.3 + 0.02 * a * std::sin(angle),
                                                       0.2 + 0.02 * b * std::cos(angle), 0.9));
          return std::pair(Vec3(0.001 * std::cos(angle) + 0.0007 * c, 0.002 * std::sin(angle),
                                kTop - 0.0007 + 0.0001 * std::sin(2 * angle)),
                           d);
        },
        20'000);
    EXPECT_LE(sum.work, 1e-6 * sum.way);
  }
}

TEST(TexturedContact, TurningStylusMakesLittleEnergyOnAnEdge) {
  // The place on the edge depends on the depth when the stylus turns.
  Random random(22);
  Plate felt(sine(), ray_renderer());
  double most = 0;
  for (int loop = 0; loop < 6; ++loop) {
    const double a = random.normal(), b = random.normal();
    const Work sum = round_poses(
        felt,
        [&](double s) {
          const double angle = 2 * std::numbers::pi * s;
          const Vec3 d = kLength * glm::normalize(Vec3(0.01 * a * std::sin(angle),
                                                       1 + 0.01 * b * std::cos(angle), -1));
          const Vec3 n = glm::normalize(Vec3(0, 1, 1));
          const Vec3 on(0.0005 * std::sin(angle + 0.7), 0.05, kTop);
          return std::pair(on - (0.00035 + 0.00005 * std::cos(2 * angle)) * n - 0.5 * d, d);
        },
        20'000);
    most = std::max(most, std::abs(sum.work) / sum.way);
  }
  EXPECT_LE(most, 5e-4);
  EXPECT_GT(most, 0);
}

TEST(TexturedContact, AlongTheRidgesNothingIsFelt) {
  Plate felt(sine());
  const Rendering here = felt.upright({0.0004, -0.02}, 0.0006);
  const Rendering there = felt.upright({0.0004, 0.02}, 0.0006);
  EXPECT_NEAR(glm::length(here.force - there.force), 0, 1e-12);
}

TEST(TexturedContact, LyingAcrossRidgesLosesThem) {
  Plate felt(sine(), ray_renderer());
  // Flat on the plate, 1 mm deep, the tip on it and the tail beyond its border.
  const auto lie = [&](double x, double y, const Vec3& along) {
    const Vec3 tip(x, y, kTop - 0.001);
    felt.tick(tip + Vec3(0, 0, 0.02), tip + Vec3(0, 0, 0.02) + kLength * along);
    return felt.tick(tip, tip + kLength * along);
  };
  double low = HUGE_VAL, high = 0;
  for (int i = 0; i < 40; ++i) {
    const Rendering across = lie(-0.01 + 0.00005 * i, 0, {1, 0, 0});
    EXPECT_EQ(across.deepest.type, ContactType::segment_face);
    EXPECT_NEAR(across.force.z, kStiffness * (0.001 - 0.0002), 0.02 * kStiffness * 0.001);
    const double along = lie(-0.01 + 0.00005 * i, -0.02, {0, 1, 0}).force.z;
    low = std::min(low, along);
    high = std::max(high, along);
  }
  EXPECT_GT(high - low, 0.9 * kStiffness * 0.0004 * 0.5);
}

TEST(TexturedContact, EdgesFeelTheirOwnProfile) {
  // The side of the stylus on the plate's edge along x.
  const stimuli::TextureSpec spec = sine();
  Plate felt(spec, ray_renderer());
  const Vec3 d = kLength * glm::normalize(Vec3(0, 1, -1));
  const auto rest = [&](double x, double depth) {
    const Vec3 on(x, 0.05, kTop);
    const Vec3 n = glm::normalize(Vec3(0, 1, 1));
    const Vec3 tip = on - depth * n - 0.5 * d;
    felt.tick(tip + 0.02 * n, tip + 0.02 * n + d);
    return felt.tick(tip, tip + d);
  };
  const Rendering crest = rest(0.002, 0.0003), valley = rest(0.001, 0.001);
  EXPECT_EQ(crest.deepest.type, ContactType::segment_edge);
  EXPECT_NEAR(glm::length(crest.force), kStiffness * 0.0003, 1e-9);
  EXPECT_NEAR(glm::length(valley.force), kStiffness * 0.0006, 1e-9);
  const Rendering flank = rest(0.0015, 0.0008);
  EXPECT_NEAR(glm::dot(flank.force, d), 0, 1e-9);  // nothing along the stylus
  EXPECT_LT(flank.force.x, -0.01);
}

TEST(TexturedContact, SeamOfTwoPlatesIsNotFelt) {
  const stimuli::Material of = material(sine());
  stimuli::Material shifted = of;
  shifted.texture = std::make_shared<const stimuli::Texture>(
      of.texture->in_frame({Vec3(0.1, 0, 0), Quat(1, 0, 0, 0)}));
  for (const Renderer* renderer : {&point_renderer(), &ray_renderer()}) {
    Plate two({plate(of), plate(shifted, {0.1, 0.1, 2 * kTop}, {Vec3(0.1, 0, 0), {}})}, *renderer);
    Plate one({plate(of, {0.4, 0.1, 2 * kTop})}, *renderer);
    for (double x = 0.045; x < 0.055; x += 0.00004) {
      const Rendering a = two.upright({x, 0}, 0.0011), b = one.upright({x, 0}, 0.0011);
      ASSERT_NEAR(glm::length(a.force - b.force), 0, 1e-5) << x;
    }
  }
}

TEST(TexturedContact, TurnedObjectTurnsItsTexture) {
  const Pose turned{{0.01, 0.02, 0.03}, glm::normalize(Quat(0.8, 0.1, -0.4, 0.3))};
  Plate still(sine());
  Plate other({plate(material(sine()), {0.1, 0.1, 2 * kTop}, turned)}, point_renderer());
  Random random(3);
  for (int i = 0; i < 500; ++i) {
    const double x = 0.02 * (random.unit() - 0.5);
    const auto both = [&](double depth) {
      const Vec3 tip(x, 0.01, kTop - depth), tail = tip + Vec3(0, 0, kLength);
      const auto out = [&](const Vec3& v) { return turned.orientation * v + turned.position; };
      const Rendering a = still.tick(tip, tail), b = other.tick(out(tip), out(tail));
      ASSERT_NEAR(glm::length(turned.orientation * a.force - b.force), 0, 1e-7);
    };
    both(-0.01);
    both(0.0006);
  }
}

TEST(TexturedContact, FrictionDragsOnTheFlank) {
  const stimuli::TextureSpec shallow = sine(0.002, 0.00002);
  stimuli::Material rough = material(shallow);
  rough.friction_static = rough.friction_dynamic = 0.4;
  Plate with({plate(rough)}, point_renderer()), without(shallow);
  double extra = 0;
  for (int i = 0; i < 4000; ++i) {
    const double x = 0.000005 * i;
    const Rendering a = with.upright({x, 0}, 0.0008), b = without.upright({x, 0}, 0.0008);
    if (i < 1000) continue;
    extra += (b.force.x - a.force.x) / 3000;
    EXPECT_TRUE(std::isfinite(a.force.x));
  }
  EXPECT_NEAR(extra, 0.4 * kStiffness * 0.00079, 0.01 * 0.4 * kStiffness * 0.00079);
}

/// Random ticks over plates, spheres and cylinders with all kinds of textures, which must stay
/// finite and bounded. \return the number of ticks in contact
long wander(long ticks, std::uint64_t seed) {
  Random random(seed);
  long touched = 0;
  std::vector<stimuli::TextureSpec> specs;
  for (const Kind kind : {Kind::sine, Kind::trapezoid, Kind::cones, Kind::noise}) {
    for (const double tip : {0.0, 0.0004}) {
      stimuli::TextureSpec spec = sine(0.0015, 0.0003);
      spec.kind = kind;
      spec.ramp = 0.0003;
      spec.ridge = 0.0005;
      spec.tip_radius = tip;
      spec.direction = glm::normalize(Vec3(random.normal(), random.normal(), random.normal()));
      specs.push_back(spec);
    }
  }
  stimuli::TextureSpec around = sine(0.0015, 0.0003);
  around.around = true;
  specs.push_back(around);
  const std::vector<stimuli::PolygonSoup> shapes = {stimuli::box({0.05, 0.05, 0.02}),
                                                    stimuli::cylinder(0.02, 0.05, 64),
                                                    stimuli::icosphere(0.02, 4)};
  std::vector<std::shared_ptr<const stimuli::Texture>> textures;
  for (const stimuli::TextureSpec& spec : specs)
    textures.push_back(std::make_shared<const stimuli::Texture>(spec, 0.02));
  std::vector<std::shared_ptr<const stimuli::ConvexMesh>> meshes;
  for (const stimuli::PolygonSoup& soup : shapes)
    meshes.push_back(std::make_shared<const stimuli::ConvexMesh>(soup));
  constexpr long kRun = 2000;
  for (long done = 0; done < ticks; done += kRun) {
    const auto& texture = textures[random.below(textures.size())];
    SceneObject object = testing::placed_object(meshes[random.below(meshes.size())]);
    object.material.texture = texture;
    if (random.below(3) == 0)
      object.material.friction_static = object.material.friction_dynamic = 0.3;
    if (random.below(3) == 0) object.material.damping = 1;
    const Renderer& renderer = random.below(2) == 0 ? point_renderer() : ray_renderer();
    std::vector<SceneObject> objects{object};
    if (random.below(4) == 0) {  // a union of two
      SceneObject second = object;
      second.pose.position = Vec3(0.01, 0.005, 0.003);
      second.solid = objects[0].solid = 0;
      second.object = 1;
      objects.push_back(second);
    }
    const Scene scene(objects);
    RenderState state = scene.initial_state();
    for (SceneObject& one : objects) one.material.texture = nullptr;
    const Scene bare(objects);
    RenderState bare_state = bare.initial_state();
    const double jump = random.below(10) == 0 ? 0.003 : 0.0002;
    Vec3 tip(0.04 * random.normal(), 0.04 * random.normal(), 0.04 * random.normal());
    Vec3 along = glm::normalize(Vec3(random.normal(), random.normal(), random.normal()));
    const Vec3 step = -jump * glm::normalize(tip);
    for (long i = 0; i < kRun; ++i) {
      tip += jump * 0.7 * Vec3(random.normal(), random.normal(), random.normal());
      tip += glm::length(tip) > 0.018 ? step : -step;
      along =
          glm::normalize(along + 0.01 * Vec3(random.normal(), random.normal(), random.normal()));
      const Rendering felt = renderer.tick(scene, state, {tip, tip + kLength * along}, kTick);
      touched += felt.contacts > 0;
      const Vec3 all = felt.force + felt.torque + felt.device2;
      if (!std::isfinite(all.x + all.y + all.z) || (felt.faults & render_fault::kNonFinite) != 0) {
        ADD_FAILURE() << "not finite at tick " << done + i;
        return touched;
      }
      // At rest, u = -(d + h) h': no farther than the steepest flank, on an edge at the most
      // acute angle, allows. Without a contact of the smooth object there is none.
      const Rendering smooth = renderer.tick(bare, bare_state, {tip, tip + kLength * along}, kTick);
      const double most = smooth.deepest.depth * std::hypot(1, texture->greatest_slope() / 0.1);
      if (felt.deepest.depth > most * (1 + 1e-9)) {
        ADD_FAILURE() << "depth " << felt.deepest.depth << " at tick " << done + i;
        return touched;
      }
      if ((felt.faults & render_fault::kTextureLost) != 0) {
        ADD_FAILURE() << "texture-lost at tick " << done + i << " kind "
                      << static_cast<int>(
                             specs[static_cast<std::size_t>(
                                       std::find(textures.begin(), textures.end(), texture) -
                                       textures.begin())]
                                 .kind);
        return touched;
      }
    }
  }
  return touched;
}

// PALPATE_TEXTURE_TICKS=10000000 for the long search.
TEST(TexturedContact, RandomTicksStayFinite) {
  const char* const wanted = std::getenv("PALPATE_TEXTURE_TICKS");
  const long ticks = wanted != nullptr ? std::atol(wanted) : 200'000;
  EXPECT_GT(wander(ticks, 17), ticks / 10);
}

TEST(TexturedContact, ForceStepsAreBoundedBetweenSnaps) {
  // Shallow enough never to snap: a step of force is at most k times the step and slope's share.
  const stimuli::TextureSpec spec = sine(0.004, 0.0001);
  for (const Renderer* renderer : {&point_renderer(), &ray_renderer()}) {
    Plate felt(spec, *renderer);
    Random random(5);
    Vec3 tip(0, 0, kTop - 0.0008), last_force(0);
    double angle = 1.2;
    for (int i = 0; i < 100'000; ++i) {
      const Vec3 step =
          1e-6 * glm::normalize(Vec3(random.normal(), random.normal(), random.normal()));
      Vec3 next = tip + step;
      if (std::abs(next.x) > 0.03 || std::abs(next.y) > 0.03 ||
          std::abs(next.z - kTop + 0.0008) > 0.0004)
        next = tip - step;
      const Vec3 tail = next + kLength * Vec3(std::cos(angle), 0, std::sin(angle));
      const Vec3 force = felt.tick(next, tail).force;
      if (i > 0) {
        ASSERT_LE(
            glm::length(force - last_force),
            kStiffness * 1e-6 * (2 + felt.scene().parts()[0].material.texture->greatest_slope()));
      }
      tip = next;
      last_force = force;
    }
  }
}

}  // namespace
}  // namespace palpate::rendering
