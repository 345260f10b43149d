#include "stimuli/closed_surface.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <future>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "stimuli/face_triangles.h"
#include "stimuli/flat_faces.h"
#include "stimuli/half_edges.h"
#include "stimuli/mesh_names.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/side_groups.h"
#include "stimuli/weld.h"

#if defined(__GLIBC__)
#include <malloc.h>
#endif

namespace palpate::stimuli {
namespace {

using Index = std::uint32_t;
using Triangle = std::array<Index, 3>;
constexpr Index kNoPoint = 0xffffffff;

constexpr const char* kClose = "; fill holes and orient faces in a modelling program";

// m, in units of a coordinate's error: nearer than this, a corner lies on a line or on another one.
constexpr double kFlatErrors = 4;
// The same: from a plane face. Rounding moves a corner by up to the root of 3.
constexpr double kPlaneErrors = 2.5;
// m, in the same units: corners on open edges nearer than this are meant to be one.
constexpr double kRimErrors = 8;
// With more open edges than this, a surface is not a closed one with flaws.
constexpr std::size_t kMostRims = 20000;

std::string counted(std::size_t count, const char* one, const char* many) {
  return std::to_string(count) + ' ' + (count == 1 ? one : many);
}

/// Makes the surface, step by step.
class Cleaner {
 public:
  explicit Cleaner(const PolygonSoup& soup) : soup_(soup), naming_(soup.names) {}

  /// Gives the soup up when it is welded.
  CleanedSurface run_while(PolygonSoup& own,
                           const std::function<void(const ClosedSurface&)>& meanwhile) {
    given_up_ = &own;
    meanwhile_ = &meanwhile;
    return run();
  }

  CleanedSurface run() {
    clean();
    ClosedSurface surface = take_surface();
    surface.coordinate_error = soup_.coordinate_error;
    surface.flat_face = find_flat_faces(surface, kPlaneErrors * error_);
    if (given_up_) cut_flat_faces_anew(surface);
    Pockets pockets = given_up_ ? checked_meanwhile(surface) : checked(surface);
    if (pockets.depth > 0) {
      char text[200];
      std::snprintf(text, sizeof text,
                    "it passes through itself, at (%.6g, %.6g, %.6g) m by %.2g m: no hand can feel "
                    "that",
                    pockets.place.x, pockets.place.y, pockets.place.z, pockets.depth);
      notes_.emplace_back(text);
    }
    surface.at_pockets = std::move(pockets.triangles);
    if (!given_up_) cut_flat_faces_anew(surface);  // the check named triangles by their faces
    return {std::move(surface), std::move(notes_)};
  }

  std::vector<std::string> notes() {
    clean();
    return std::move(notes_);
  }

 private:
  void clean() {
    check_numbers(soup_);
    take_corners();
    take_faces();
    drop_fins();
    balance();
    link();
    const Flattened flat =
        collapse_flat_triangles(points_, triangles_, across_, kFlatErrors * error_);
    if (flat.triangles > 0) {
      drop_gone();
      drop_fins();
      link();
    }
    note(dropped_ + flat.triangles, "triangle without area left out, its neighbours joined",
         "triangles without area left out, their neighbours joined");
    if (flat.farthest > error_) {
      char text[100];
      std::snprintf(text, sizeof text, " merged with another at most %.2g m from it",
                    flat.farthest);
      note(flat.corners, (std::string("corner") + text).c_str(),
           (std::string("corners, each") + text).c_str());
    }
    if (triangles_.empty()) {
      MeshFaults faults;
      faults.add("flat", [] { return "expected a solid, found no volume"; });
      faults.throw_if_any();
    }
  }

  void note(std::size_t count, const char* one, const char* many) {
    if (count > 0) notes_.push_back(counted(count, one, many));
  }

  Pockets checked(const ClosedSurface& surface) const {
    return check_winding(surface, kFlatErrors * error_,
                         [this](Index t) { return name_of_face(soup_, face_[t]); });
  }

