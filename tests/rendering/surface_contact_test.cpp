// The contact law of closed surfaces (rendering/surface_contact.h), by what must hold of it.

#include "rendering/surface_contact.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "data/base/random.h"
#include "rendering/surface_patch.h"
#include "runner/evidence/tick_meters.h"
#include "runner/evidence/verification/surface_stroke.h"
#include "stimuli/closed_surface.h"
#include "stimuli/orientation.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"
#include "stimuli/surfaces/surface_search.h"
#include "tests/shared/random_polyhedron.h"
#include "tests/shared/union_scenes.h"

namespace palpate::rendering {
namespace {
namespace surfaces {

using testing::box_soup;
using testing::kTick;
using testing::object_of;
using testing::prism;

constexpr double kStiffness = 1000;  // N/m

stimuli::Material spring() {
  stimuli::Material material;
  material.stiffness = kStiffness;
  return material;
}

SceneSurface surface_of(const std::vector<stimuli::PolygonSoup>& soups) {
  std::vector<stimuli::SurfaceShell> shells;
  shells.reserve(soups.size());
  for (const stimuli::PolygonSoup& soup : soups)
    shells.push_back(
        {std::make_shared<const stimuli::ClosedSurface>(stimuli::closed_surface(soup).surface),
         Pose{}, spring()});
  return {std::make_shared<const stimuli::Surface>(shells), Pose{}, 0};
}

Scene scene_of(const std::vector<stimuli::PolygonSoup>& soups, const Tool& tool = {}) {
  return Scene({}, true, tool, nullptr, {surface_of(soups)});
}

/// A block whose upper side bends up (a valley) or down (a ridge) by an angle along x = 0.
stimuli::PolygonSoup bent_block(double angle) {
  return prism({{-0.05, -0.06}, {0.05, -0.06}, {0.05, 0.05 * std::tan(angle)}, {0, 0}, {-0.05, 0}},
               0.05);
}

/// A height field of cells: flat faces in many triangles, edges of 90 degrees of both kinds.
stimuli::PolygonSoup stairs(Random& random, int cells, double edge) {
  stimuli::PolygonSoup soup;
  std::vector<int> heights;
  heights.reserve(static_cast<std::size_t>(cells) * static_cast<std::size_t>(cells));
  for (int i = 0; i < cells * cells; ++i)
    heights.push_back(1 + static_cast<int>(random.unit() * cells));
  const auto solid = [&](const std::array<int, 3>& c) {
    if (*std::min_element(c.begin(), c.end()) < 0 || c[0] >= cells || c[1] >= cells) return false;
    return c[2] < heights[static_cast<std::size_t>(c[0]) * static_cast<std::size_t>(cells) +
                          static_cast<std::size_t>(c[1])];
  };
  for (int x = 0; x < cells; ++x) {
    for (int y = 0; y < cells; ++y) {
      for (int z = 0; z < cells; ++z) {
        if (!solid({x, y, z})) continue;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          for (const int side : {0, 1}) {
            std::array<int, 3> beyond{x, y, z};
            beyond[axis] += side == 1 ? 1 : -1;
            if (solid(beyond)) continue;
            std::vector<std::uint32_t> face;
            for (const auto& [u, w] : {std::array{0, 0}, {1, 0}, {1, 1}, {0, 1}}) {
              std::array<int, 3> corner{x, y, z};
              corner[axis] += side;
              corner[(axis + 1) % 3] += u;
              corner[(axis + 2) % 3] += w;
              face.push_back(static_cast<std::uint32_t>(soup.vertices.size()));
              soup.vertices.push_back(edge / cells * Vec3(corner[0], corner[1], corner[2]));
            }
            if (side == 0) std::reverse(face.begin(), face.end());
            soup.faces.push_back(face);
          }
        }
      }
    }
  }
  return soup;
}

stimuli::PolygonSoup torus(int around, int across, double large, double small) {
  stimuli::PolygonSoup soup;
  const auto at = [&](int i, int k) {
    return static_cast<std::uint32_t>(i % around * across + k % across);
  };
  for (int i = 0; i < around; ++i) {
    for (int k = 0; k < across; ++k) {
      const double a = 2 * std::numbers::pi * i / around, b = 2 * std::numbers::pi * k / across;
      const double r = large + small * std::cos(b);
      soup.vertices.emplace_back(r * std::cos(a), r * std::sin(a), small * std::sin(b));
      soup.faces.push_back({at(i, k), at(i + 1, k), at(i + 1, k + 1)});
      soup.faces.push_back({at(i, k), at(i + 1, k + 1), at(i, k + 1)});
    }
  }
  return soup;
}

Vec3 direction(Random& random) {
  for (;;) {
    const Vec3 v(random.unit() * 2 - 1, random.unit() * 2 - 1, random.unit() * 2 - 1);
    const double length = glm::length(v);
    if (length > 0.1 && length < 1) return v / length;
  }
}

/// Turned, then rounded as a binary STL file has it.
stimuli::PolygonSoup as_in_a_file(stimuli::PolygonSoup soup, Random& random) {
  const Quat turn = glm::angleAxis(3 * random.unit(), direction(random));
  for (Vec3& v : soup.vertices) {
    v = turn * v;
    for (int k = 0; k < 3; ++k) v[k] = static_cast<double>(static_cast<float>(v[k]));
  }
  return soup;
}

/// m, by which a segment goes through the surface; 0: it does not.
double through(const stimuli::Surface& surface, const Vec3& start, const Vec3& along) {
  double worst = 0;
  for (const stimuli::SurfaceTriangle& t : surface.triangles()) {
    const double a = glm::dot(t.normal, start) - t.offset, b = a + glm::dot(t.normal, along);
    if (a * b >= 0) continue;
    const Vec3 crossing = start + a / (a - b) * along;
    double inside = std::min(std::abs(a), std::abs(b));
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 &v = surface.vertices()[t.corners[k]],
                 &w = surface.vertices()[t.corners[(k + 1) % 3]];
      inside =
          std::min(inside, glm::dot(glm::cross(t.normal, glm::normalize(w - v)), crossing - v));
    }
    worst = std::max(worst, inside);
  }
  return worst;
}

double distance(const stimuli::Surface& surface, const Vec3& p) {
  double least = HUGE_VAL;
  for (const stimuli::SurfaceTriangle& t : surface.triangles()) {
    PatchPolygon polygon;
    polygon.count = 3;
    for (std::size_t k = 0; k < 3; ++k) polygon.corners[k] = surface.vertices()[t.corners[k]];
    least = std::min(
        least, std::hypot(distance_off(polygon, t.normal, p), glm::dot(t.normal, p) - t.offset));
  }
  return least;
}

/// A hand that presses at random places, slides on and turns.
class Hand {
 public:
  Hand(const stimuli::Surface& surface, Random& random) : surface_(surface), random_(random) {}
  LineProbe next() {
    if (ticks_++ % 50 == 0) {
      const auto pick = static_cast<std::size_t>(random_.unit() *
                                                 static_cast<double>(surface_.triangles().size()));
      const stimuli::SurfaceTriangle& t = surface_.triangles()[pick];
      Vec3 middle(0);
      for (const std::uint32_t corner : t.corners) middle += surface_.vertices()[corner] / 3.0;
      goal_ = middle + (ticks_ % 1000 == 1 ? 0.05 : 0.005 * random_.unit() - 0.004) * t.normal;
      turn_ = glm::normalize(t.normal + 1.2 * random_.unit() * direction(random_));
      step_ = random_.unit() < 0.1 ? 2e-3 : 3e-4 * random_.unit();
    }
    const Vec3 way = goal_ - tip_;
    const double length = glm::length(way);
    tip_ += length > step_ ? step_ / length * way : way;
    along_ = glm::normalize(along_ + 0.02 * random_.unit() * (turn_ - along_));
    return {tip_, tip_ + 0.12 * along_};
  }

