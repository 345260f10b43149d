#include "runner/evidence/verification/union_cases.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "runner/evidence/verification/nearest_point.h"
#include "runner/evidence/verification/random_draws.h"
#include "runner/evidence/verification/random_solids.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/orientation.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"

namespace palpate::runner::evidence {
namespace {

// Steepest descent of a point towards another one outside convex sums, each given by all of its
// planes.

/// Fraction of the touching distance by which a goal may lie below a plane.
inline constexpr double kRoundingOfTouching = 1e-2;

/// The next goal of the tip.
struct Choice {
  std::vector<const OracleSum*> touched;
  std::vector<HalfSpace> planes;  ///< one facet of each touched sum
  NearestPoint goal;              ///< above the planes
  bool on_one_facet_each = true;  ///< no sum is touched on an edge
};

/// Steepest descent of the distance from the virtual tip. Near the tip, the free space is the
/// union, over all choices of one touched facet of every touched sum, of the space above those
/// facets. The steepest choice is the one whose nearest point is closest to the virtual tip.
class Descent {
 public:
  /// \param touching  m; sums no further away are touched
  Descent(const std::vector<OracleSum>& sums, const Vec3& virtual_tip, double touching)
      : sums_(sums), virtual_tip_(virtual_tip), touching_(touching) {}

  /// The tip's goal if the touched facets were infinite and nothing else were in the way.
  /// \return false if rounding leaves no such point
  bool goal(const Vec3& tip, Choice& best);

  /// m, the residual of the way from the virtual tip after non-negative multiples of the normals of
  /// touched facets, each at most `most_multiple` times as long as the way.
  double unbalanced(const Vec3& tip, double most_multiple) const;

  /// The share of the straight way to the goal that lies outside all sums, 0 to 1. The facets of
  /// the choice bound the touched sums.
  double free_way(const Vec3& tip, const Vec3& goal) const;

 private:
  struct Touched {
    const OracleSum* sum;
    std::vector<std::size_t> facets;
  };

  void choose(std::size_t next, std::vector<HalfSpace>& planes, Choice& best);
  double slides_off(const OracleSum& sum, const Vec3& tip, const Vec3& goal) const;