  Pockets checked_meanwhile(const ClosedSurface& surface) {
    const auto forget = [](auto&... all) { ((all = {}, all.shrink_to_fit()), ...); };
    forget(given_up_->vertices, given_up_->faces, points_, point_of_, vertex_, face_, bent_);
    given_up_->names = nullptr;
    naming_ = {};
#if defined(__GLIBC__)
    malloc_trim(0);  // the faces were many small pieces
#endif
    std::future<Pockets> pockets = std::async(std::launch::async, [this, &surface] {
      return check_winding(surface, kFlatErrors * error_,
                           [](Index) { return std::string("a face"); });
    });
    (*meanwhile_)(surface);
    return pockets.get();
  }

  // Corners that no face uses are left out: they must not make the object seem larger than it is.
  void take_corners() {
    const std::vector<Index> kept = weld_equal(soup_.vertices);
    point_of_.assign(soup_.vertices.size(), kNoPoint);
    std::vector<char> used(soup_.vertices.size(), 0);
    for (const auto& face : soup_.faces) {
      for (const Index v : face) used[v] = 1;
    }
    std::size_t unused = 0, twice = 0;
    for (Index v = 0; v < kept.size(); ++v) {
      if (used[v] == 0) {
        ++unused;
        continue;
      }
      Index& point = point_of_[kept[v]];
      if (point == kNoPoint) {
        point = static_cast<Index>(points_.size());
        points_.push_back(soup_.vertices[v] + 0.0);  // -0 is 0
        vertex_.push_back(v);
      } else {
        ++twice;
      }
      point_of_[v] = point;
    }
    // Separate triangles repeat every corner anyway, so a note would say nothing.
    const bool numbered = !soup_.names || !soup_.names->vertices.empty();
    if (numbered)
      note(twice, "corner merged with another at the same place",
           "corners merged with others at the same places");
    if (numbered) note(unused, "corner in no face left out", "corners in no face left out");
    Vec3 low(std::numeric_limits<double>::max()), high = -low;
    for (const Vec3& point : points_) {
      low = glm::min(low, point);
      high = glm::max(high, point);
    }
    const Vec3 far = glm::max(glm::abs(low), glm::abs(high));
    size_ = glm::length(high - low);
    error_ =
        std::max({soup_.coordinate_error, 1e-11 * size_,
                  8 * std::numeric_limits<double>::epsilon() * std::max({far.x, far.y, far.z})});
  }

  void add_triangle(const Triangle& t, Index face) {
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) {
      ++dropped_;
      return;
    }
    triangles_.push_back(t);
    face_.push_back(face);
  }

  void take_faces() {
    std::size_t cut = 0;
    triangles_.reserve(soup_.faces.size());
    face_.reserve(soup_.faces.size());
    std::vector<Index> loop;
    std::vector<Vec3> corners;
    for (Index f = 0; f < soup_.faces.size(); ++f) {
      const std::vector<Index>& face = soup_.faces[f];
      if (face.size() == 3) {
        add_triangle({point_of_[face[0]], point_of_[face[1]], point_of_[face[2]]}, f);
        continue;
      }
      loop.clear();
      for (const Index v : face) {
        if (loop.empty() || loop.back() != point_of_[v]) loop.push_back(point_of_[v]);
      }
      while (loop.size() > 1 && loop.back() == loop.front()) loop.pop_back();
      if (loop.size() < 3) {
        ++dropped_;
        continue;
      }
      corners.clear();
      for (const Index v : loop) corners.push_back(points_[v]);
      ++cut;
      const std::vector<Triangle> pieces = face_triangles(corners);
      if (loop.size() == 4) note_bent(corners, loop, pieces, f);
      for (const Triangle& t : pieces) add_triangle({loop[t[0]], loop[t[1]], loop[t[2]]}, f);
    }
    note(cut, "face of four or more corners cut into triangles",
         "faces of four or more corners cut into triangles");
    note_diagonals();
  }

  /// Where a face of four corners was cut: bent, it is another surface along the other diagonal.
  struct BentFace {
    double bend;  ///< m, between the diagonals
    Index face, from, to;
    bool operator<(const BentFace& other) const {
      return bend != other.bend ? bend > other.bend : face < other.face;
    }
  };