 private:
  const stimuli::Surface& surface_;
  Random& random_;
  Vec3 tip_{0, 0, 0.15}, along_{0, 0, 1}, goal_, turn_{0, 0, 1};
  double step_ = 0;
  int ticks_ = 0;
};

class SurfaceContact : public ::testing::TestWithParam<const Renderer*> {
 protected:
  static Rendering tick(const Scene& scene, RenderState& state, const LineProbe& probe) {
    return GetParam()->tick(scene, state, probe, kTick);
  }
  /// From above onto `tip`, upright, in steps of 0.1 mm.
  static Rendering press(const Scene& scene, RenderState& state, const Vec3& tip) {
    Rendering r;
    for (double above = 0.03; above > 0; above -= 1e-4)
      r = tick(scene, state, standing(tip + Vec3(0, 0, above)));
    return tick(scene, state, standing(tip));
  }
  static LineProbe standing(const Vec3& tip) { return {tip, tip + Vec3(0, 0, 0.1)}; }
};

TEST_P(SurfaceContact, TheIdealToolIsNeverInside) {
  constexpr std::uint64_t kSeed = 11;
  Random random(kSeed);
  for (int round = 0; round < 6; ++round) {
    const stimuli::PolygonSoup soup = as_in_a_file(
        round % 2 == 0 ? torus(12 + round, 8, 0.03, 0.01) : stairs(random, 2 + round % 3, 0.05),
        random);
    const SceneSurface placed = surface_of({soup});
    const stimuli::Surface& surface = *placed.surface;
    const Scene scene({}, true, {}, nullptr, {placed});
    RenderState state = scene.initial_state();
    Hand hand(surface, random);
    const double rounding = 1e-11 * surface.size();
    int contacts = 0;
    for (int i = 0; i < 8000; ++i) {
      const LineProbe probe = hand.next();
      const std::uint64_t before = runner::evidence::allocations();
      const Rendering r = tick(scene, state, probe);
      ASSERT_EQ(runner::evidence::allocations(), before);
      ASSERT_EQ(r.faults & ~render_fault::kReleased, 0U) << round << ' ' << i;
      if (r.contacts == 0 || (r.faults & render_fault::kReleased) != 0) continue;
      ++contacts;
      ASSERT_NEAR(glm::length(r.force - kStiffness * (r.ideal.tip - probe.tip)), 0,
                  GetParam()->side_contact() ? HUGE_VAL : 1e-9);
      if (GetParam()->side_contact()) {
        ASSERT_LE(through(surface, r.ideal.tip, r.ideal.tail - r.ideal.tip), rounding)
            << round << ' ' << i;
      } else if (surface.winding(r.ideal.tip) > 0) {
        ASSERT_LE(distance(surface, r.ideal.tip), rounding) << round << ' ' << i;
      }
    }
    EXPECT_GT(contacts, 1000);
  }
}

TEST_P(SurfaceContact, ConvexMeshGivesTheForcesOfTheWalk) {
  constexpr std::uint64_t kSeed = 5;
  Random random(kSeed);
  const stimuli::PolygonSoup soup = stimuli::icosphere(0.03, 2);
  const SceneSurface placed = surface_of({soup});
  const Scene surface({}, true, {}, nullptr, {placed});
  const Scene walk(object_of({soup}, Pose{}, kStiffness));
  RenderState a = surface.initial_state(), b = walk.initial_state();
  for (int i = 0; i < 300; ++i) {
    // Down on the flank, then along it and turning slowly.
    const Vec3 tip = Vec3(0.004, 0.003, 0.05 - 1e-4 * std::min(i, 215)) +
                     2e-5 * std::max(0, i - 215) * Vec3(1, 0.5, 0);
    const LineProbe probe{tip, tip + 0.1 * glm::normalize(Vec3(0.5 + 0.0005 * i, 0.1, 1))};
    const Rendering one = tick(surface, a, probe), other = tick(walk, b, probe);
    ASSERT_NEAR(glm::length(one.force - other.force), 0, 1e-9) << i;
    ASSERT_NEAR(glm::length(one.torque - other.torque), 0, 1e-9) << i;
    ASSERT_EQ(one.deepest.type, other.deepest.type) << i;
  }
}

TEST_P(SurfaceContact, CrossesAnyBendWithoutAStepOrStop) {
  for (const double bend : {1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 0.5}) {
    for (const double angle : {bend, -bend}) {
      const Scene scene = scene_of({bent_block(angle)});
      RenderState state = scene.initial_state();
      const double deep = 0.002;
      press(scene, state, {-0.01, 0, -deep});
      Vec3 last(0);
      for (int i = 0; i <= 2000; ++i) {
        const double x = -0.01 + 1e-5 * i;
        const Rendering r = tick(scene, state, standing({x, 0.001, -deep}));
        ASSERT_EQ(r.faults, 0U);
        // Nearest allowed point: on the flat, on the slope, or in the valley's bottom.
        const double c = std::cos(angle), s = std::sin(angle);
        const double flat = deep, slope = std::max(0.0, deep * c + x * s);  // depths
        Vec3 expected = x < 0 ? Vec3(0, 0, flat) : slope * Vec3(-s, 0, c);
        if (angle > 0) {
          const bool on_flat = x <= 0, on_slope = x * c - deep * s >= 0;
          expected = on_flat    ? Vec3(0, 0, flat)
                     : on_slope ? slope * Vec3(-s, 0, c)
                                : Vec3(-x, 0, deep);
        } else if (std::abs(x) < deep * std::abs(s) + 1e-9) {
          continue;  // over a ridge either face may hold it
        }
        ASSERT_NEAR(glm::length(r.force / kStiffness - expected), 0, 1e-9) << angle << " at " << x;
        if (i > 0 && angle > 0) {
          ASSERT_LT(glm::length(r.force - last), kStiffness * 3e-5) << angle << ' ' << x;
        }
        last = r.force;
      }
    }
  }
}

TEST_P(SurfaceContact, SidesBentByRoundingDoNotAlternateForever) {
  // Two halves of a face that bend up by 8e-8 rad, pressed 50 mm deep: within its skin the tool
  // does not see the bottom of that valley.
  const Scene scene = scene_of({bent_block(8e-8)});
  RenderState state = scene.initial_state();
  for (double z = 0.02; z > -0.05; z -= 1e-4) {
    const Rendering r = tick(scene, state, standing({1e-9, 0, z}));
    ASSERT_EQ(r.faults, 0U);
    if (z >= 0) continue;
    ASSERT_NEAR(glm::length(r.force - Vec3(0, 0, -kStiffness * z)), 0, 1e-4);
  }
}

using Corners = std::array<std::uint32_t, 3>;

/// The triangle beyond each side. \param triangles  closed, two to an edge
std::vector<Corners> neighbours_of(const std::vector<Corners>& triangles) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> over;
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) over[{triangles[i][(k + 1) % 3], triangles[i][k]}] = i;
  }
  std::vector<Corners> across(triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k)
      across[i][k] = over.at({triangles[i][k], triangles[i][(k + 1) % 3]});
  }
  return across;
}

