// An ideal tool is never inside a closed mesh, whatever the hand does: judged by definition, with
// all triangles.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "data/base/random.h"
#include "rendering/renderer.h"
#include "stimuli/closed_surface.h"
#include "stimuli/orientation.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"
#include "stimuli/surfaces/surface.h"
#include "tests/rendering/winding_oracle.h"
#include "tests/shared/probe_paths.h"
#include "tests/shared/random_polyhedron.h"
#include "tests/shared/rounds.h"
#include "tests/stimuli/concave_solids.h"

namespace palpate::rendering {
namespace {
namespace outside {

using stimuli::PolygonSoup;
using testing::random_direction;
using testing::uniform;
using testing::WindingOracle;

constexpr double kStiffness = 1000;  // N/m
constexpr double kLength = 0.12;     // m, of the stylus

// Meshes of 30 to 150 mm.

void append(PolygonSoup& soup, const PolygonSoup& other) {
  const auto first = static_cast<std::uint32_t>(soup.vertices.size());
  soup.vertices.insert(soup.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (std::vector<std::uint32_t> face : other.faces) {
    for (std::uint32_t& corner : face) corner += first;
    soup.faces.push_back(face);
  }
}

/// A cell of a lattice by its place along each axis, or the corner where it begins.
using Cell = glm::ivec3;

/// The surface of the solid cells of a lattice.
/// \param cells  along x, y and z
/// \param solid  of a cell
/// \param at     places a corner
template <class Solid, class Place>
PolygonSoup lattice(const Cell& cells, const Solid& solid, const Place& at) {
  PolygonSoup soup;
  const auto is_solid = [&](const Cell& c) {
    return glm::all(glm::greaterThanEqual(c, Cell(0))) && glm::all(glm::lessThan(c, cells)) &&
           solid(c);
  };
  for (int k = 0; k < cells.x * cells.y * cells.z; ++k) {
    const Cell cell(k % cells.x, k / cells.x % cells.y, k / cells.x / cells.y);
    if (!is_solid(cell)) continue;
    for (int axis = 0; axis < 3; ++axis) {
      for (const int side : {0, 1}) {
        Cell beyond = cell;
        beyond[axis] += side == 1 ? 1 : -1;
        if (is_solid(beyond)) continue;
        const auto first = static_cast<std::uint32_t>(soup.vertices.size());
        for (int i = 0; i < 4; ++i) {  // round the face: 00, 10, 11, 01
          Cell corner = cell;
          corner[axis] += side;
          corner[(axis + 2 - side) % 3] += i == 1 || i == 2 ? 1 : 0;
          corner[(axis + 1 + side) % 3] += i / 2;
          soup.vertices.push_back(at(corner));
        }
        soup.faces.push_back({first, first + 1, first + 2});
        soup.faces.push_back({first, first + 2, first + 3});
      }
    }
  }
  return soup;
}

PolygonSoup bumpy_ball(Random& random) {
  PolygonSoup soup = stimuli::icosphere(1, 3);
  const Vec3 a = 9.0 * random_direction(random), b = 13.0 * random_direction(random);
  for (Vec3& v : soup.vertices)
    v *= 0.03 * (1 + 0.08 * std::sin(glm::dot(a, v)) + 0.05 * std::sin(glm::dot(b, v)));
  return soup;
}

PolygonSoup twisted_bar_with_four_holes(Random& random) {
  const double twist = uniform(random, 0.1, 0.2);  // rad a cell
  return lattice(
      {13, 4, 2}, [](const Cell& c) { return c.x % 3 == 0 || c.y % 3 == 0; },
      [&](const Cell& c) {
        return 0.005 * (glm::angleAxis(twist * c.x, Vec3(1, 0, 0)) * (Vec3(c) - Vec3(6.5, 2, 1)));
      });
}

PolygonSoup box_with_a_pocket_of_thin_walls(Random& random) {
  const double wall = uniform(random, 1e-4, 3e-4);
  const std::array<double, 6> places = {0, wall, 0.01, 0.02, 0.03 - wall, 0.03};
  const auto place = [&](int i) { return places[static_cast<std::size_t>(i)]; };
  return lattice(
      {5, 5, 5}, [](const Cell& c) { return c.x % 4 == 0 || c.y % 4 == 0 || c.z == 0; },
      [&](const Cell& c) { return Vec3(place(c.x), place(c.y), place(c.z)); });
}

PolygonSoup overlapping_shells(Random& random) {
  PolygonSoup soup = stimuli::icosphere(0.02, 2);
  append(soup, testing::placed(stimuli::box(Vec3(0.05, 0.012, 0.02)),
                               stimuli::uniform_rotation(random), 1, Vec3(0.015, 0.004, 0)));
  return soup;
}

/// Cells by chance, in waves. Strips of 1 um divide every face.
PolygonSoup noise_with_slivers(Random& random) {
  std::array<bool, 125> filled;
  for (bool& cell : filled) cell = random.unit() < 0.5;
  const double high = uniform(random, 0, 0.3);
  return lattice(
      Cell(10),
      [&](const Cell& c) {
        const int cell = c.x / 2 + 5 * (c.y / 2) + 25 * (c.z / 2);
        return filled[static_cast<std::size_t>(cell)];
      },
      [&](const Cell& c) {
        const Vec3 p = Vec3(c / 2) + 1e-4 * Vec3(c % 2);
        return 0.01 * (p + high * Vec3(std::sin(p.y), std::sin(p.z), std::sin(p.x)));
      });
}

PolygonSoup lattice_of_struts(Random& random) {
  const double edge = uniform(random, 0.006, 0.009);
  return lattice(
      Cell(7), [](const Cell& c) { return (c.x % 3 == 0) + (c.y % 3 == 0) + (c.z % 3 == 0) >= 2; },
      [&](const Cell& c) { return edge * Vec3(c); });
}

/// Six bores with sixteen sides each.
PolygonSoup mounting_plate(Random& random) {
  const double bore = uniform(random, 0.3, 2.9), thick = uniform(random, 0.003, 0.01);
  return lattice(
      {24, 16, 1},
      [](const Cell& c) { return std::abs(c.x % 8 - 3.5) > 2 || std::abs(c.y % 8 - 3.5) > 2; },
      [&](const Cell& c) {
        const Vec3 middle(c / 8 * 8 + 4);
        Vec3 off = Vec3(c) - middle;
        off.z = 0;
        if (std::max(std::abs(off.x), std::abs(off.y)) == 2) off *= bore / glm::length(off);
        return Vec3(0.003 * (middle.x + off.x), 0.003 * (middle.y + off.y), thick * c.z);
      });
}

/// Shells that abut: their faces have different corners.
PolygonSoup rounded_cube_of_eight_cells(Random& random) {
  const double roundness = uniform(random, 3, 8);
  PolygonSoup soup;
  for (int octant = 0; octant < 8; ++octant) {
    const Cell low(-(octant & 1), -(octant >> 1 & 1), -(octant >> 2));
    const int n = (low.x + low.y + low.z) % 2 == 0 ? 3 : 6;
    const auto rounded = [&](const Cell& c) {
      const Vec3 p = Vec3(c) / static_cast<double>(n) + Vec3(low);
      const Vec3 size = glm::abs(p), power = glm::pow(size, Vec3(roundness));
      const double norm = std::pow(power.x + power.y + power.z, 1 / roundness);
      return norm == 0 ? p : 0.05 * std::max({size.x, size.y, size.z}) / norm * p;
    };
    append(soup, lattice(
                     Cell(n), [](const Cell&) { return true; }, rounded));
  }
  return soup;
}

/// Blocks of different sizes on each other.
PolygonSoup abutting_blocks(Random& random) {
  PolygonSoup soup;
  double top = 0;
  for (int i = 0; i < 3; ++i) {
    const Vec3 size(uniform(random, 0.01, 0.03), uniform(random, 0.01, 0.03),
                    uniform(random, 0.005, 0.02));
    const Vec3 aside(uniform(random, 0, 0.005), uniform(random, 0, 0.005), top + 0.5 * size.z);
    append(soup, testing::placed(stimuli::box(size), Quat(1, 0, 0, 0), 1, aside));
    top += size.z;
  }
  return soup;
}

constexpr double kPocket = 2e-5;  // m

/// A plate whose upper side passes through the lower one in some corners, by less than a hand
/// feels, and lies over itself beside others.
PolygonSoup folded_plate(Random& random) {
  constexpr int kCells = 10;
  const double thick = uniform(random, 5e-4, 2e-3), cell = 0.004;
  std::vector<Vec3> moved;
  for (int i = 0; i < (kCells + 1) * (kCells + 1); ++i) {
    // Not beside each other: together they would be deep.
    const bool single = i % (kCells + 1) % 2 == 0 && i / (kCells + 1) % 2 == 0;
    const double kind = single ? random.unit() : 0.5;
    Vec3 by(0, 0, uniform(random, 0, 1e-4));
    if (kind < 0.25) by.z = -thick - uniform(random, 1e-6, kPocket);
    if (kind > 0.75) by.x = uniform(random, 1, 1.005) * cell;
    moved.push_back(by);
  }
  return lattice(
      {kCells, kCells, 1}, [](const Cell&) { return true; },
      [&](const Cell& c) {
        const bool inside = c.x > 0 && c.x < kCells && c.y > 0 && c.y < kCells;
        const Vec3 at(cell * c.x, cell * c.y, thick * c.z);
        return c.z == 1 && inside ? at + moved[static_cast<std::size_t>(c.x + (kCells + 1) * c.y)]
                                  : at;
      });
}

/// Its ends are fans or zigzags of slivers.
PolygonSoup disk_of_slivers(Random& random) {
  const auto corners = static_cast<std::uint32_t>(100 + random.below(300));
  return stimuli::solids::notched_disk(corners, static_cast<stimuli::solids::Cut>(random.below(3)));
}

enum class Written { single_precision, six_decimals, eight_decimals };

/// Rounds coordinates as a file does.
PolygonSoup as_written(PolygonSoup soup, Written how) {
  const bool single = how == Written::single_precision;
  const double unit = how == Written::six_decimals ? 1e-6 : 1e-8;
  double largest = 0;
  for (Vec3& v : soup.vertices) {
    for (int k = 0; k < 3; ++k) {
      v[k] =
          single ? static_cast<double>(static_cast<float>(v[k])) : std::round(v[k] / unit) * unit;
      largest = std::max(largest, std::abs(v[k]));
    }
  }
  soup.coordinate_error = single ? largest * 0x1p-24 : 0.5 * unit;
  return soup;
}

struct Kind {
  const char* name;
  PolygonSoup (*make)(Random& random);
  bool turned;  ///< false: along the axes, so that ways meet edges and corners exactly
  Written how;
};

/// A hand that approaches places of a mesh with any point of its tool, presses, slides and turns.
class Hand {
 public:
  /// \param points  of the tool, stylus frame
  Hand(const stimuli::ClosedSurface& mesh, const std::vector<Vec3>& points, Random& random)
      : mesh_(mesh), points_(points), random_(random) {}

  /// \param held  the stylus: its tip; along its own +z
  Pose move(const Pose& held, const Vec3& force) {
    const Vec3 local = points_[point_];
    Vec3 point = held.position + held.orientation * local;
    if (left_-- == 0 || (does_ == Does::approach && point == goal_)) {
      choose();
      return held;
    }
    const double depth = glm::length(force) / kStiffness;  // m
    if (depth > 0) normal_ = glm::normalize(force);
    if (does_ == Does::slide) {
      const Vec3 aside = heading_ - glm::dot(heading_, normal_) * normal_;
      goal_ = point + speed_ * aside + (depth - depth_) * normal_;
    }
    const double way = glm::distance(point, goal_);
    if (does_ != Does::turn)  // The goal itself, to the bit: edges and corners are met exactly.
      point = way <= speed_ ? goal_ : point + speed_ / way * (goal_ - point);
    if (depth > kDeepest) point += (depth - kDeepest) * normal_;  // the hand gives way
    Quat turn = held.orientation;
    if (spin_ > 0) turn = glm::normalize(glm::angleAxis(spin_, heading_) * turn);
    return {point - turn * local, turn};
  }

 private:
  enum class Does { approach, press, slide, turn };
  static constexpr double kDeepest = 0.006, kFastest = 5e-4;  // m; m a tick

  void choose() {
    does_ = does_ == Does::approach ? Does::press : static_cast<Does>(random_.below(4));
    left_ = 20 + static_cast<int>(random_.below(200));
    speed_ = kFastest * std::pow(10, -1.5 * random_.unit());
    depth_ = kDeepest * std::pow(10, -2 * random_.unit());
    heading_ = random_direction(random_);
    spin_ = does_ == Does::turn ? 0.01 * random_.unit() : 0;
    if (does_ == Does::slide && random_.unit() < 0.5) spin_ = 1e-3 * random_.unit();
    if (does_ == Does::press) goal_ = place_ - depth_ * out_;
    if (does_ != Does::approach) return;
    left_ = 300;
    speed_ = kFastest;
    point_ = random_.unit() < 0.5 ? 0 : random_.below(points_.size());
    const auto& corners = mesh_.triangles[random_.below(mesh_.triangles.size())];
    const Vec3 &a = mesh_.vertices[corners[0]], &b = mesh_.vertices[corners[1]],
               &c = mesh_.vertices[corners[2]];
    const std::array<Vec3, 3> places = {a, 0.5 * (a + b), (a + b + c) / 3.0};
    place_ = places[random_.below(3)];
    out_ = glm::normalize(glm::cross(b - a, c - a));
    goal_ = place_ + uniform(random_, 5e-4, 3e-3) * out_;
  }

  const stimuli::ClosedSurface& mesh_;
  const std::vector<Vec3>& points_;
  Random& random_;
  Does does_ = Does::turn;
  int left_ = 0;
  std::size_t point_ = 0;
  Vec3 place_, out_, goal_, heading_, normal_{0, 0, 1};
  double speed_ = 0, depth_ = 0, spin_ = 0;
};

Pose pose_of(const LineProbe& stylus, const Vec3& side) {
  const Vec3 z = glm::normalize(stylus.tail - stylus.tip), y = glm::normalize(glm::cross(z, side));
  return {stylus.tip, glm::quat_cast(Mat3(glm::cross(y, z), y, z))};
}

class SurfaceOutside : public ::testing::TestWithParam<Kind> {
 protected:
  using Segments = std::vector<std::array<Vec3, 2>>;  // of a tool, stylus frame, m

  /// \param segments  one without length: the tip alone touches
  static void touch_meshes(const Segments& segments) {
    for (int seed = 1; seed <= testing::rounds(3); ++seed) {
      SCOPED_TRACE("seed " + std::to_string(seed));
      touch(segments, static_cast<std::uint64_t>(seed));
    }
  }
  static void touch(const Segments& segments, std::uint64_t seed);
};

void SurfaceOutside::touch(const Segments& segments, std::uint64_t seed) {
  constexpr int kTicks = 10000, kPath = 1000;
  const Kind& kind = GetParam();
  Random random(seed);
  PolygonSoup soup = kind.make(random);
  if (kind.turned) soup = testing::placed(soup, stimuli::uniform_rotation(random), 1, Vec3(0));
  const auto mesh = std::make_shared<const stimuli::ClosedSurface>(
      stimuli::closed_surface(as_written(soup, kind.how)).surface);
  const WindingOracle oracle(*mesh);
  stimuli::Material spring;
  spring.stiffness = kStiffness;
  const std::vector<stimuli::SurfaceShell> shells = {{mesh, Pose{}, spring}};
  const auto surface = std::make_shared<const stimuli::Surface>(shells);
  const double rounding = 1e-9 * oracle.size();  // m; places nearer to the outside are not judged
  const double farther = 2e-6 + 4 * surface->seam() + (kind.make == folded_plate ? kPocket : 0);
  const auto inside = [&](const Pose& at, double depth) {
    return std::any_of(segments.begin(), segments.end(), [&](const auto& s) {
      return oracle.holds({at.position + at.orientation * s[0], at.orientation * (s[1] - s[0])},
                          depth);
    });
  };
  const bool bent = segments.size() > 1, sides = segments[0][0] != segments[0][1];
  Tool tool;
  std::vector<Vec3> points = {Vec3(0)};
  for (const auto& [from, to] : segments) {
    points.insert(points.end(), {from, glm::mix(from, to, 0.3), to});
    if (bent) tool.segments.push_back({from, to});
  }
  const Scene scene({}, sides, tool, nullptr, {{surface, Pose{}, 0}});
  const Renderer& renderer = sides ? ray_renderer() : point_renderer();

  int contacts = 0, shifted = 0, noticed = 0;
  Pose held;
  std::optional<Hand> hand;
  RenderState state;
  Rendering r;
  bool start = true;
  for (int tick = 0; tick < kTicks; ++tick) {
    if (start || tick % kPath == 0) {
      do {
        held = testing::random_pose(random, 0.7 * oracle.size() * random.unit());
        if (random.unit() < 0.2) held.orientation = Quat(1, 0, 0, 0);
      } while (inside(held, 0));
      hand.emplace(*mesh, points, random);
      state = scene.initial_state();
      r = {};
    }
    held = hand->move(held, r.force);
    const Vec3 side = held.orientation * Vec3(1, 0, 0);
    if (bent) state.measured_side = side;
    r = renderer.tick(scene, state,
                      {held.position, held.position + held.orientation * Vec3(0, 0, kLength)},
                      1e-3);
    ASSERT_EQ(r.faults & ~(render_fault::kReleased | render_fault::kContactCapped), 0U);
    start = (r.faults & render_fault::kReleased) != 0;  // it may pass through now
    if (start) continue;
    const Pose ideal = pose_of(r.ideal, bent ? r.ideal_side : side);
    ASSERT_FALSE(inside(ideal, rounding)) << "tick " << tick;
    if (r.contacts == 0) continue;
    ++contacts;
    if (r.contacts > 1 || contacts % 50 != 0) continue;
    // The judge must notice a tool that is 2 um farther in, beyond cracks of rounding. At a sharp
    // edge the way of the force may lead out again, so ways beside it are tried.
    ++shifted;
    bool is_noticed = false;
    for (int k = 0; k < 100 && !is_noticed; ++k) {
      const Vec3 in = -glm::normalize(r.force) + 0.01 * k * random_direction(random);
      const auto moved = [&](double by) { return ideal.position + by * glm::normalize(in); };
      is_noticed = inside({moved(farther), ideal.orientation}, rounding);
      // A pocket plugs the hole that it is the bottom of.
      for (double by = 1e-8; by < kPocket && !is_noticed; by *= 2)
        is_noticed = oracle.winding(moved(by)) < 0;
    }
    noticed += is_noticed ? 1 : 0;
  }
  EXPECT_GT(contacts, kTicks / 8);
  EXPECT_GT(shifted, 0);
  EXPECT_EQ(noticed, shifted);
}

PolygonSoup notched_prism(Random& random) {
  const double notch = uniform(random, 0.002, 0.02);
  return testing::prism({{-0.03, -0.02},
                         {0.03, -0.02},
                         {0.03, 0.02},
                         {0.01, 0.02},
                         {0, 0.02 - notch},
                         {-0.01, 0.02},
                         {-0.03, 0.02}},
                        0.01);
}

PolygonSoup dented_ball(Random& random) {
  PolygonSoup soup = stimuli::icosphere(0.03, 1);
  for (Vec3& v : soup.vertices) v *= uniform(random, 0.7, 1.2);
  return soup;
}

/// A tool that crosses a corner or the middle of an edge, to the bit, in one tick or in two of
/// which the first ends there; a stylus crosses with an end or its middle, in any direction or
/// along the edge.
class ExactAim {
 public:
  struct Ways {
    std::array<LineProbe, 3> poses;
    int count = 0;
  };
  ExactAim(const stimuli::ClosedSurface& mesh, bool sides) : mesh_(mesh), sides_(sides) {}

  Ways next(Random& random) const {
    const auto& corners = mesh_.triangles[random.below(mesh_.triangles.size())];
    const Vec3 &a = mesh_.vertices[corners[0]], &b = mesh_.vertices[corners[1]],
               &c = mesh_.vertices[corners[2]];
    const Vec3 normal = glm::normalize(glm::cross(b - a, c - a));
    const Vec3 at = random.unit() < 0.5 ? a : 0.5 * (a + b);
    const Vec3 out =
        random.unit() < 0.4 ? normal : glm::normalize(normal + 0.8 * random_direction(random));
    const std::array<Vec3, 3> directions = {b - a, normal, random_direction(random)};
    const Vec3 along = uniform(random, 0.01, 0.05) * glm::normalize(directions[random.below(3)]);
    const double part = sides_ ? 0.5 * static_cast<double>(random.below(3)) : 0;
    const bool ends_there = random.unit() < 0.5;
    Ways ways;
    for (const double height : {1e-3, 0.0, -1e-4}) {
      if (height == 0 && !ends_there) continue;
      const Vec3 tip = at + height * out - part * along;
      ways.poses[static_cast<std::size_t>(ways.count++)] = {tip, tip + along};
    }
    return ways;
  }

 private:
  const stimuli::ClosedSurface& mesh_;
  bool sides_;
};

/// Tries that fell through.
/// \param tried  counts those that would enter the solid
int through(PolygonSoup soup, bool sides, Random& random, int& tried) {
  constexpr int kTries = 3000;
  soup = testing::placed(soup, stimuli::uniform_rotation(random), 1, Vec3(0));
  const auto mesh = std::make_shared<const stimuli::ClosedSurface>(
      stimuli::closed_surface(as_written(soup, Written::single_precision)).surface);
  const WindingOracle oracle(*mesh);
  const auto inside = [&](const LineProbe& at, double depth) {
    return oracle.holds({at.tip, sides ? at.tail - at.tip : Vec3(0)}, depth);
  };
  stimuli::Material spring;
  spring.stiffness = kStiffness;
  const std::vector<stimuli::SurfaceShell> shells = {{mesh, Pose{}, spring}};
  const Scene scene({}, sides, {}, nullptr,
                    {{std::make_shared<const stimuli::Surface>(shells), Pose{}, 0}});
  const ExactAim aim(*mesh, sides);
  int out = 0;
  for (int i = 0; i < kTries; ++i) {
    const ExactAim::Ways ways = aim.next(random);
    const auto last = static_cast<std::size_t>(ways.count - 1);
    if (inside(ways.poses[0], 0) || !inside(ways.poses[last], 1e-6)) continue;
    RenderState state = scene.initial_state();
    const auto tick = [&](std::size_t k) {
      return (sides ? ray_renderer() : point_renderer()).tick(scene, state, ways.poses[k], 1e-3);
    };
    if (tick(0).faults != 0) continue;  // it lies on the corner from the start
    ++tried;
    Rendering r;
    for (std::size_t k = 1; k <= last; ++k) r = tick(k);
    out += r.contacts == 0 || inside(r.ideal, 2e-9 * oracle.size()) ? 1 : 0;
  }
  return out;
}

void aim_at_edges(bool sides) {
  int tried = 0;
  for (int seed = 1; seed <= testing::rounds(15); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(static_cast<std::uint64_t>(seed));
    EXPECT_EQ(through(notched_prism(random), sides, random, tried), 0);
    EXPECT_EQ(through(dented_ball(random), sides, random, tried), 0);
    EXPECT_EQ(through(overlapping_shells(random), sides, random, tried), 0);
  }
  EXPECT_GT(tried, 30000);
}

TEST(SurfaceAim, PointPassingExactlyOverAnEdgeIsStopped) { aim_at_edges(false); }

TEST(SurfaceAim, StylusPassingExactlyOverAnEdgeIsStopped) { aim_at_edges(true); }

TEST_P(SurfaceOutside, APointStaysOutside) { touch_meshes({{Vec3(0), Vec3(0)}}); }

TEST_P(SurfaceOutside, AStylusStaysOutside) { touch_meshes({{Vec3(0), Vec3(0, 0, kLength)}}); }

TEST_P(SurfaceOutside, ABentToolStaysOutside) {
  touch_meshes({{Vec3(0), Vec3(0, 0, 0.08)},
                {Vec3(0), Vec3(0.015, 0, -0.01)},
                {Vec3(0.015, 0, -0.01), Vec3(0.015, 0.01, -0.02)}});
}

INSTANTIATE_TEST_SUITE_P(
    Meshes, SurfaceOutside,
    ::testing::Values(
        Kind{"BumpyBall", bumpy_ball, true, Written::single_precision},
        Kind{"BarWithFourHoles", twisted_bar_with_four_holes, true, Written::eight_decimals},
        Kind{"PocketOfThinWalls", box_with_a_pocket_of_thin_walls, false,
             Written::single_precision},
        Kind{"OverlappingShells", overlapping_shells, true, Written::single_precision},
        Kind{"NoiseWithSlivers", noise_with_slivers, true, Written::single_precision},
        Kind{"LatticeOfStruts", lattice_of_struts, false, Written::eight_decimals},
        Kind{"MountingPlate", mounting_plate, true, Written::eight_decimals},
        Kind{"AbuttingBlocks", abutting_blocks, true, Written::six_decimals},
        Kind{"EightCells", rounded_cube_of_eight_cells, true, Written::eight_decimals},
        Kind{"DiskOfSlivers", disk_of_slivers, true, Written::single_precision},
        Kind{"DiskAlongAxes", disk_of_slivers, false, Written::eight_decimals},
        Kind{"FoldedPlate", folded_plate, true, Written::eight_decimals}),
    [](const auto& kind) { return std::string(kind.param.name); });

}  // namespace outside
}  // namespace
}  // namespace palpate::rendering