  void note_bent(const std::vector<Vec3>& corners, const std::vector<Index>& loop,
                 const std::vector<Triangle>& pieces, Index face) {
    const Vec3 across = glm::cross(corners[2] - corners[0], corners[3] - corners[1]);
    const double length = glm::length(across);
    if (!(length > 0)) return;
    const double bend = std::abs(glm::dot(across / length, corners[1] - corners[0]));
    if (bend <= kFlatErrors * error_) return;
    const auto is_in_both = [&](Index corner) {
      return std::all_of(pieces.begin(), pieces.end(), [&](const Triangle& t) {
        return std::find(t.begin(), t.end(), corner) != t.end();
      });
    };
    const Index from = is_in_both(0) ? 0 : 1;
    bent_.push_back({bend, face, loop[from], loop[from + 2]});
  }

  // Names the most bent.
  void note_diagonals() {
    constexpr std::size_t kNamed = 3;
    std::sort(bent_.begin(), bent_.end());
    for (std::size_t i = 0; i < std::min(kNamed, bent_.size()); ++i) {
      const BentFace& bent = bent_[i];
      char text[60];
      std::snprintf(text, sizeof text, " is bent by %.2g m; cut between vertices ", bent.bend);
      notes_.push_back(name_of_face(soup_, bent.face) + text + label(bent.from) + " and " +
                       label(bent.to));
    }
    if (bent_.size() > kNamed) {
      note(bent_.size() - kNamed, "other bent face cut where its triangles are least narrow",
           "other bent faces cut where their triangles are least narrow");
    }
  }

  // Two triangles back to back enclose nothing.
  void drop_fins() {
    std::vector<char> gone(triangles_.size(), 0);
    std::vector<std::pair<Triangle, Index>> sorted;  // with the corners of another
    sides_.emplace(points_.size(), triangles_);
    sides_->for_each_edge([&](const SideGroups::Edge& edge) {
      if (edge.sides.size() < 3) return;
      for (const SideGroups::Side& side : edge.sides) {
        Triangle key = triangles_[side.triangle()];
        std::sort(key.begin(), key.end());
        sorted.emplace_back(key, side.triangle());
      }
    });
    // Back to back along a whole edge that no other triangle has.
    sides_->for_each_edge([&](const SideGroups::Edge& edge) {
      if (edge.sides.size() != 2) return;
      Triangle a = triangles_[edge.sides[0].triangle()], b = triangles_[edge.sides[1].triangle()];
      std::sort(a.begin(), a.end());
      std::sort(b.begin(), b.end());
      if (a != b) return;
      sorted.emplace_back(a, edge.sides[0].triangle());
      sorted.emplace_back(a, edge.sides[1].triangle());
    });
    std::sort(sorted.begin(), sorted.end());
    sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
    std::size_t fins = 0;
    for (std::size_t i = 0; i < sorted.size();) {
      std::size_t end = i;
      std::vector<Index> even, odd;
      for (; end < sorted.size() && sorted[end].first == sorted[i].first; ++end) {
        const Triangle& t = triangles_[sorted[end].second];
        const auto least = std::min_element(t.begin(), t.end()) - t.begin();
        const bool up = t[static_cast<std::size_t>(least + 1) % 3] == sorted[i].first[1];
        (up ? even : odd).push_back(sorted[end].second);
      }
      for (std::size_t k = 0; k < std::min(even.size(), odd.size()); ++k) {
        gone[even[k]] = gone[odd[k]] = 1;
        ++fins;
      }
      i = end;
    }
    if (fins == 0) return;
    note(fins, "pair of faces back to back left out", "pairs of faces back to back left out");
    drop(gone);
  }

  void drop(const std::vector<char>& gone) {
    sides_.reset();
    std::size_t kept = 0;
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      if (gone[t] != 0) continue;
      triangles_[kept] = triangles_[t];
      face_[kept++] = face_[t];
    }
    triangles_.resize(kept);
    face_.resize(kept);
  }