/// A cube of 0.1 m with a triangle whose corners are in one line along an edge of its lower face,
/// or with two of them, each along the other.
stimuli::ClosedSurface cube_with_flat_triangles(bool two) {
  stimuli::ClosedSurface cube = stimuli::closed_surface(box_soup(Vec3(-0.05), Vec3(0.05))).surface;
  std::vector<Vec3>& places = cube.vertices;
  std::vector<Corners>& triangles = cube.triangles;
  const auto normal = [&](const Corners& t) {
    return glm::normalize(glm::cross(places[t[1]] - places[t[0]], places[t[2]] - places[t[0]]));
  };
  // Puts a corner at a share of the side from a to b and divides the triangle there.
  const auto divide = [&](std::uint32_t triangle, std::size_t k, double share) {
    const std::uint32_t a = triangles[triangle][k], b = triangles[triangle][(k + 1) % 3],
                        apex = triangles[triangle][(k + 2) % 3];
    const auto middle = static_cast<std::uint32_t>(places.size());
    places.push_back((1 - share) * places[a] + share * places[b]);
    triangles[triangle] = {a, middle, apex};
    triangles.push_back({middle, b, apex});
    triangles.push_back({b, middle, a});
  };
  for (std::uint32_t low = 0; low < 12; ++low) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t side = cube.across[low][k];
      if (normal(triangles[low]).z > -0.9 || normal(triangles[side]).x < 0.9) continue;
      const std::uint32_t b = triangles[low][(k + 1) % 3];
      std::size_t j = 0;
      while (triangles[side][j] != b) ++j;
      divide(side, j, 0.75);
      if (two) divide(low, k, 0.4);
      cube.across = neighbours_of(triangles);
      return cube;
    }
  }
  return cube;
}

TEST_P(SurfaceContact, TrianglesWithoutAreaLeaveNoGap) {
  if (!GetParam()->side_contact()) return;
  for (const bool two : {false, true}) {
    const std::vector<stimuli::SurfaceShell> shells = {
        {std::make_shared<const stimuli::ClosedSurface>(cube_with_flat_triangles(two)), Pose{},
         spring()}};
    const auto surface = std::make_shared<const stimuli::Surface>(shells);
    int flat = 0;
    for (const stimuli::SurfaceTriangle& t : surface->triangles()) {
      const auto at = [&](std::size_t k) { return surface->vertices()[t.corners[k]]; };
      if (glm::length(glm::cross(at(1) - at(0), at(2) - at(0))) > 1e-12) continue;
      ++flat;
      EXPECT_TRUE(t.normal == Vec3(1, 0, 0) || t.normal == Vec3(0, 0, -1)) << "of its neighbours";
    }
    ASSERT_EQ(flat, two ? 2 : 1);
    const Scene scene({}, true, {}, nullptr, {{surface, Pose{}, 0}});
    const Vec3 edge(0.05, 0, -0.05), out = glm::normalize(Vec3(1, 0, -1)),
                                     along = 0.05 * glm::normalize(Vec3(1, 0.1, 1));
    for (double y = -0.045; y < 0.046; y += 0.01) {
      RenderState state = scene.initial_state();
      Rendering r;
      for (int i = -100; i <= 20; ++i) {
        const Vec3 tip = edge + Vec3(0, y, 0) - along - 1e-4 * i * out;
        r = tick(scene, state, {tip, tip + 2.0 * along});
      }
      ASSERT_NEAR(glm::length(r.force - kStiffness * 0.002 * out), 0, 1e-4) << two << ' ' << y;
    }
  }
}

