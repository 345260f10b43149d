#include "rendering/surface_tool.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "rendering/surface_patch.h"
#include "stimuli/surfaces/surface_search.h"

namespace palpate::rendering {
namespace {

constexpr int kRounds = 96;           // casts a tick at most; then the ideal tool keeps its place
constexpr double kSlidOff = 4;        // skins; farther off its patch, a contact has ended
constexpr double kAtRest = 2e-12;     // of the size; the same without the skin
constexpr double kOffSeam = 3;        // seams; so far beyond its border a patch closes a crack
constexpr double kMouth = 1;          // seams; a free tool meets a patch so far beyond its border
constexpr double kUnderSeam = 1.25;   // seams; the side of a step that rounding makes is no deeper
constexpr double kBesideStep = 0.99;  // cosine; of the faces that it parts
constexpr double kOnPatch = 1e-11;    // of the size
constexpr double kRounding = 0.125;   // of the skin; tolerance of its width
constexpr double kLessSkin = 0.25;    // of the skin, repeatedly, in a gap narrower than two
constexpr double kInTheWay = 0.25;    // of the tolerance; a patch that is deeper holds the tool
constexpr double kSamePlace = 8;      // skins; within them a returning contact never left
// The skin hides the bottom of a flat valley: its sides would alternate endlessly. A tool that is
// held `depth` off its goal goes from the nearest place of one side to that of the other, depth
// times the angle between them, and does not meet the side that it leaves where that way times the
// angle is less than the skin: on ways of up to the root of skin times depth.
constexpr int kTimes = 2;               // releases by one patch in a tick
constexpr double kSameValley = 1e-6;    // of the size
constexpr double kHiddenWay = 4;        // of that root
constexpr double kSides = 1e-13;        // of the depth; force is wrong by less than that's root
constexpr double kSameFace = 1 - 5e-9;  // cosine of 1e-4 rad, by which rounding may bend a face
constexpr double kOnSide = 2;           // skins; from one to the exact place on the same side
constexpr int kMostInTheWay = 4;
constexpr int kPieces = 64;  // the first piece of a long cast, at least
// A list of patches along a way. A list that is used up is made again:
constexpr double kFirstWay = 0.01;  // of the size; the longest way of a tool that has not moved
constexpr double kTwice = 2;        // of the stride; else the longest way
constexpr double kSlower = 0.75;    // of the stride; it shrinks to that in a tick
constexpr double kAside = 0.5;      // of the way: room to its sides
constexpr double kThin = 0.125;     // the same, where the tool may go on in another direction
// Where triangles are so many strides long, a list about a place lasts for some ticks.
constexpr double kLasting = 8, kOfSide = 0.5;  // strides; room, of a side
constexpr double kMore = 3, kFew = 0.25;       // on finer ones: times the room; of a side, at most
constexpr double kMostRoom = 0.25;             // of the size
constexpr double kLeastRoom = 8;               // skins
constexpr double kLess = 0.5;                  // of room and way with too many patches
constexpr std::size_t kMany = 48;              // patches of a segment
constexpr double kUsedUp = 0.25;        // of the room is left, and a way is longer than a list
constexpr double kSameTurn = 0.125;     // of the tolerance; a turn that moves ends by less
constexpr double kListed = 16;          // tolerances; error of a listed plane
constexpr double kAlmostAlong = 1e-2;   // rad; closer to its edge its error is larger
constexpr double kLevelAlong = 1e-12;   // of the length; a triangle along the segment
constexpr std::size_t kOfTriangle = 5;  // patches of a triangle at most

/// m, between places of rest on the two sides of a flat valley. \param depth  of the tool
double hidden_way(double size, double skin, double depth) {
  return std::max(kSameValley * size, kHiddenWay * std::sqrt(skin * depth));
}

constexpr int kPushRounds = 12;          // pushes out of patches that a turn meets
constexpr double kLeastTurn = 1.0 / 16;  // of the turn; a shorter one waits for the next tick
constexpr double kFarPush = 8;           // times the turn's motion; a longer push fails
constexpr double kLonger = 1e-11;        // of the size; a sweep extends edges by it

/// m, the farthest motion of a segment end.
double most_moved(const PosedTool& from, const PosedTool& to, const Vec3& shift) {
  double most2 = 0;
  for (std::size_t j = 0; j < to.count; ++j) {
    const Vec3 start = to.segments[j].start + shift - from.segments[j].start;
    const Vec3 end = start + to.segments[j].along - from.segments[j].along;
    most2 = std::max({most2, glm::dot(start, start), glm::dot(end, end)});
  }
  return std::sqrt(most2);
}

/// rad, the largest turn of a segment.
double most_turned(const PosedTool& from, const PosedTool& to) {
  double most2 = 0;
  for (std::size_t j = 0; j < to.count; ++j) {
    const Vec3 turn = to.segments[j].along - from.segments[j].along;
    const double length2 = glm::dot(to.segments[j].along, to.segments[j].along);
    if (length2 > 0) most2 = std::max(most2, glm::dot(turn, turn) / length2);
  }
  return std::sqrt(most2);
}

}  // namespace

/// Lists the patches of a triangle that the listed tool can touch, or could if it were turned by
/// rounding. \param what  bits of surface_pair
void SurfaceTool::list_triangle(std::uint32_t index, std::uint8_t what, std::uint8_t segment) {
  const stimuli::SurfaceTriangle& t = surface_.triangles()[index];
  const auto add_face = [&](bool tail) {
    const Vec3 end = own_.listed.segments[segment].end(tail);
    own_.patches.add({index << 2, segment, tail, SurfacePatch::Kind::face},
                     {t.normal, t.offset - glm::dot(t.normal, end)});
  };
  if (!tick_.sides) return add_face(false);
  const Vec3& along = own_.listed.segments[segment].along;
  const double length2 = glm::dot(along, along), level = kLevelAlong * std::sqrt(length2);
  const double own = glm::dot(t.normal, along);
  if ((what & stimuli::surface_pair::kTip) != 0 && own >= -level) add_face(false);
  if (!(length2 > 0)) return;
  if ((what & stimuli::surface_pair::kTail) != 0 && own <= level) add_face(true);
  if ((what & stimuli::surface_pair::kSides) == 0) return;
  for (std::uint32_t k = 0; k < 3; ++k) {
    if (!t.owns(k) || !t.touches(k)) continue;
    const stimuli::SurfaceTriangle& beyond =
        surface_.triangles()[stimuli::SurfaceTriangle::triangle_of(t.across[k])];
    const double other = glm::dot(beyond.normal, along);
    if (std::min(own, other) > level || std::max(own, other) < -level) continue;
    const SurfacePatch patch{index << 2 | k, segment, false, SurfacePatch::Kind::edge};
    PatchPlane plane = rendering::plane_of(surface_, patch, own_.listed);
    // Rounding may turn the normal of an edge that lies almost along the segment, or reverse that
    // of one between triangles that do.
    const Vec3 e = surface_.vertices()[t.corners[(k + 1) % 3]] - surface_.vertices()[t.corners[k]];
    const Vec3 across = glm::cross(e, along);
    if ((own >= 0) == (other >= 0) ||
        glm::dot(across, across) < kAlmostAlong * kAlmostAlong * glm::dot(e, e) * length2)
      plane = {};
    own_.patches.add(patch, plane);
  }
}

/// Lists what is within own_.room of the listed way; false if that is more than `most`.
bool SurfaceTool::fill_list(std::size_t most) {
  own_.patches.clear();
  bool fits = true;
  const double room = own_.room + 4 * skin_;
  for (std::size_t j = 0; j < own_.listed.count && fits; ++j) {
    const PosedTool::Segment& segment = own_.listed.segments[j];
    surface_.touchable(
        {segment.start, segment.end(true), own_.listed_way, own_.listed_way, room, 0},
        [&](std::uint32_t triangle, std::uint8_t what) {
          list_triangle(triangle, what, static_cast<std::uint8_t>(j));
          return fits = own_.patches.size() + kOfTriangle <= most;
        });
  }
  return fits;
}

/// m, room for a list on triangles of this size: more than `aside` where that adds few of them.
double SurfaceTool::room_on_triangles(double aside) const {
  if (!in_list_ || own_.carrying_count == 0) return aside;
  const auto& corners = surface_.triangles()[own_.carrying[0].triangle()].corners;
  const double side =
      glm::length(surface_.vertices()[corners[1]] - surface_.vertices()[corners[0]]);
  if (side > kLasting * own_.stride) return std::max(aside, kOfSide * side);
  return std::max(aside, std::min(kMore * aside, kFew * side));
}

/// Lists the patches near the turned tool on a way, with the widest margin that keeps it short.
void SurfaceTool::list_about(const Vec3& at, const Vec3& way, double aside) {
  const double size = surface_.size(), least = kLeastRoom * skin_;
  own_.listed = turned_;
  for (std::size_t j = 0; j < turned_.count; ++j) own_.listed.segments[j].start += at;
  own_.listed_way = way;
  own_.room = std::clamp(room_on_triangles(aside), least, kMostRoom * size);
  own_.has_list = false;
  while (!own_.has_list) {
    const bool smallest = own_.room <= least;
    own_.has_list =
        fill_list(smallest ? kMostPatches : std::min(kMany * turned_.count, kMostPatches));
    if (own_.has_list || smallest) break;
    own_.room = std::max(least, kLess * own_.room);
    own_.listed_way *= kLess;
  }
  find_list();
}

/// Whether the tool has its orientation in the list.
bool SurfaceTool::same_turn() const {
  // A tip does not turn.
  if (!tick_.sides) return own_.listed.segments[0].along == Vec3(0);
  const Vec3 moved = from_list();
  const double same = kSameTurn * tolerance_, same2 = same * same;
  for (std::size_t j = 0; j < turned_.count; ++j) {
    const PosedTool::Segment &now = turned_.segments[j], &then = own_.listed.segments[j];
    const Vec3 turn = now.along - then.along, apart = now.start - then.start - moved;
    if (glm::dot(turn, turn) > same2 || glm::dot(apart, apart) > same2) return false;
  }
  return true;
}

/// m^2, squared distance of a translation from the listed way.
double SurfaceTool::off_way2(const Vec3& at) const {
  const Vec3 from = moved_ + at, &way = own_.listed_way;
  const Vec3 off = from - std::clamp(glm::dot(from, way) * per_way2_, 0.0, 1.0) * way;
  return glm::dot(off, off);
}

/// Whether the list is complete about there. \param share  of its room
bool SurfaceTool::in_room(const Vec3& at, double share) const {
  return in_list_ && off_way2(at) < share * share * own_.room * own_.room;
}

/// Checks for a list of this orientation.
void SurfaceTool::find_list() {
  in_list_ = own_.has_list && same_turn();
  if (!in_list_) return;
  moved_ = from_list();
  const double way2 = glm::dot(own_.listed_way, own_.listed_way);
  per_way2_ = way2 > 0 ? 1 / way2 : 0;
}

/// m; free tools do not enter cracks that rounding has opened, in the file or between patches.
double SurfaceTool::border() const {
  return planes_.empty() ? std::max(tolerance_, kMouth * surface_.seam()) : 0;
}

/// Finds the first listed patch on a straight line.
/// \param done  fraction of the way that need not be looked at; the rest begins within the list's
/// room \return fraction up to which the list is complete
double SurfaceTool::cast_on_list(const Vec3& from, const Vec3& to, double done,
                                 PatchHit& first) const {
  const Vec3 start = from + moved_, end = to + moved_, way = to - from;
  const double error = kListed * tolerance_;
  own_.patches.for_each_entered(start, end, error, first, [&](const SurfacePatch& patch) {
    if (tick_.sides && !exists(surface_, patch, turned_)) return;
    cast_on_patch(surface_, patch, rendering::plane_of(surface_, patch, turned_), turned_, from, to,
                  tolerance_, border(), first);
  });
  // The list is for a convex region.
  if (in_room(to)) return 1;
  const double length = glm::length(way);
  const double far = std::min(1.0, done + glm::length(own_.listed_way) / length);
  if (in_room(from + far * way)) return far;
  return std::min(1.0, done + (own_.room - std::sqrt(off_way2(from + done * way))) / length);
}

/// Finds the first patch on a straight line.
PatchHit SurfaceTool::cast(const Vec3& from, const Vec3& to) {
  PatchHit first;
  const Vec3 way = to - from;
  const double length = glm::length(way);
  if (!(length > 0)) return first;
  const double far = own_.stride > 0 ? kTwice * own_.stride : kFirstWay * surface_.size();
  double done = 0;
  if (length <= far ? in_room(from) && in_room(to) : in_room(from, 1 - kUsedUp)) {
    done = cast_on_list(from, to, 0, first);
    if (first.time <= done || done >= 1) return first;
  }
  // The list is used up, or too short for the way: renew it.
  const double rest = length - done * length;
  list_about(from + done * way, std::min(rest, far) / length * way,
             (fresh_ || rest > far ? kThin : kAside) * std::min(rest, far));
  fresh_ = true;
  if (in_list_) {
    first = {};
    done = cast_on_list(from, to, done, first);
    if (first.time <= done || done >= 1) return first;
  }
  first = {};
  double piece = std::max({own_.room, far, skin_, length / kPieces}) / length;
  while (done < 1) {
    const double end = std::min(1.0, done + piece);
    const Vec3 middle = from + done * way, step = (end - done) * way;
    for (std::size_t j = 0; j < turned_.count; ++j) {
      const PosedTool::Segment& segment = turned_.segments[j];
      surface_.touchable(
          {segment.start + middle, segment.end(true) + middle, step, step, 2 * skin_, 0},
          [&](std::uint32_t triangle, std::uint8_t what) {
            for_each_patch(surface_, triangle, static_cast<std::uint8_t>(j), what, segment.along,
                           [&](const SurfacePatch& patch) {
                             cast_on_patch(surface_, patch,
                                           rendering::plane_of(surface_, patch, turned_), turned_,
                                           from, to, tolerance_, border(), first);
                           });
            return true;
          });
    }
    if (first.time <= end) return first;
    first = {};
    done = end;
    piece *= 2;
  }
  return first;
}

bool SurfaceTool::holds(const SurfacePatch& patch) const {
  const auto all = planes_.all();
  return std::any_of(all.begin(), all.end(),
                     [&](const SurfacePlane& plane) { return plane.patch == patch; });
}

/// Adds the planes that held the tool at the last tick, if it is still outside of them.
void SurfaceTool::resume_planes() {
  // Drop planes of the turn that the tool does not rest on.
  planes_.remove_if([&](const SurfacePlane& plane) {
    return plane.multiplier <= 0 || !(glm::dot(plane.normal, at_) - plane.depth > 0);
  });
  for (std::size_t i = 0; i < own_.carrying_count && !planes_.full(); ++i) {
    const SurfacePlane plane = plane_at(own_.carrying[i]);
    if (holds(plane.patch) || !(glm::dot(plane.normal, at_) - plane.depth > 0)) continue;
    planes_.add(plane);
  }
}

/// m, distance of the tool from the patch of a plane, along the plane.
double SurfaceTool::off_patch(const SurfacePlane& plane, const Vec3& at) const {
  return distance_off(polygon_of(surface_, plane.patch, turned_), plane.normal, at);
}

bool SurfaceTool::parted_here(const SurfacePatch& patch) const {
  const double same = kSamePlace * skin_;
  for (std::size_t i = 0; i < parted_count_; ++i) {
    const Parted& parted = parted_[i];
    if (!(parted.patch == patch)) continue;
    const double far =
        parted.times < kTimes ? same : hidden_way(surface_.size(), skin_, glm::length(at_));
    const Vec3 apart = at_ - parted.at;
    return glm::dot(apart, apart) <= far * far;
  }
  return false;
}

/// Drops planes that hold nothing.
void SurfaceTool::release_idle_planes() {
  planes_.remove_if([](const SurfacePlane& plane) { return !(plane.multiplier > 0); });
}

/// Drops planes whose patch the tool has slid off; returns whether there were any.
bool SurfaceTool::release_slid_planes(const Vec3& at, double slack) {
  bool slid = false;
  planes_.remove_if([&](SurfacePlane& plane) {
    if (plane.stays && parted_here(plane.patch)) return false;
    if (!(off_patch(plane, at) > slack)) return false;
    std::size_t known = 0;
    while (known < parted_count_ && !(parted_[known].patch == plane.patch)) ++known;
    if (known == parted_.size()) {  // forget the oldest
      std::move(parted_.begin() + 1, parted_.end(), parted_.begin());
      parted_[--known].times = 0;
    }
    if (known == parted_count_) parted_[parted_count_++].times = 0;
    parted_[known] = {plane.patch, at_, parted_[known].times + 1};
    slid = true;
    return true;
  });
  return slid;
}

/// Finds the place of rest without the skin, and the multipliers. False if rounding hides it.
bool SurfaceTool::find_exact_place() {
  return (in_valley() && planes_.nearest(Vec3(0), 0, kSides * glm::length(at_), exact_)) ||
         planes_.nearest(Vec3(0), 0, kExact * skin_, exact_) ||
         planes_.nearest(Vec3(0), 0, kRounding * skin_, exact_);
}

/// Whether the tool rests on a patch with the skin but beyond its border without it: a groove's
/// patches may end in between and leave a gap that is narrower than the skin.
bool SurfaceTool::past_a_patch_at_rest() const {
  const double size = surface_.size(), slack = kSlidOff * skin_ + kOnPatch * size;
  bool past = false, off = false;
  for (const SurfacePlane& plane : planes_.all()) {
    if (!(plane.multiplier > 0)) continue;
    past = past || (plane.stays && off_patch(plane, exact_) > kOnPatch * size);
    off = off || off_patch(plane, at_) > slack;
  }
  return past && !off;
}

/// Whether the tool rests on a side of a flat valley.
bool SurfaceTool::in_valley() const {
  const auto all = planes_.all();
  return std::any_of(all.begin(), all.end(), [](const SurfacePlane& plane) { return plane.stays; });
}

/// Whether a patch that the tool enters when the skin is removed is the side of a step that
/// rounding has made. \param under  m, how deep it enters
bool SurfaceTool::is_step(const PatchPlane& plane, double under) const {
  if (!(under <= kUnderSeam * surface_.seam())) return false;
  const auto all = planes_.all();
  return std::none_of(all.begin(), all.end(), [&](const SurfacePlane& held) {
    return glm::dot(held.normal, plane.normal) > kBesideStep;
  });
}

/// Looks for a patch that the tool enters when the skin is removed; sets its plane, or step_.
bool SurfaceTool::in_the_way_at_rest(SurfacePlane& out) {
  double deepest = in_valley() ? kSides * glm::length(at_) : kInTheWay * tolerance_;
  double in_step = 0;
  bool found = false;
  step_.reset();
  const auto look = [&](const SurfacePatch& patch, const PatchPlane& plane) {
    const double under = plane.depth - glm::dot(plane.normal, exact_);
    if (!(under > deepest || (found && under == deepest && patch.segment == out.patch.segment &&
                              patch.triangle() < out.patch.triangle())) ||
        plane.depth - glm::dot(plane.normal, at_) > tolerance_)
      return;
    if (holds(patch)) return;
    const bool step = is_step(plane, under);
    if (step && !(under > in_step)) return;
    PatchHit hit;
    cast_on_patch(surface_, patch, plane, turned_, at_, exact_, tolerance_, 0, hit);
    if (!hit.hit()) return;
    if (step) {
      in_step = under;
      step_ = {patch, plane.normal, plane.depth, 0, false, true};
      return;
    }
    deepest = under;
    found = true;
    out = {patch, plane.normal, plane.depth};
  };
  if (in_room(exact_)) {
    own_.patches.for_each_entered(at_ + moved_, exact_ + moved_, kListed * tolerance_, {},
                                  [&](const SurfacePatch& patch) {
                                    if (exists(surface_, patch, turned_))
                                      look(patch, rendering::plane_of(surface_, patch, turned_));
                                  });
    return found;
  }
  for (std::size_t j = 0; j < turned_.count; ++j) {
    const PosedTool::Segment& segment = turned_.segments[j];
    surface_.touchable(
        {segment.start + exact_, segment.end(true) + exact_, Vec3(0), Vec3(0), 4 * skin_, 0},
        [&](std::uint32_t triangle, std::uint8_t what) {
          for_each_patch(surface_, triangle, static_cast<std::uint8_t>(j), what, segment.along,
                         [&](const SurfacePatch& patch) {
                           look(patch, rendering::plane_of(surface_, patch, turned_));
                         });
          return true;
        });
  }
  return found;
}

/// Adds a plane to those that hold the tool.
void SurfaceTool::take_plane(const SurfacePlane& plane) {
  if (planes_.full()) release_idle_planes();
  stuck_ = planes_.full();
  if (!stuck_) planes_.add(plane);
}

void SurfaceTool::move_to_hit(const Vec3& goal, const PatchHit& hit) {
  SurfacePlane plane = plane_at(hit.patch);
  // Stop one skin before the plane.
  const Vec3 way = goal - at_;
  const double rate = glm::dot(plane.normal, way);
  const double height = glm::dot(plane.normal, at_) - plane.depth;
  const double time = rate < 0 ? std::clamp((height - skin_) / -rate, 0.0, hit.time) : 0.0;
  at_ += time * way;
  if (time * glm::length(way) > kSamePlace * skin_) {
    release_idle_planes();
    release_slid_planes(at_, kSlidOff * skin_ + kOnPatch * surface_.size());
  }
  if (holds(plane.patch)) return;
  plane.stays = parted_here(plane.patch);
  take_plane(plane);
}

/// Finds the point nearest to the virtual tool that is one skin off the planes. In a gap narrower
/// than two skins it keeps part of the skin, or else its present distances. False if rounding hides
/// it.
bool SurfaceTool::find_goal(Vec3& goal) {
  in_crack_ = false;
  if (planes_.nearest(Vec3(0), skin_, kRounding * skin_, goal)) return true;
  in_crack_ = planes_.are_a_crack();
  for (double less = kLessSkin * skin_; less >= kExact * skin_; less *= kLessSkin) {
    if (planes_.nearest(Vec3(0), less, kRounding * less, goal)) return true;
  }
  return planes_.nearest_from(at_, skin_, kRounding * skin_, kExact * skin_, goal);
}

/// Whether the tool is at rest when the skin is removed. Adds the planes that it would enter; they
/// stay even if they hold nothing one skin away.
bool SurfaceTool::rests() {
  SurfacePlane in_the_way;
  for (int i = 0; i < kMostInTheWay; ++i) {
    if (!in_the_way_at_rest(in_the_way)) return true;
    const auto all = planes_.all();
    const bool flat = std::any_of(all.begin(), all.end(), [&](const SurfacePlane& plane) {
      return plane.stays || glm::dot(plane.normal, in_the_way.normal) > kSameFace;
    });
    const double far =
        flat ? hidden_way(surface_.size(), skin_, glm::length(at_)) : kSamePlace * skin_;
    take_plane(in_the_way);
    if (stuck_) return false;
    const Vec3 last = exact_;
    if (!find_exact_place()) return false;
    const Vec3 moved = exact_ - last;
    if (glm::dot(moved, moved) > far * far) return false;
  }
  return false;
}

/// Moves the place of rest out of steps of rounding. They do not hold the tool at later ticks.
void SurfaceTool::leave_steps() {
  const PlanesOf<SurfacePlane> held = planes_;
  const Vec3 rest = exact_;
  const double far = kSamePlace * skin_;
  for (int i = 0; i < kMostInTheWay && step_; ++i) {
    if (planes_.full()) break;
    planes_.add(*step_);
    if (!find_exact_place()) break;
    const Vec3 moved = exact_ - rest;
    SurfacePlane in_the_way;
    if (glm::dot(moved, moved) > far * far || in_the_way_at_rest(in_the_way)) break;
    if (!step_) return;
  }
  planes_ = held;
  exact_ = rest;
}

/// Moves the ideal tool as near to the virtual one as the surface allows.
void SurfaceTool::translate() {
  const Vec3 from = at_;
  fresh_ = false;
  find_list();
  find_rest();
  own_.stride = std::max(glm::length(at_ - from), kSlower * own_.stride);
}

void SurfaceTool::find_rest() {
  parted_count_ = 0;
  const double slack = std::max(kAtRest * surface_.size(), kOffSeam * surface_.seam());
  for (int round = 0; round < kRounds && !stuck_; ++round) {
    Vec3 goal;
    if (!find_goal(goal)) break;
    // A free tool stops before a patch that its goal is less than a skin away from. Exactly on it
    // and on another's border, rounding would decide whether a later cast meets either.
    Vec3 far_goal = goal;
    if (planes_.empty()) {
      const double length = glm::length(goal - at_);
      if (length > 0) far_goal += skin_ / length * (goal - at_);
    }
    const PatchHit hit = cast(at_, far_goal);
    if (hit.hit()) {
      move_to_hit(far_goal, hit);
      continue;
    }
    at_ = goal;
    release_idle_planes();
    if (!find_exact_place()) break;
    if (release_slid_planes(exact_, slack)) continue;
    if (past_a_patch_at_rest()) {
      // Beyond its border is the valley's other side, or a gap.
      const PlanesOf<SurfacePlane> sides = planes_;
      const bool at_rest = rests();
      if (at_rest && (planes_.all().size() > sides.all().size() ||
                      glm::distance(at_, exact_) <= kOnSide * skin_))
        return;
      planes_ = sides;
      stuck_ = false;
      if (!find_goal(exact_)) break;  // the gap is too narrow
    }
    if (rests()) return;
  }
  stuck_ = true;
}

/// Finds the first patch that the tool meets while its segment ends move linearly.
/// \param border  m; so far beyond its border a patch is met as well
PatchHit SurfaceTool::sweep(const PosedTool& from, const PosedTool& to, const Vec3& shift,
                            double border) const {
  PatchHit first;
  const double slack = std::max(kLonger * surface_.size(), border);
  for (std::size_t j = 0; j < to.count; ++j) {
    const PosedTool::Segment& a = from.segments[j];
    const PosedTool::Segment b{to.segments[j].start + shift, to.segments[j].along};
    surface_.touchable(
        {a.start, a.end(true), b.start - a.start, b.end(true) - a.end(true), 2 * skin_, 0},
        [&](std::uint32_t triangle, std::uint8_t what) {
          sweep_triangle(surface_, triangle, static_cast<std::uint8_t>(j), what, a, b, tolerance_,
                         slack, border, first);
          return true;
        });
  }
  return first;
}

/// Turns the ideal tool about its contacts to the virtual orientation, as far as the surface
/// allows.
/// \param most  largest fraction to try \return fraction taken, 0 to 1
double SurfaceTool::turn(const ToolPose& from, double most) {
  const PosedTool whole = pose(target_);
  const Vec3 apart = placed_.local_vector(from.tip - target_.tip);
  planes_.clear();
  if (!tick_.sides) {  // a tip does not turn
    pose_ = target_;
    turned_ = whole;
    at_ = apart;
    return 0;
  }
  const PosedTool before = pose(from);
  const Vec3 shift =
      placed_.local_vector(turned(memory_.grasp, from) - turned(memory_.grasp, target_));
  // Turn about the grasp, from the last place.
  const double motion = most_moved(before, whole, apart + shift);
  if (motion <= kExact * skin_) {
    pose_ = target_;
    turned_ = whole;
    at_ = apart;
    return 0;
  }
  const double far = kFarPush * motion + 4 * skin_;
  for (double fraction = most; fraction >= kLeastTurn; fraction *= 0.5) {
    ToolPose to = target_;
    if (fraction < 1) to = between(from, target_, fraction);
    to.tip = target_.tip;
    pose_ = to;
    turned_ = fraction == 1 ? whole : pose(to);
    at_ = placed_.local_vector(from.tip + turned(memory_.grasp, from) - turned(memory_.grasp, to) -
                               target_.tip);
    if (settle(before, far)) return fraction;
  }
  pose_ = from;
  pose_.tip = target_.tip;
  turned_ = before;
  for (std::size_t j = 0; j < turned_.count; ++j) turned_.segments[j].start -= apart;
  at_ = apart;
  planes_.clear();
  return 0;
}

/// Moves a free tool that turns to the virtual one, or above the first patches that it meets on its
/// way there, as its ends move linearly; returns whether it found such a place. Leaves one that
/// does not turn where it is.
bool SurfaceTool::approach(const ToolPose& from) {
  const PosedTool before = pose(from);
  pose_ = target_;
  turned_ = pose(target_);
  at_ = placed_.local_vector(from.tip - target_.tip);
  planes_.clear();
  if (most_moved(before, turned_, at_) <= kExact * skin_) return true;
  at_ = Vec3(0);
  const double motion = most_moved(before, turned_, at_);
  // It stops before a patch that the virtual tool is less than a skin away from, as in find_rest().
  const double ahead = 1 + skin_ / motion;
  PosedTool beyond = turned_;
  for (std::size_t j = 0; j < beyond.count; ++j) {
    const PosedTool::Segment& a = before.segments[j];
    PosedTool::Segment& b = beyond.segments[j];
    b.start = a.start + ahead * (b.start - a.start);
    b.along = a.along + ahead * (b.along - a.along);
  }
  const PatchHit hit = sweep(before, beyond, Vec3(0), border());
  if (!hit.hit()) return true;
  own_.carrying[0] = patch_after_turn(surface_, hit.patch, turned_);
  own_.carrying_count = 1;
  const bool settled = settle(before, kFarPush * motion + 4 * skin_);
  if (!settled) own_.carrying_count = 0;
  return settled;
}

/// Puts planes back that were raised to let a turn pass.
void SurfaceTool::lower_planes() {
  for (SurfacePlane& plane : planes_.all()) plane.depth = plane_at(plane.patch).depth;
}

/// Moves the tool to turned_ at about at_ if no patch is in the way; returns whether it did.
bool SurfaceTool::settle(const PosedTool& from, double most_push) {
  const Vec3 wanted = at_;
  double dip = skin_ + 0.125 * most_moved(from, turned_, wanted) * most_turned(from, turned_);
  planes_.clear();
  for (std::size_t i = 0; i < own_.carrying_count; ++i) {
    const SurfacePatch patch = patch_after_turn(surface_, own_.carrying[i], turned_);
    if (!holds(patch) && !planes_.full()) planes_.add(plane_at(patch));
  }
  bool raised = false;
  for (int round = 0; round < kPushRounds; ++round) {
    if (!planes_.empty()) {
      if (!planes_.nearest(wanted, skin_, skin_ / 8, at_)) return false;
      const Vec3 moved = at_ - wanted;
      if (!(glm::dot(moved, moved) <= most_push * most_push)) return false;
    }
    const PatchHit hit = sweep(from, turned_, at_);
    if (!hit.hit()) {
      if (raised) lower_planes();
      return true;
    }
    const SurfacePatch patch = patch_after_turn(surface_, hit.patch, turned_);
    bool held = false;
    for (SurfacePlane& plane : planes_.all()) {
      if (!(plane.patch == patch)) continue;
      // The tool dips below an edge on the way, although both end poses are above it.
      plane.depth += dip;
      held = raised = true;
    }
    dip *= 2;
    if (held) continue;
    if (planes_.full()) return false;
    planes_.add(plane_at(patch));
  }
  return false;
}

}  // namespace palpate::rendering