  void link() {
    if (!sides_) sides_.emplace(points_.size(), triangles_);
    link_triangles(points_, triangles_, *sides_, across_);
    sides_.reset();
  }

  void drop_gone() {
    std::vector<char> gone(triangles_.size(), 0);
    for (std::size_t t = 0; t < triangles_.size(); ++t)
      gone[t] = static_cast<char>(triangles_[t][0] == kNoPoint);
    drop(gone);
  }

  std::string label(Index point) const { return naming_.label(vertex_[point], points_[point]); }

  /// Edges along which more triangles run one way than the other.
  struct Unbalanced {
    std::size_t open = 0, other = 0;           ///< edges of one triangle; of several
    std::vector<SideGroups::Side> sides = {};  ///< of the open ones
  };

  Unbalanced unbalanced() const {
    Unbalanced found;
    const auto look = [&](const SideGroups::Edge& edge) {
      if (2 * ups(edge) == edge.sides.size()) return;
      ++(edge.sides.size() == 1 ? found.open : found.other);
      if (edge.sides.size() == 1) found.sides.push_back(edge.sides[0]);
    };
    if (sides_) {
      sides_->for_each_edge(look);
    } else {
      SideGroups(points_.size(), triangles_).for_each_edge(look);
    }
    return found;
  }

  static std::size_t ups(const SideGroups::Edge& edge) {
    return static_cast<std::size_t>(
        std::count_if(edge.sides.begin(), edge.sides.end(),
                      [](const SideGroups::Side& side) { return side.up(); }));
  }

  bool balanced() const {
    const Unbalanced found = unbalanced();
    return found.open + found.other == 0;
  }

  // Makes as many triangles run one way as the other along every edge. Mends a fault only where
  // there is just one way to do so.
  void balance() {
    Unbalanced found = unbalanced();
    if (found.open + found.other == 0) return;
    sides_.reset();  // triangles change
    const std::vector<Triangle> triangles = triangles_;
    const std::vector<Index> faces = face_;
    const std::vector<std::string> notes = notes_;
    if (found.other > 0 && drop_twins()) found = unbalanced();
    if (found.other == 0 && found.open > 0 && weld_rims(found)) found = unbalanced();
    if (found.other == 0 && found.open > 0) split_rims(found);
    if (balanced()) return;
    triangles_ = triangles;
    face_ = faces;
    notes_ = notes;
    report_unbalanced();
  }

  // Drops faces that are given twice, turned the same way.
  bool drop_twins() {
    std::vector<std::pair<Triangle, Index>> sorted;
    for (Index t = 0; t < triangles_.size(); ++t) {
      Triangle key = triangles_[t];
      std::rotate(key.begin(), std::min_element(key.begin(), key.end()), key.end());
      sorted.emplace_back(key, t);
    }
    std::sort(sorted.begin(), sorted.end());
    std::vector<char> gone(triangles_.size(), 0);
    std::size_t twins = 0;
    for (std::size_t i = 1; i < sorted.size(); ++i) {
      if (sorted[i].first != sorted[i - 1].first) continue;
      gone[sorted[i].second] = 1;
      ++twins;
    }
    note(twins, "face that is given twice left out once",
         "faces that are given twice left out once");
    drop(gone);
    return twins > 0;
  }

  std::vector<Index> rim_points(const Unbalanced& found) const {
    std::vector<Index> rim;
    for (const SideGroups::Side& side : found.sides) {
      const Triangle& t = triangles_[side.triangle()];
      rim.push_back(t[side.k()]);
      rim.push_back(t[(side.k() + 1) % 3]);
    }
    std::sort(rim.begin(), rim.end());
    rim.erase(std::unique(rim.begin(), rim.end()), rim.end());
    return rim;
  }

  // For each corner of the rim, the first one that it is welded to.
  std::vector<Index> welded(const std::vector<Index>& rim, double within) const {
    std::vector<Vec3> at;
    at.reserve(rim.size());
    for (const Index v : rim) at.push_back(points_[v]);
    return weld(at, within);
  }