TEST_P(SurfaceContact, RidgeUnderAFoldedSliverHoldsAStylus) {
  // As rounding does it, within the tolerance of winding numbers.
  if (!GetParam()->side_contact()) return;
  const Vec3 ridge(0.05, 0.003, 0.05), out = glm::normalize(Vec3(1, 0, 1)),
                                       along = 0.05 * glm::normalize(Vec3(1, 0.1, -1));
  for (const double high : {4e-8, 1e-6, 1e-4}) {
    for (const double over : {-1e-12, 0.0, 1e-13, 1e-12}) {
      const Scene scene = scene_of({prism(
          {{-0.05, -0.05}, {0.05, -0.05}, {0.05, 0.05 + high}, {0.05 + over, 0.05}, {-0.05, 0.05}},
          0.05)});
      RenderState state = scene.initial_state();
      Rendering r;
      for (int i = -100; i <= 20; ++i) {
        const Vec3 tip = ridge - along - 1e-4 * i * out;
        r = tick(scene, state, {tip, tip + 2.0 * along});
      }
      ASSERT_NEAR(glm::length(r.force), 2 + kStiffness * high * std::sqrt(0.5), 1e-5)
          << high << ' ' << over;
    }
  }
}

TEST_P(SurfaceContact, StylusGrowingIntoAFaceTouchesIt) {
  // Two devices hold the ends, so the stylus has no fixed length.
  if (!GetParam()->side_contact()) return;
  const Scene scene = scene_of({bent_block(0.1)});
  RenderState state = scene.initial_state();
  const auto hanging = [](const Vec3& tail, double length) {
    return LineProbe{tail + Vec3(0, 0, length), tail};
  };
  tick(scene, state, hanging({-0.02, 0, 3e-6}, 0.06));
  const Rendering r = tick(scene, state, hanging({-0.0196, 0, -1.4e-4}, 0.0601));
  EXPECT_EQ(r.faults, 0U);
  EXPECT_NEAR(glm::length(r.force - kStiffness * Vec3(0, 0, 1.4e-4)), 0, 1e-9);
}

TEST_P(SurfaceContact, ToolRestsAtTheFlatValleysBottom) {
  // Faces of files with rounded coordinates bend by 1e-7 to 1e-3 rad. A tip that is pressed
  // between their normals may not see the bottom within its skin.
  constexpr std::uint64_t kSeed = 5;
  Random random(kSeed);
  for (double bend = 1e-7; bend < 1; bend *= 1.3) {
    const Quat turn = stimuli::uniform_rotation(random);
    const double c = std::cos(bend), s = std::sin(bend);
    SceneSurface block = surface_of({bent_block(bend)});
    block.pose.orientation = turn;
    const Scene scene({}, true, {}, nullptr, {block});
    for (const double deep : {2e-5, 0.0005, 0.003}) {
      RenderState state = scene.initial_state();
      const double wide = deep * std::tan(bend);
      for (int i = -30; i <= 40; ++i) {
        // Down before the valley, then across it.
        const double x = wide * (i < 0 ? -1 : i / 20.0 - 1 + 1e-3 * random.unit());
        const double z = i < 0 ? 5e-4 * (-1 - i) - deep : -deep;
        const Vec3 tip(x, 0.0001 * i, z);
        const Rendering r = tick(scene, state, {turn * tip, turn * (tip + Vec3(0, 0, 0.1))});
        ASSERT_EQ(r.faults, 0U) << bend << ' ' << deep << ' ' << i;
        const double slope = -z * c + x * s;  // depth
        const Vec3 expected = z >= 0                 ? Vec3(0)
                              : x < 0                ? Vec3(0, 0, -z)
                              : x * c - deep * s < 0 ? Vec3(-x, 0, -z)
                                                     : slope * Vec3(-s, 0, c);
        ASSERT_NEAR(glm::length(r.force / kStiffness - turn * expected), 0, 1e-6 * deep)
            << bend << ' ' << deep << ' ' << i;
      }
    }
  }
}

TEST_P(SurfaceContact, ToolRestsWhereTwoShellsFacesCross) {
  // As a rounded file leaves them where shells overlap: the valley has no edge.
  for (double bend = 1e-8; bend < 1e-4; bend *= 1.5) {
    const double rise = 0.04 * std::tan(bend), c = std::cos(bend), s = std::sin(bend);
    const Scene scene =
        scene_of({box_soup({-0.05, -0.05, -0.08}, {0.05, 0.05, 0}),
                  prism({{-0.04, -0.07}, {0.04, -0.07}, {0.04, rise}, {-0.04, -rise}}, 0.04)});
    for (const double deep : {0.002, 0.02, 0.06}) {
      RenderState state = scene.initial_state();
      for (double z = 0.01; z > -deep; z -= 5e-4) tick(scene, state, standing({-0.001, 0, z}));
      for (int i = -20; i <= 40; ++i) {
        const double x = std::max(deep * bend, 1e-9) * i / 20;
        const Rendering r = tick(scene, state, standing({x, 0.0001 * i, -deep}));
        ASSERT_EQ(r.faults, 0U) << bend << ' ' << deep << ' ' << i;
        const double slope = deep * c + x * s;  // depth
        const Vec3 expected = x < 0                  ? Vec3(0, 0, deep)
                              : x * c - deep * s < 0 ? Vec3(-x, 0, deep)
                                                     : slope * Vec3(-s, 0, c);
        ASSERT_NEAR(glm::length(r.force / kStiffness - expected), 0, 1e-5 * deep)
            << bend << ' ' << deep << ' ' << i;
      }
    }
  }
}

TEST_P(SurfaceContact, CrackByRoundingBetweenShellsAdmitsNothing) {
  // A block on a plate, as an assembly is written with single precision.
  constexpr double kError = 4e-9;
  for (double gap : {-kError, 0.0, 0.1 * kError, 0.5 * kError, kError, 2 * kError}) {
    stimuli::PolygonSoup plate = box_soup({-0.05, -0.05, -0.02}, {0.05, 0.05, 0}),
                         block = box_soup({0, -0.02, gap}, {0.03, 0.02, 0.03});
    plate.coordinate_error = block.coordinate_error = kError;
    const Scene scene = scene_of({plate, block});
    RenderState state = scene.initial_state();
    for (double z = 0.01; z > -0.002; z -= 5e-4) tick(scene, state, standing({-0.01, 0.003, z}));
    for (double x = -0.01; x < 0.01; x += 3e-4) {
      const Rendering r = tick(scene, state, standing({x, 0.003, -0.002}));
      ASSERT_EQ(r.faults, 0U) << gap << ' ' << x;
      const Vec3 expected(-std::max(0.0, x), 0, 0.002);
      ASSERT_NEAR(glm::length(r.force / kStiffness - expected), 0, 1e-8) << gap << ' ' << x;
    }
  }
}