  const std::vector<OracleSum>& sums_;
  Vec3 virtual_tip_;
  double touching_;
  std::vector<Touched> touched_;
  double best_distance_ = 0;
  bool in_crack_ = false;
};

constexpr double kUnbounded = std::numeric_limits<double>::infinity();

// Sine of half the opening of the narrowest groove that can hold a tool.
constexpr double kNarrowest = 1e-5;

/// The facets of the sum that the tip touches; empty if it touches none.
std::vector<std::size_t> touched_facets(const OracleSum& sum, const Vec3& tip, double touching) {
  const double height = sum.height(tip);
  std::vector<std::size_t> facets;
  if (height > touching) return facets;
  for (std::size_t i = 0; i < sum.planes.size(); ++i) {
    if (sum.planes[i].height(tip) >= std::min(height, -touching)) facets.push_back(i);
  }
  return facets;
}

/// Whether the choice leaves free space. Between two abutting parts, the plane of their common face
/// is above a facet of both, but a crack without room is not free space.
bool leaves_room(const std::vector<HalfSpace>& planes) {
  std::vector<HalfSpace> raised;  // the cone of directions, out of each plane by 1
  raised.reserve(planes.size());
  for (const HalfSpace& plane : planes) raised.push_back({plane.normal, 1});
  const auto out = nearest_point(Vec3(0), raised, 1e-6);
  return out && glm::length(out->point) < 1 / kNarrowest;
}

/// Fraction of the way at which it enters a sum from outside; 1 if it does not.
double entry(const OracleSum& sum, const Vec3& tip, const Vec3& goal) {
  double enters = 0, leaves = kUnbounded;
  for (const OraclePlane& plane : sum.planes) {
    const double before = plane.height(tip), after = plane.height(goal);
    if (before > 0 && after >= before) return 1;
    if (before > 0) {
      enters = std::max(enters, before / (before - after));
    } else if (after > before) {
      leaves = std::min(leaves, before / (before - after));
    }
  }
  return enters < leaves ? std::min(enters, 1.0) : 1.0;
}

bool Descent::goal(const Vec3& tip, Choice& best) {
  touched_.clear();
  for (const OracleSum& sum : sums_) {
    std::vector<std::size_t> facets = touched_facets(sum, tip, touching_);
    if (!facets.empty()) touched_.push_back({&sum, std::move(facets)});
  }
  best_distance_ = kUnbounded;
  std::vector<HalfSpace> planes;
  in_crack_ = false;
  choose(0, planes, best);
  if (best_distance_ < kUnbounded) return true;
  in_crack_ = true;  // a tool that fits a gap exactly can move in it
  choose(0, planes, best);
  return best_distance_ < kUnbounded;
}

/// Tries every choice of one facet of each touched sum from `next` on.
void Descent::choose(std::size_t next, std::vector<HalfSpace>& planes, Choice& best) {
  const auto nearest = nearest_point(virtual_tip_, planes, kRoundingOfTouching * touching_);
  if (!nearest) return;
  const double distance = glm::length(nearest->point - virtual_tip_);
  if (distance >= best_distance_) return;
  if (next == touched_.size()) {
    best_distance_ = distance;
    best = {{}, planes, *nearest};
    for (const Touched& touched : touched_) {
      best.touched.push_back(touched.sum);
      best.on_one_facet_each &= touched.facets.size() == 1;
    }
    return;
  }
  const Touched& touched = touched_[next];
  for (const std::size_t facet : touched.facets) {
    planes.push_back({touched.sum->planes[facet].normal, touched.sum->planes[facet].offset});
    if (in_crack_ || leaves_room(planes)) choose(next + 1, planes, best);
    planes.pop_back();
  }
}

double Descent::unbalanced(const Vec3& tip, double most_multiple) const {
  std::vector<Vec3> normals;
  for (const OracleSum& sum : sums_) {
    for (const std::size_t facet : touched_facets(sum, tip, touching_)) {
      const Vec3& normal = sum.planes[facet].normal;
      const bool known = std::any_of(normals.begin(), normals.end(), [&](const Vec3& other) {
        return glm::length(other - normal) < 1e-15;
      });
      if (!known) normals.push_back(normal);
    }
  }
  return distance_to_cone(tip - virtual_tip_, normals, most_multiple);
}

double Descent::free_way(const Vec3& tip, const Vec3& goal) const {
  double way = 1;
  for (const OracleSum& sum : sums_) {
    if (sum.height(tip) > touching_) {
      way = std::min(way, entry(sum, tip, goal));
    } else {
      way = std::min(way, slides_off(sum, tip, goal));
    }
  }
  return way;
}

/// Fraction of the way at which it leaves the touched facets of a sum over a side; 1 if it does
/// not.
double Descent::slides_off(const OracleSum& sum, const Vec3& tip, const Vec3& goal) const {
  double way = 1;
  for (const OraclePlane& plane : sum.planes) {
    const double before = plane.height(tip), after = plane.height(goal);
    if (before >= -touching_) {
      if (after > touching_) return 1;  // it moves off the sum
    } else if (after > 0) {
      way = std::min(way, before / (before - after));
    }
  }
  return way;
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// An edge this nearly parallel to the segment spans no facet with it.
constexpr double kParallelSine = 1e-9;

// Touching distance, as a fraction of the largest length involved.
constexpr double kTouching = 1e-13;

// Of the thinnest part. The turn is cut into steps in which no point of the tool moves farther than
// this. Pushing the turned tool out may not move it farther either, or it could come out elsewhere.
constexpr double kTurnStep = 0.25;
constexpr int kMostTurnSteps = 1000;  // of a turn
constexpr int kHalvings = 8;          // of the step in which the turn gets stuck

constexpr int kMostRounds = 5000;  // of a descent

/// Pushes the tip out of the sums, each time along the nearest facet of the deepest one, to the
/// nearest point above all facets met so far. \return false when it stays inside
bool push_out(const std::vector<OracleSum>& sums, Vec3& tip, double touching) {
  constexpr std::size_t kMostFacets = 24;
  std::vector<HalfSpace> met;
  Vec3 at = tip;
  while (true) {
    const OraclePlane* nearest = nullptr;
    double deepest = -touching;
    for (const OracleSum& sum : sums) {
      if (sum.height(at) >= deepest) continue;
      deepest = sum.height(at);
      nearest = &*std::max_element(
          sum.planes.begin(), sum.planes.end(),
          [&](const OraclePlane& a, const OraclePlane& b) { return a.height(at) < b.height(at); });
    }
    if (nearest == nullptr) break;
    if (met.size() == kMostFacets) return false;
    met.push_back({nearest->normal, nearest->offset});
    const auto out = nearest_point(tip, met, kRoundingOfTouching * touching);
    if (!out) return false;
    at = out->point;
  }
  tip = at;
  return true;
}

/// The rotation a fraction of the way between two.
Mat3 turned_between(const Mat3& from, const Mat3& to, double fraction) {
  return glm::mat3_cast(glm::slerp(glm::quat_cast(from), glm::quat_cast(to), fraction));
}

double angle_between(const Mat3& a, const Mat3& b) {
  const Quat turn = glm::quat_cast(glm::transpose(a) * b);
  return 2 * std::atan2(glm::length(Vec3(turn.x, turn.y, turn.z)), std::abs(turn.w));
}

// Compilers choose the order of a call's arguments: make every draw a statement of its own, so that
// a walk is the same everywhere.

Vec3 vector_between(Random& random, double low, double high) {
  Vec3 drawn;
  for (int k = 2; k >= 0; --k) drawn[k] = between(random, low, high);
  return drawn;
}

constexpr double kClear = 2e-3;  // m, off the object at the start of a path

struct Corner {
  double x, z;
};

/// \param outline  convex, counter-clockwise seen from -y
stimuli::PolygonSoup prism(const std::vector<Corner>& outline, double low_y, double high_y) {
  stimuli::PolygonSoup soup;
  const auto n = static_cast<std::uint32_t>(outline.size());
  for (const double y : {low_y, high_y}) {
    for (const Corner& corner : outline) soup.vertices.emplace_back(corner.x, y, corner.z);
  }
  std::vector<std::uint32_t> front, back;
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t next = (i + 1) % n;
    front.push_back(i);
    back.push_back(2 * n - 1 - i);
    soup.faces.push_back({i, n + i, n + next, next});
  }
  soup.faces.push_back(std::move(front));
  soup.faces.push_back(std::move(back));
  return soup;
}

Vec3 right_wall(double opening) { return {-std::cos(opening / 2), 0, std::sin(opening / 2)}; }

stimuli::PolygonSoup random_convex(Random& random) {
  switch (random.below(6)) {
    case 0:
      return stimuli::icosphere(0.5, static_cast<int>(random.below(2)));
    case 1: {
      const auto sides = static_cast<int>(3 + random.below(9));
      return stimuli::cone(0.5, between(random, 0.6, 1.5), sides);
    }
    case 2: {
      const auto sides = static_cast<int>(3 + random.below(9));
      return stimuli::cylinder(0.5, between(random, 0.6, 1.5), sides);
    }
    default:
      return stimuli::cube(1);
  }
}

}  // namespace

double OraclePlane::height(const Vec3& x) const { return glm::dot(normal, x) - offset; }

double OracleSum::height(const Vec3& tip) const {
  double highest = -kInfinity;
  for (const OraclePlane& plane : planes) highest = std::max(highest, plane.height(tip));
  return highest;
}

UnionOracle::UnionOracle(const std::vector<OraclePart>& parts, std::vector<OracleSegment> tool)
    : tool_(std::move(tool)) {
  thickness_ = kInfinity;
  double furthest = 0;
  for (const OraclePart& part : parts) {
    const auto world = [&](const Vec3& local) {
      return part.pose.orientation * local + part.pose.position;
    };
    Solid& solid = solids_.emplace_back();
    for (const stimuli::Facet& facet : part.mesh->facets()) {
      const Vec3 normal = glm::normalize(part.pose.orientation * facet.normal);
      solid.planes.push_back({normal, facet.offset + glm::dot(normal, part.pose.position)});
      double lowest = kInfinity;
      for (const Vec3& v : part.mesh->vertices()) {
        lowest = std::min(lowest, glm::dot(facet.normal, v));
      }
      thickness_ = std::min(thickness_, facet.offset - lowest);
    }
    for (const stimuli::Edge& edge : part.mesh->edges()) {
      solid.edges.push_back({world(edge.from), world(edge.to), edge.left, edge.right});
    }
    for (const Vec3& v : part.mesh->vertices()) {
      furthest = std::max(furthest, glm::length(world(v)));
    }
    size_ = std::max(size_, part.mesh->size());
  }
  for (const OracleSegment& segment : tool_) {
    reach_ = std::max({reach_, glm::length(segment.from), glm::length(segment.to)});
  }
  touch_ = kTouching * (size_ + reach_ + furthest);
}

std::vector<OracleSum> UnionOracle::sums(const Mat3& axes) const {
  std::vector<OracleSum> all;
  for (std::size_t i = 0; i < solids_.size(); ++i) {
    for (std::size_t j = 0; j < tool_.size(); ++j) {
      const Solid& solid = solids_[i];
      const Vec3 from = axes * tool_[j].from, to = axes * tool_[j].to, along = to - from;
      OracleSum sum{static_cast<int>(i), static_cast<int>(j), {}};
      for (const OraclePlane& facet : solid.planes) {  // with the deeper end
        const double deeper = std::min(glm::dot(facet.normal, from), glm::dot(facet.normal, to));
        sum.planes.push_back({facet.normal, facet.offset - deeper});
      }
      for (const Solid::Edge& edge : solid.edges) {  // with the segment, if it is a silhouette edge
        const Vec3 &left = solid.planes[edge.left].normal, &right = solid.planes[edge.right].normal;
        const double left_rate = glm::dot(left, along), right_rate = glm::dot(right, along);
        if ((left_rate >= 0) == (right_rate >= 0)) continue;
        const Vec3 across = glm::cross(edge.to - edge.from, along);
        const double span = glm::length(across);
        if (span <= kParallelSine * glm::length(edge.to - edge.from) * glm::length(along)) continue;
        const Vec3 out = std::abs(right_rate) * left + std::abs(left_rate) * right;
        const Vec3 normal = (glm::dot(across, out) > 0 ? 1 : -1) / span * across;
        sum.planes.push_back({normal, glm::dot(normal, edge.from) - glm::dot(normal, from)});
      }
      all.push_back(std::move(sum));
    }
  }
  return all;
}

double UnionOracle::depth(const OraclePose& tool) const {
  double deepest = -kInfinity;
  for (const OracleSum& sum : sums(tool.axes)) deepest = std::max(deepest, -sum.height(tool.tip));
  return deepest;
}

/// \return false if the whole turn was not possible
bool UnionOracle::turn(OraclePose& ideal, const Mat3& to) const {
  const double angle = angle_between(ideal.axes, to);
  const double steps =
      std::clamp(std::ceil(angle * reach_ / (kTurnStep * thickness_)), 1.0, double{kMostTurnSteps});
  const Mat3 start = ideal.axes;
  const auto try_to = [&](double fraction) {
    OraclePose turned{ideal.tip, fraction < 1 ? turned_between(start, to, fraction) : to};
    if (!push_out(sums(turned.axes), turned.tip, touch_) ||
        glm::length(turned.tip - ideal.tip) > kTurnStep * thickness_) {
      return false;
    }
    ideal = turned;
    return true;
  };
  for (double step = 1; step <= steps; ++step) {
    if (try_to(step / steps)) continue;
    for (int halving = 1; halving <= kHalvings; ++halving) {
      if (try_to((step - 1 + std::ldexp(1, -halving)) / steps)) break;
    }
    return false;
  }
  return true;
}

OracleTick UnionOracle::tick(const OraclePose& last_ideal, const OraclePose& virtual_tool) const {
  OracleTick result;
  result.ideal = last_ideal;
  result.lagged = !turn(result.ideal, virtual_tool.axes);
  const std::vector<OracleSum> all = sums(result.ideal.axes);
  Descent descent(all, virtual_tool.tip, touch_);
  Vec3& tip = result.ideal.tip;
  for (;; ++result.rounds) {
    Choice choice;
    if (result.rounds == kMostRounds || !descent.goal(tip, choice)) {
      result.failed = true;
      break;
    }
    const Vec3& goal = choice.goal.point;
    const bool there = glm::length(goal - tip) <= touch_;
    const double way = there ? 1 : descent.free_way(tip, goal);
    tip = way < 1 ? tip + way * (goal - tip) : goal;
    if (!there) continue;
    for (std::size_t i = 0; i < choice.planes.size(); ++i) {
      if (choice.goal.multipliers[i] <= 0) continue;
      OracleContact contact{choice.touched[i]->part, choice.touched[i]->segment,
                            choice.planes[i].normal, choice.goal.multipliers[i]};
      touching_portion(result.ideal, contact);
      result.contacts.push_back(contact);
    }
    result.unique_shares =
        result.contacts.size() == choice.touched.size() && choice.on_one_facet_each;
    break;
  }
  return result;
}

void UnionOracle::touching_portion(const OraclePose& ideal, OracleContact& contact) const {
  const OracleSegment& segment = tool_[static_cast<std::size_t>(contact.segment)];
  const Vec3 from = ideal.place(segment.from), to = ideal.place(segment.to);
  double first = 0, last = 1;
  for (const OraclePlane& plane : solids_[static_cast<std::size_t>(contact.part)].planes) {
    const double a = plane.height(from) - 2 * touch_, b = plane.height(to) - 2 * touch_;
    if (a > 0 && b < a) first = std::max(first, a / (a - b));
    if (b > 0 && a < b) last = std::min(last, a / (a - b));
  }
  contact.first = first * glm::length(to - from);
  contact.last = std::max(first, last) * glm::length(to - from);
}

OracleAudit UnionOracle::audit(const OraclePose& ideal, const Vec3& virtual_tip,
                               double touching) const {
  OracleAudit audit;
  const std::vector<OracleSum> all = sums(ideal.axes);
  for (const OracleSum& sum : all) {
    audit.penetration = std::max(audit.penetration, -sum.height(ideal.tip));
  }
  Choice choice;
  Descent descent(all, virtual_tip, touching);
  audit.unbalanced = descent.unbalanced(ideal.tip, 1e5);
  audit.descent = descent.goal(ideal.tip, choice) ? glm::length(choice.goal.point - ideal.tip)
                                                  : std::numeric_limits<double>::quiet_NaN();
  return audit;
}

bool UnionOracle::held_in_gap(const OraclePose& ideal, const Vec3& virtual_tip, double touching,
                              double least) const {
  constexpr double kMostLeverage = 1e9;  // more: rounding tilts parallel facets
  const std::vector<OracleSum> all = sums(ideal.axes);
  return Descent(all, virtual_tip, touching).unbalanced(ideal.tip, kMostLeverage) <= least;
}

OraclePart part_of(const stimuli::PolygonSoup& soup) {
  return {std::make_shared<const stimuli::ConvexMesh>(soup), Pose{}};
}

OraclePart box_part(const Vec3& low, const Vec3& high) {
  stimuli::PolygonSoup soup = stimuli::cube(1);
  for (Vec3& v : soup.vertices) v = 0.5 * (low + high) + v * (high - low);
  return part_of(soup);
}

OracleParts groove(double opening) {
  constexpr double kWall = 0.06, kShoulder = 0.05, kBelow = -0.04, kHalfLength = 0.1;
  const double x = kWall * std::sin(opening / 2), z = kWall * std::cos(opening / 2);
  std::vector<Corner> right{
      {0, 0}, {0, kBelow}, {x + kShoulder, kBelow}, {x + kShoulder, z}, {x, z}};
  std::vector<Corner> left;
  left.reserve(right.size());
  for (const Corner& corner : right) left.push_back({-corner.x, corner.z});
  std::reverse(left.begin(), left.end());
  return {part_of(prism(right, -kHalfLength, kHalfLength)),
          part_of(prism(left, -kHalfLength, kHalfLength))};
}

Vec3 groove_displacement(double opening, const Vec3& virtual_tip) {
  const Vec3 right = right_wall(opening), left(-right.x, 0, right.z);
  const double below_right = -glm::dot(right, virtual_tip);
  const double below_left = -glm::dot(left, virtual_tip);
  const double c = glm::dot(left, right);
  // On one wall alone, if the other one is not in the way there.
  if (below_right > 0 && below_left <= c * below_right) return below_right * right;
  if (below_left > 0 && below_right <= c * below_left) return below_left * left;
  if (below_right <= 0 && below_left <= 0) return Vec3(0);
  return {-virtual_tip.x, 0, -virtual_tip.z};
}

OracleParts stairs(int steps, double width, double height) {
  constexpr double kHalfLength = 0.1;
  OracleParts parts;
  for (int i = 0; i < steps; ++i) {
    parts.push_back(box_part({i == 0 ? -0.1 : width * (i - 1), -kHalfLength, -0.1 - height * steps},
                             {width * i, kHalfLength, -height * i}));
  }
  return parts;
}

OracleParts cut_to_pieces(const stimuli::PolygonSoup& solid, int cuts, Random& random) {
  std::vector<stimuli::PolygonSoup> pieces{solid};
  for (int i = 0; i < cuts; ++i) {
    std::vector<stimuli::PolygonSoup> smaller;
    for (const stimuli::PolygonSoup& piece : pieces) {
      Vec3 middle;
      for (const Vec3& v : piece.vertices) middle += v;
      middle /= static_cast<double>(piece.vertices.size());
      const Vec3 normal = random_direction(random);
      const double offset = glm::dot(normal, middle);
      smaller.push_back(part_below(piece, normal, offset));
      smaller.push_back(part_below(piece, -normal, -offset));
    }
    pieces = std::move(smaller);
  }
  OracleParts parts;
  for (const stimuli::PolygonSoup& piece : pieces) parts.push_back(part_of(piece));
  return parts;
}

OracleParts random_cluster(Random& random, int parts) {
  OracleParts cluster;
  Vec3 corner(-0.02);  // of the next box, which abuts the previous one
  while (static_cast<int>(cluster.size()) < parts) {
    if (random.below(3) == 0) {
      const Vec3 size = vector_between(random, 0.01, 0.03);
      cluster.push_back(box_part(corner, corner + size));
      const auto axis = static_cast<int>(random.below(3));
      corner[axis] += size[axis];
      continue;
    }
    const Quat turn = random.below(4) == 0 ? Quat(1, 0, 0, 0) : stimuli::uniform_rotation(random);
    const Vec3 factors = vector_between(random, 0.4, 1);
    const Vec3 direction = random_direction(random);
    const Vec3 place = between(random, 0, 0.025) * direction;
    const double size = between(random, 0.02, 0.05);
    const stimuli::PolygonSoup solid = stretched(random_convex(random), factors);
    cluster.push_back(part_of(turned_and_moved(solid, turn, size, place)));
  }
  return cluster;
}

OracleTool random_tool(Random& random, int segments) {
  OracleTool tool{{Vec3(0), Vec3(0, 0, between(random, 0.02, 0.12))}};
  while (static_cast<int>(tool.size()) < segments) {
    const OracleSegment& at = tool[random.below(tool.size())];
    const Vec3 from = random.below(2) == 0 ? at.from : at.to;
    const Vec3 direction = random_direction(random);
    tool.push_back({from, from + between(random, 0.01, 0.05) * direction});
  }
  return tool;
}

std::vector<OraclePose> random_tool_path(Random& random, const OracleParts& parts,
                                         const OracleTool& tool, double speed, std::size_t ticks) {
  double radius = 0;
  for (const OraclePart& part : parts) {
    for (const Vec3& v : part.mesh->vertices()) {
      radius = std::max(radius, glm::length(part.pose.orientation * v + part.pose.position));
    }
  }
  constexpr double kMostTurn = 0.6;  // rad from place to place
  Quat orientation = stimuli::uniform_rotation(random);
  const auto next_tip = [&](const Quat& turned) {
    const OracleSegment& segment = tool[random.below(tool.size())];
    const Vec3 led = segment.from + random.unit() * (segment.to - segment.from);
    const Vec3 direction = random_direction(random);
    return between(random, 0.3, 1.2) * radius * direction - turned * led;
  };
  // Comes in straight, from just off the object.
  const UnionOracle oracle(parts, tool);
  const Vec3 first = next_tip(orientation);
  const Vec3 outwards = random_direction(random);
  OraclePose at{first, glm::mat3_cast(orientation)};
  while (oracle.depth(at) > -kClear) at.tip += kClear * outwards;
  std::vector<OraclePose> path{at};
  const auto lead_to = [&](const Vec3& next, const Quat& turned) {
    const Vec3 from = at.tip;
    const double steps = std::ceil(std::max(1.0, glm::length(next - from) / speed));
    for (double step = 1; step <= steps && path.size() < ticks; ++step) {
      path.push_back({from + step / steps * (next - from),
                      glm::mat3_cast(glm::slerp(orientation, turned, step / steps))});
    }
    at = path.back();
    orientation = turned;
  };
  lead_to(first, orientation);
  while (path.size() < ticks) {
    const Vec3 axis = random_direction(random);
    const Quat turned =
        glm::normalize(glm::angleAxis(between(random, 0, kMostTurn), axis) * orientation);
    lead_to(next_tip(turned), turned);
  }
  return path;
}

}  // namespace palpate::runner::evidence