  // Welds corners on open edges that differ in the last digits only. \return whether there are any
  bool weld_rims(const Unbalanced& found) {
    const std::vector<Index> rim = rim_points(found);
    const double within = kRimErrors * error_;
    const std::vector<Index> kept = welded(rim, within);
    // Other corners are nearly as near, so the intended match is unclear.
    if (kept != welded(rim, 4 * within)) return false;
    std::vector<Index> to(points_.size());
    std::iota(to.begin(), to.end(), Index{0});
    std::size_t moved = 0;
    double farthest = 0;
    for (std::size_t i = 0; i < rim.size(); ++i) {
      if (kept[i] == i) continue;
      to[rim[i]] = rim[kept[i]];
      ++moved;
      farthest = std::max(farthest, glm::distance(points_[rim[i]], points_[rim[kept[i]]]));
    }
    if (moved == 0) return false;
    std::vector<Triangle> triangles = std::move(triangles_);
    const std::vector<Index> faces = std::move(face_);
    triangles_.clear();
    face_.clear();
    for (std::size_t i = 0; i < triangles.size(); ++i)
      add_triangle({to[triangles[i][0]], to[triangles[i][1]], to[triangles[i][2]]}, faces[i]);
    char text[120];
    std::snprintf(text, sizeof text, " on an open edge merged with another at most %.2g m from it",
                  farthest);
    note(moved, (std::string("corner") + text).c_str(),
         (std::string("corners, each") + text).c_str());
    return true;
  }

  // Cuts open edges at corners of other edges that lie on them.
  void split_rims(const Unbalanced& found) {
    if (found.sides.size() > kMostRims) return;
    std::vector<std::pair<double, Index>> along_x;
    for (const Index v : rim_points(found)) along_x.emplace_back(points_[v].x, v);
    std::sort(along_x.begin(), along_x.end());
    const double within = kRimErrors * error_;
    std::vector<std::pair<Index, std::vector<Index>>> cut;  // triangle, its corners with new ones
    std::vector<SideGroups::Side> sides = found.sides;
    std::sort(sides.begin(), sides.end(),
              [](const auto& a, const auto& b) { return a.code < b.code; });
    std::size_t added = 0;
    for (std::size_t i = 0; i < sides.size();) {
      const Index t = sides[i].triangle();
      std::vector<Index> loop;
      const std::size_t before = added;
      for (Index k = 0; k < 3; ++k) {
        loop.push_back(triangles_[t][k]);
        if (i == sides.size() || sides[i].triangle() != t || sides[i].k() != k) continue;
        ++i;
        for (const Index v :
             between(triangles_[t][k], triangles_[t][(k + 1) % 3], along_x, within)) {
          loop.push_back(v);
          ++added;
        }
      }
      if (added > before) cut.emplace_back(t, std::move(loop));
    }
    if (added == 0) return;
    for (const auto& [t, loop] : cut) {
      std::vector<Vec3> corners;
      for (const Index v : loop) corners.push_back(points_[v]);
      const std::vector<Triangle> pieces = face_triangles(corners);
      for (std::size_t i = 0; i < pieces.size(); ++i) {
        const Triangle piece{loop[pieces[i][0]], loop[pieces[i][1]], loop[pieces[i][2]]};
        if (i == 0) {
          triangles_[t] = piece;
        } else {
          add_triangle(piece, face_[t]);
        }
      }
    }
    note(added, "edge cut at a corner of another face that lies on it",
         "edges cut at corners of other faces that lie on them");
  }

  // Corners on the way from a to b, in order.
  std::vector<Index> between(Index a, Index b, const std::vector<std::pair<double, Index>>& along_x,
                             double within) const {
    const Vec3 from = points_[a], way = points_[b] - from;
    const double length = glm::length(way);
    std::vector<std::pair<double, Index>> on;
    const double low = std::min(from.x, points_[b].x) - within;
    const double high = std::max(from.x, points_[b].x) + within;
    for (auto i = std::lower_bound(along_x.begin(), along_x.end(), std::pair(low, Index{0}));
         i != along_x.end() && i->first <= high; ++i) {
      const Vec3 apart = points_[i->second] - from;
      const double at = glm::dot(apart, way) / length;
      if (at <= within || at >= length - within) continue;
      if (glm::length(apart - way * (at / length)) <= within) on.emplace_back(at, i->second);
    }
    std::sort(on.begin(), on.end());
    std::vector<Index> corners;
    corners.reserve(on.size());
    for (const auto& [at, v] : on) corners.push_back(v);
    return corners;
  }