/// A corner as a file with so many decimals has it.
Vec3 rounded(const Vec3& corner, double decimals) {
  const double unit = std::pow(10.0, -decimals);
  Vec3 out;
  for (int c = 0; c < 3; ++c) out[c] = unit * std::round(corner[c] / unit);
  return out;
}

TEST_P(SurfaceContact, StepByRoundingBetweenShellsHoldsNothing) {
  // Two blocks of different sizes with their upper faces in one plane, turned.
  constexpr std::uint64_t kSeed = 11;
  Random random(kSeed);
  for (const int decimals : {5, 6, 7, 8, 9}) {
    for (int round = 0; round < 20; ++round) {
      const Quat turn = glm::angleAxis(3 * random.unit(), direction(random));
      std::vector<stimuli::PolygonSoup> blocks{
          box_soup({-0.05, -0.025, -0.05}, {0, 0.025, 0}),
          box_soup({0, -0.03 - 0.01 * random.unit(), -0.03}, {0.05, 0.03, 0})};
      for (stimuli::PolygonSoup& block : blocks) {
        for (Vec3& v : block.vertices) v = rounded(turn * v, decimals);
        block.coordinate_error = 0.5 * std::pow(10.0, -decimals);
      }
      const Scene scene = scene_of(blocks);
      const Vec3 along = turn * Vec3(1, 0, 0), up = turn * Vec3(0, 0, 1);
      const double way = round % 2 == 0 ? 1 : -1, depth = 1e-3;
      RenderState state = scene.initial_state();
      const auto touch = [&](double x, double height) {
        const Vec3 tip = way * x * along + height * up;
        return tick(scene, state, {tip, tip + turn * Vec3(0.02, 0.01, 0.11)});
      };
      // Straight down where the blocks meet.
      for (double height = 2e-3; height > -depth; height -= 1e-4) touch(0, height);
      ASSERT_NEAR(glm::dot(touch(0, -depth).force, up) / kStiffness, depth, 0.01 * depth)
          << decimals << ' ' << round;
      state = scene.initial_state();
      // Faces may be tilted by rounding: from end to end by some coordinate errors.
      const double tilt = 4 * blocks[0].coordinate_error / 0.03;
      // Slowly over the seam.
      for (double height = 2e-3; height > -depth; height -= 1e-4) touch(-0.02, height);
      for (double x = -0.02; x < 0.02; x += std::abs(x) < 1e-4 ? 3e-7 : 2e-4) {
        const Rendering r = touch(x, -depth);
        ASSERT_EQ(r.faults, 0U) << decimals << ' ' << round << ' ' << x;
        const Vec3 off = r.force / kStiffness - depth * up;
        ASSERT_LT(glm::length(off), 1e-9 + tilt * depth + 4 * blocks[0].coordinate_error)
            << decimals << ' ' << round << ' ' << x;
      }
    }
  }
}

TEST(SurfaceSeam, IsAsWideAsTheGapWithinError) {
  constexpr double kError = 1e-7;
  const auto seam = [&](const Vec3& low, double error) {
    stimuli::PolygonSoup plate = box_soup({-0.05, -0.05, -0.02}, {0.05, 0.05, 0}),
                         block = box_soup(low, low + Vec3(0.03, 0.04, 0.03));
    plate.coordinate_error = block.coordinate_error = error;
    return surface_of({plate, block}).surface->seam();
  };
  EXPECT_NEAR(seam({0, -0.02, kError}, kError), kError, 1e-15) << "a gap under a block";
  EXPECT_NEAR(seam({0, -0.02, -2 * kError}, kError), 2 * kError, 1e-15) << "an overlap";
  EXPECT_NEAR(seam({0.05, -0.02, -0.03 + 3 * kError}, kError), 3 * kError, 1e-15) << "a step";
  EXPECT_EQ(seam({0, -0.02, 5 * kError}, kError), 0) << "more than rounding";
  EXPECT_EQ(seam({0, -0.02, -0.01}, kError), 0) << "shells that pass through each other";
  EXPECT_EQ(seam({0.06, -0.02, -0.01}, kError), 0) << "apart";
  EXPECT_LT(seam({0, -0.02, 0}, kError), 1e-15) << "exact";
  EXPECT_EQ(seam({0, -0.02, kError}, 0), 0) << "coordinates that are not rounded";
}

TEST(SurfaceStylus, DoesNotEnterWhileGrowingFromItsTip) {
  const Scene scene = scene_of({box_soup({-0.05, -0.05, -0.02}, {0.05, 0.05, 0})});
  RenderState state = scene.initial_state();
  const Vec3 tip(0.001, 0.002, 0.001);
  ray_renderer().tick(scene, state, {tip, tip}, kTick);
  const Rendering r = ray_renderer().tick(scene, state, {tip, tip - Vec3(0, 0, 0.04)}, kTick);
  EXPECT_NEAR(r.force.z, kStiffness * 0.039, 1e-6);
  EXPECT_NEAR(r.ideal.tail.z, 0, 1e-9);
}

/// Rounding decides with which end such a stylus touches each of the face's triangles, and whether
/// their edges are convex.
TEST(SurfaceStylus, IsHeldWhileSlidingFlatOnAFace) {
  constexpr std::uint64_t kSeed = 1;
  Random random(kSeed);
  for (int round = 0; round < 40000; ++round) {
    const Quat turn = stimuli::uniform_rotation(random);
    // The face is divided into strips.
    stimuli::PolygonSoup soup =
        prism({{-0.02, -0.02}, {0.02, -0.02}, {0.02, 0}, {0.01, 0}, {0, 0}, {-0.01, 0}, {-0.02, 0}},
              0.05);
    for (Vec3& v : soup.vertices) v = turn * v;
    const Scene scene = scene_of({soup});
    const Vec3 along = turn * Vec3(0.1, 0.02 * random.unit(), 0);
    RenderState state = scene.initial_state();
    for (int i = 0; i < 8; ++i) {
      const Vec3 tip = turn * Vec3(-0.06 + 5e-5 * i, -0.03 + 1e-4 * i, i == 0 ? 1e-3 : -1e-4 * i);
      const Rendering r = ray_renderer().tick(scene, state, {tip, tip + along}, kTick);
      ASSERT_NEAR(glm::length(r.force), 0.1 * i, 1e-9) << round << ' ' << i;
    }
  }
}

TEST_P(SurfaceContact, FlatFacesTrianglesHoldNothingAlongIt) {
  constexpr std::uint64_t kSeed = 3;
  Random random(kSeed);
  for (int round = 0; round < 4; ++round) {
    // A plate of 20 x 20 cells, turned, in single precision.
    stimuli::PolygonSoup soup;
    const int n = 20;
    const Quat turn = glm::angleAxis(3 * random.unit(), direction(random));
    for (const double z : {-0.01, 0.0}) {
      for (int i = 0; i <= n; ++i) {
        for (int k = 0; k <= n; ++k) {
          const double inner = i > 0 && i < n && k > 0 && k < n ? 0.4 : 0;
          soup.vertices.emplace_back(0.004 * (i - 10 + inner * (random.unit() - 0.5)),
                                     0.004 * (k - 10 + inner * (random.unit() - 0.5)), z);
        }
      }
    }
    const auto at = [&](int layer, int i, int k) {
      return static_cast<std::uint32_t>(layer * (n + 1) * (n + 1) + i * (n + 1) + k);
    };
    for (int i = 0; i < n; ++i) {
      for (int k = 0; k < n; ++k) {
        soup.faces.push_back({at(1, i, k), at(1, i + 1, k), at(1, i + 1, k + 1)});
        soup.faces.push_back({at(1, i, k), at(1, i + 1, k + 1), at(1, i, k + 1)});
        soup.faces.push_back({at(0, i, k), at(0, i, k + 1), at(0, i + 1, k + 1), at(0, i + 1, k)});
      }
      soup.faces.push_back({at(0, i, 0), at(0, i + 1, 0), at(1, i + 1, 0), at(1, i, 0)});
      soup.faces.push_back({at(0, i + 1, n), at(0, i, n), at(1, i, n), at(1, i + 1, n)});
      soup.faces.push_back({at(0, 0, i + 1), at(0, 0, i), at(1, 0, i), at(1, 0, i + 1)});
      soup.faces.push_back({at(0, n, i), at(0, n, i + 1), at(1, n, i + 1), at(1, n, i)});
    }
    for (Vec3& v : soup.vertices) {
      v = turn * v;
      for (int c = 0; c < 3; ++c) v[c] = static_cast<double>(static_cast<float>(v[c]));
    }
    const Scene scene = scene_of({soup});
    RenderState state = scene.initial_state();
    const Vec3 up = turn * Vec3(0, 0, 1);
    const auto at_place = [&](double x, double y, double z, double tilt) {
      const Vec3 tip = turn * Vec3(x, y, z);
      return LineProbe{tip, tip + 0.1 * (turn * glm::normalize(Vec3(1, 0.3, tilt)))};
    };
    for (double z = 0.01; z > -0.001; z -= 1e-4) tick(scene, state, at_place(-0.03, 0, z, 0.2));
    for (int i = 0; i < 3000; ++i) {
      const Rendering r =
          tick(scene, state, at_place(-0.03 + 2e-5 * i, 0.01 * std::sin(0.002 * i), -0.001, 0.2));
      ASSERT_NEAR(glm::dot(r.force, up), 1, 2e-5);
      // Rounding tilts a triangle by its error over its width.
      ASSERT_LT(glm::length(r.force - glm::dot(r.force, up) * up), 5e-6) << round << ' ' << i;
    }
  }
}

TEST_P(SurfaceContact, OverlappingShellsAreTheirUnion) {
  // A step of 10 mm where two boxes overlap; inner walls are never felt.
  const Scene scene = scene_of({box_soup({-0.05, -0.05, -0.02}, {0.01, 0.05, 0.0}),
                                box_soup({-0.01, -0.05, -0.02}, {0.05, 0.05, 0.01})});
  RenderState state = scene.initial_state();
  Rendering r = press(scene, state, {-0.03, 0, -0.001});
  EXPECT_NEAR(r.force.z, 1, 1e-9);
  for (int i = 0; i < 180; ++i) {
    r = tick(scene, state, standing({-0.03 + 1e-4 * i, 0, -0.001}));
    ASSERT_NEAR(glm::length(r.force - Vec3(0, 0, 1)), 0, 1e-9) << i;
  }
  r = tick(scene, state, standing({-0.008, 0, -0.001}));  // 2 mm behind the riser
  EXPECT_NEAR(glm::length(r.force - Vec3(-2, 0, 1)), 0, 1e-9);
}

TEST_P(SurfaceContact, StartInsideFeelsNothingUntilItLeaves) {
  const Scene scene = scene_of({bent_block(0.3)});
  RenderState state = scene.initial_state();
  Rendering r = tick(scene, state, standing({-0.02, 0, -0.01}));
  EXPECT_EQ(r.force, Vec3(0));
  EXPECT_NE(r.faults & render_fault::kStartedInside, 0U);
  for (int i = 0; i < 300; ++i) r = tick(scene, state, standing({-0.02, 0, -0.01 + 1e-4 * i}));
  EXPECT_EQ(r.faults, 0U);
  r = press(scene, state, {-0.02, 0, -0.002});
  EXPECT_NEAR(glm::length(r.force - Vec3(0, 0, 2)), 0, 1e-9);
}

TEST_P(SurfaceContact, AThinPlateStopsAFastHand) {
  const Scene scene = scene_of({box_soup({-0.05, -0.05, -1e-4}, {0.05, 0.05, 0})});
  RenderState state = scene.initial_state();
  Rendering r;
  for (int i = 0; i < 12; ++i) r = tick(scene, state, standing({0.003, 0.002, 0.022 - 0.004 * i}));
  EXPECT_NEAR(glm::length(r.force - Vec3(0, 0, kStiffness * 0.022)), 0, 1e-6);
}