  void report_unbalanced() const {
    MeshFaults faults;
    std::size_t near = 0;
    SideGroups(points_.size(), triangles_).for_each_edge([&](const SideGroups::Edge& edge) {
      const std::size_t up = ups(edge);
      if (2 * up == edge.sides.size()) return;
      const auto name = [&] {
        return "edge " + label(edge.low) + "-" + label(edge.high) + " of " +
               name_of_face(soup_, face_[edge.sides[0].triangle()]);
      };
      if (edge.sides.size() == 1) {
        faults.add("open", [&] {
          return name() + " has no face on its other side; expected a closed surface" + kClose;
        });
      } else if (edge.sides.size() == 2) {
        faults.add("turned face", [&] {
          return name() + " runs the same way in " +
                 name_of_face(soup_, face_[edge.sides[1].triangle()]) +
                 "; expected opposite ways (all faces counter-clockwise seen from outside)" +
                 kClose;
        });
      } else {
        faults.add("shared edge", [&] {
          return name() + " belongs to " + std::to_string(edge.sides.size()) + " faces, and " +
                 std::to_string(up) + " of them run one way; expected as many both ways" + kClose;
        });
      }
    });
    const std::vector<Index> rim = rim_points(unbalanced());
    const double within = 1e-5 * size_;
    const std::vector<Index> kept = welded(rim, within);
    for (std::size_t i = 0; i < kept.size(); ++i) near += kept[i] != i ? 1 : 0;
    if (near > 0) {
      faults.add("crowded", [&] {
        char text[200];
        std::snprintf(text, sizeof text,
                      "%zu corners on open edges are nearer than %.1g m to another one: the edges "
                      "may be open only there; merge corners by distance in a modelling program",
                      near, within);
        return std::string(text);
      });
    }
    faults.throw_if_any();
  }

  ClosedSurface take_surface() {
    ClosedSurface surface;
    std::vector<Index> number(points_.size(), kNoPoint);
    surface.vertices.reserve(points_.size());
    for (Triangle& t : triangles_) {
      for (Index& v : t) {
        if (number[v] == kNoPoint) {
          number[v] = static_cast<Index>(surface.vertices.size());
          surface.vertices.push_back(points_[v]);
        }
        v = number[v];
      }
    }
    surface.triangles = std::move(triangles_);
    surface.across = std::move(across_);
    return surface;
  }

  const PolygonSoup& soup_;
  PolygonSoup* given_up_ = nullptr;  // the same, if it need not be kept
  const std::function<void(const ClosedSurface&)>* meanwhile_ = nullptr;
  MeshNaming naming_;
  std::vector<std::string> notes_;
  std::vector<Index> point_of_;  // of each vertex of the soup
  std::vector<Vec3> points_;
  std::vector<Index> vertex_;  // the soup's number of each point
  std::vector<Triangle> triangles_, across_;
  std::optional<SideGroups> sides_;  // of the triangles as they are now
  std::vector<Index> face_;          // the soup's number of each triangle's face
  std::vector<BentFace> bent_;
  std::size_t dropped_ = 0;
  double size_ = 0;   // m, diagonal of the bounding box
  double error_ = 0;  // m, of a coordinate
};

}  // namespace

CleanedSurface closed_surface(const PolygonSoup& soup) { return Cleaner(soup).run(); }

std::vector<std::string> cleaning_notes(const PolygonSoup& soup) { return Cleaner(soup).notes(); }

CleanedSurface closed_surface(PolygonSoup&& soup,
                              const std::function<void(const ClosedSurface&)>& meanwhile) {
  PolygonSoup own = std::move(soup);
  return Cleaner(own).run_while(own, meanwhile);
}

}  // namespace palpate::stimuli