/// A ball with waves, as fine as scans are, in single precision.
stimuli::PolygonSoup wavy_ball(int subdivisions) {
  stimuli::PolygonSoup soup = stimuli::icosphere(0.03, subdivisions);
  for (Vec3& v : soup.vertices) {
    const Vec3 d = 100.0 * v;
    const double wave = std::sin(d.x + 2) + std::sin(1.7 * d.y - d.z) + std::sin(0.9 * d.z + 1.3);
    v = Vec3(glm::vec3((1 + 0.1 * wave) * v));
  }
  return soup;
}

/// A hand whose stylus turns by degrees from tick to tick, over triangles of half a millimetre.
TEST_P(SurfaceContact, FastTurningStylusDoesNotEnterFineMeshes) {
  const SceneSurface placed = surface_of({wavy_ball(5)});
  const stimuli::Surface& surface = *placed.surface;
  const Scene scene({}, true, {}, nullptr, {placed});
  RenderState state = scene.initial_state();
  runner::evidence::SurfaceStrokeSettings settings;
  settings.side = GetParam()->side_contact();
  runner::evidence::SurfaceStroke hand(settings);
  double depth = 0;
  int contacts = 0;
  for (int i = 0; i < 4000; ++i) {
    const std::uint64_t before = runner::evidence::allocations();
    const Rendering r = tick(scene, state, hand.next(depth));
    ASSERT_EQ(runner::evidence::allocations(), before);
    depth = r.deepest.depth;
    if (r.contacts == 0 || (r.faults & render_fault::kReleased) != 0) continue;
    ++contacts;
    if (i % 20 != 0) continue;
    // The blend along a facet is off the surface where the facet is not quite parallel.
    if (r.deepest.type != ContactType::segment_face) {
      ASSERT_LE(distance(surface, r.deepest.point), 1e-9) << i;
    }
    const double rounding = 1e-10 * surface.size();
    if (settings.side) {
      ASSERT_LE(through(surface, r.ideal.tip, r.ideal.tail - r.ideal.tip), rounding) << i;
    } else if (surface.winding(r.ideal.tip) > 0) {
      ASSERT_LE(distance(surface, r.ideal.tip), rounding) << i;
    }
  }
  EXPECT_GT(contacts, 3000);
}

/// A stylus with a foot that lies on a plate: which of the two holds the tool at their joint
/// depends on their order and on the way there, the torque on the pose alone.
TEST(SurfaceTool, JointTorqueDependsOnThePoseAlone) {
  const ToolSegment stylus{Vec3(0), Vec3(0, 0, 0.08)}, foot{Vec3(0), Vec3(0.03, 0, 0)},
      back{Vec3(0.03, 0, 0), Vec3(0)};
  const stimuli::PolygonSoup plate = stimuli::box(Vec3(0.1, 0.1, 0.02));
  for (const bool by_surface : {true, false}) {
    for (const double tilt : {-0.012, -0.005, 0.0, 0.004, 0.01, 0.02}) {
      std::vector<Vec3> torques;
      for (const auto& segments : {std::vector{stylus, foot}, std::vector{foot, stylus},
                                   std::vector{stylus, back}, std::vector{back, stylus}}) {
        Tool tool;
        tool.segments = segments;
        const Scene scene = by_surface ? scene_of({plate}, tool)
                                       : Scene(object_of({plate}, Pose{}, kStiffness), true, tool);
        RenderState state = scene.initial_state();
        const Vec3 along(std::sin(tilt), 0, std::cos(tilt));
        Rendering r;
        for (int i = 0; i < 40; ++i) {
          const Vec3 tip(-0.02, 0.003, 0.012 - 1e-4 * i);
          state.measured_side = {std::cos(tilt), 0, -std::sin(tilt)};
          r = ray_renderer().tick(scene, state, {tip, tip + 0.12 * along}, kTick);
        }
        torques.push_back(r.torque);
        EXPECT_LT(glm::distance(r.torque, torques.front()), 1e-12) << tilt << ' ' << by_surface;
      }
      EXPECT_GT(glm::length(torques.front()), 1e-3);  // of the foot
    }
  }
}

/// A part out of reach makes the tick a general one.
TEST_P(SurfaceContact, LoneSurfaceGivesTheBitsOfAnyScene) {
  constexpr std::uint64_t kSeed = 23;
  Random random(kSeed);
  const SceneSurface placed = surface_of({torus(14, 8, 0.03, 0.01)});
  const Scene alone({}, true, {}, nullptr, {placed});
  const Scene any(object_of({stimuli::icosphere(0.01, 0)}, {Vec3(9, 0, 0), Quat(1, 0, 0, 0)}, 1, 1),
                  true, {}, nullptr, {placed});
  ASSERT_TRUE(alone.is_one_surface());
  ASSERT_FALSE(any.is_one_surface());
  RenderState a = alone.initial_state(), b = any.initial_state();
  Hand hand(*placed.surface, random);
  int contacts = 0, free = 0;
  for (int i = 0; i < 8000; ++i) {
    const LineProbe probe = hand.next();
    const Rendering one = tick(alone, a, probe), other = tick(any, b, probe);
    ASSERT_EQ(one.force, other.force) << i;
    ASSERT_EQ(one.torque, other.torque) << i;
    ASSERT_EQ(one.device2, other.device2) << i;
    ASSERT_EQ(one.ideal.tip, other.ideal.tip) << i;
    ASSERT_EQ(one.ideal.tail, other.ideal.tail) << i;
    ASSERT_EQ(one.deepest.point, other.deepest.point) << i;
    ASSERT_EQ(one.contacts, other.contacts) << i;
    ASSERT_EQ(one.faults, other.faults) << i;
    ++(one.contacts > 0 ? contacts : free);
  }
  EXPECT_GT(contacts, 1000);
  EXPECT_GT(free, 100);
}

/// A hand that has come from outside in one tick is held where one is that came in small steps.
TEST_P(SurfaceContact, FirstContactEqualsSmallSteps) {
  constexpr int kApproaches = 300, kSteps = 32;
  constexpr std::uint64_t kSeed = 17;
  Random random(kSeed);
  const Scene scene({}, true, {}, nullptr, {surface_of({wavy_ball(4)})});
  int alike = 0, touched = 0;
  for (int i = 0; i < kApproaches; ++i) {
    const Vec3 out = direction(random), spin = 0.01 * random.unit() * direction(random);
    const Vec3 way = -4e-4 * glm::normalize(out + 0.5 * direction(random));
    Vec3 tip = 0.045 * out, along = glm::normalize(out + 1.5 * random.unit() * direction(random));
    RenderState state = scene.initial_state();
    for (int t = 0; t < 200; ++t) {
      const RenderState before = state;
      const Vec3 last_tip = tip, last = along;
      tip += way;
      along = glm::normalize(along + glm::cross(spin, along));
      const Rendering one = tick(scene, state, {tip, tip + 0.1 * along});
      if (one.contacts == 0) continue;
      ++touched;
      RenderState small = before;
      Rendering many;
      for (int k = 1; k <= kSteps; ++k) {
        const double part = static_cast<double>(k) / kSteps;
        const Vec3 at = last_tip + part * way;
        const Vec3 to = k == kSteps ? along : glm::normalize(glm::mix(last, along, part));
        many = tick(scene, small, {k == kSteps ? tip : at, (k == kSteps ? tip : at) + 0.1 * to});
      }
      alike += glm::distance(one.ideal.tip, many.ideal.tip) <= 1e-9 ? 1 : 0;
      break;
    }
  }
  EXPECT_GT(touched, kApproaches / 2);
  EXPECT_GE(alike, touched - touched / 100);
}

/// A segment is laid against a triangle or an edge, then its ends are moved away by as much as they
/// may move: the triangle is still among those that it can touch.
TEST(SurfaceTree, FindsAllThatAMovingSegmentCanTouch) {
  constexpr std::uint64_t kSeed = 23;
  Random random(kSeed);
  const SceneSurface placed = surface_of({wavy_ball(3)});
  const stimuli::Surface& surface = *placed.surface;
  int sides = 0;
  for (int i = 0; i < 20000; ++i) {
    const auto index =
        static_cast<std::uint32_t>(random.unit() * static_cast<double>(surface.triangles().size()));
    const stimuli::SurfaceTriangle& t = surface.triangles()[index];
    const auto corner = [&](std::uint32_t k) { return surface.vertices()[t.corners[k % 3]]; };
    const double length = 0.2 * random.unit();
    Vec3 start, end;
    std::uint8_t expected = i % 4 == 0 ? stimuli::surface_pair::kTail : stimuli::surface_pair::kTip;
    if (i % 2 == 0) {  // an end on the triangle
      const double a = random.unit(), b = (1 - a) * random.unit();
      start = corner(0) + a * (corner(1) - corner(0)) + b * (corner(2) - corner(0));
      end = start + length * direction(random);
      if (i % 4 == 0) std::swap(start, end);
    } else {  // across a side that is a silhouette
      const auto k = static_cast<std::uint32_t>(i / 2 % 3);
      if (!t.owns(k) || !t.touches(k)) continue;
      const Vec3 e = corner(k + 1) - corner(k);
      const Vec3& other =
          surface.triangles()[stimuli::SurfaceTriangle::triangle_of(t.across[k])].normal;
      const Vec3 along = length * glm::normalize(glm::cross(t.normal + other, glm::normalize(e)) +
                                                 (random.unit() - 0.5) * glm::normalize(e));
      if (glm::dot(t.normal, along) * glm::dot(other, along) >= 0) continue;
      start = corner(k) + random.unit() * e - random.unit() * along;
      end = start + along;
      expected = stimuli::surface_pair::kSides;
      ++sides;
    }
    // The pose is some way along a motion, and off it by less than the room.
    stimuli::SegmentMotion motion;
    motion.room = (i % 5 == 0 ? 5e-3 : 1e-5) * random.unit();
    const double time = random.unit();
    if (i % 3 > 0) {
      motion.start_way = 2e-3 * random.unit() * direction(random);
      motion.end_way = 1e-2 * random.unit() * direction(random);
    }
    motion.turn = 2 * motion.room;
    motion.start =
        start - time * motion.start_way - random.unit() * motion.room * direction(random);
    motion.end = end - time * motion.end_way - random.unit() * motion.room * direction(random);
    bool found = false;
    surface.touchable(motion, [&](std::uint32_t triangle, std::uint8_t what) {
      found = triangle == index && (what & expected) != 0;
      return !found;
    });
    ASSERT_TRUE(found) << i;
  }
  EXPECT_GT(sides, 1000);
}

TEST(SurfaceTool, SingleMeshGivesTheForcesOfItsParts) {
  // A step of two boxes, under a bent tool of two segments.
  const stimuli::PolygonSoup whole =
      prism({{-0.05, -0.02}, {0.05, -0.02}, {0.05, 0.01}, {0, 0.01}, {0, 0}, {-0.05, 0}}, 0.05);
  const Tool tool{{{{0, 0, 0}, {0, 0, 0.12}}, {{0, 0, 0}, {0.02, 0.003, 0.004}}}};
  const Scene surface = scene_of({whole}, tool);
  const Scene parts(object_of({box_soup({-0.05, -0.05, -0.02}, {0, 0.05, 0}),
                               box_soup({0, -0.05, -0.02}, {0.05, 0.05, 0.01})},
                              Pose{}, kStiffness),
                    true, tool);
  RenderState a = surface.initial_state(), b = parts.initial_state();
  int held = 0;
  for (int i = 0; i < 3000; ++i) {
    const double t = 1e-3 * i;
    const Vec3 tip(-0.02 + 0.012 * std::sin(1.1 * t), 0.01 * std::sin(2.3 * t),
                   0.003 + 0.006 * std::cos(1.7 * t));
    const LineProbe probe{tip, tip + 0.12 * glm::normalize(Vec3(0.3 * std::sin(0.7 * t), 0.2, 1))};
    const Rendering one = ray_renderer().tick(surface, a, probe, kTick);
    const Rendering other = ray_renderer().tick(parts, b, probe, kTick);
    ASSERT_NEAR(glm::length(one.force - other.force), 0, 1e-6) << i;
    ASSERT_NEAR(glm::length(one.torque - other.torque), 0, 1e-7) << i;
    held += one.contacts > 0;
  }
  EXPECT_GT(held, 500);
}

INSTANTIATE_TEST_SUITE_P(Renderers, SurfaceContact,
                         ::testing::Values(&point_renderer(), &ray_renderer()),
                         [](const auto& one) { return std::string(one.param->name()); });

}  // namespace surfaces
}  // namespace
}  // namespace palpate::rendering
