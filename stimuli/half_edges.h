#pragma once
// A polygon soup as a linked surface: welded corners, and for every side of a face its twin in the
// neighbouring face. The first step of building a ConvexMesh.

#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "stimuli/mesh_names.h"
#include "stimuli/polygon_soup.h"

namespace palpate::stimuli {

/// Half-edge h runs from corner origin[h] to origin[next(h)], counter-clockwise round face[h].
struct HalfEdges {
  using Index = std::uint32_t;
  static constexpr Index kNone = 0xffffffff;

  std::vector<Vec3> points;        ///< m, welded
  std::vector<Index> soup_vertex;  ///< the soup's number of each point
  std::vector<Index> soup_face;    ///< the soup's number of each face
  std::vector<Index> first;        ///< face f has the half-edges first[f] .. first[f + 1]
  std::vector<Index> origin, face, twin;
  std::vector<Index> corner;  ///< the soup's vertex that each half-edge runs from
  MeshNaming naming;
  double size = 0;   ///< m, diagonal of the bounding box
  double error = 0;  ///< m, of each coordinate

  Index face_count() const { return static_cast<Index>(soup_face.size()); }
  Index count() const { return static_cast<Index>(origin.size()); }
  Index next(Index h) const { return h + 1 == first[face[h] + 1] ? first[face[h]] : h + 1; }
  Index previous(Index h) const { return h == first[face[h]] ? first[face[h] + 1] - 1 : h - 1; }
  const Vec3& from(Index h) const { return points[origin[h]]; }
  const Vec3& to(Index h) const { return points[origin[next(h)]]; }

  std::string name_face(Index f) const;    ///< "face 3 at line 20 (vertices 1 2 5)"
  std::string name_vertex(Index v) const;  ///< "vertex 5 at line 12"
  std::string name_edge(Index h) const;    ///< "edge 4-5 of face 3 ..."
};

/// The name of a face of a soup in messages; the soup need not be linked.
std::string name_of_face(const PolygonSoup& soup, std::size_t face);

/// \throws MeshError where indices or coordinates are unusable: no faces, not finite, too large.
void check_numbers(const PolygonSoup& soup);

enum class Pieces { one, any };

/// Welds, drops faces that welding has collapsed (their two sides cancel, so the surface stays
/// closed) and links twins. Reports open edges, edges of three faces, faces turned against their
/// neighbours, separate pieces where one is expected. \throws MeshError at once where indices or
/// coordinates are unusable.
HalfEdges link_half_edges(const PolygonSoup& soup, MeshFaults& faults, Pieces pieces = Pieces::one);

/// A hash table from pairs of indices to an index, in two flat arrays: a mesh of a million
/// triangles has two million edges, and a node for each would cost more than the rest of its
/// construction. Open addressing with linear probing; keys are unordered pairs. Grows by itself.
class PairMap {
 public:
  static constexpr std::uint32_t kNone = 0xffffffff;

  /// `expected`: how many pairs will be kept (a guess; it only saves time).
  explicit PairMap(std::size_t expected) { resize(std::bit_ceil(2 * expected + 16)); }

  /// The value kept for {a, b}; kNone for a new pair. a and b must not both be kNone.
  std::uint32_t& operator()(std::uint32_t a, std::uint32_t b) {
    if (2 * count_ >= slots_.size()) grow();
    Slot& slot = find(key_of(a, b));
    if (slot.key == kEmpty) {
      slot.key = key_of(a, b);
      ++count_;
    }
    return slot.value;
  }

 private:
  static constexpr std::uint64_t kEmpty = ~std::uint64_t{0};
  struct Slot {
    std::uint64_t key = kEmpty;
    std::uint32_t value = kNone;
  };

  static std::uint64_t key_of(std::uint32_t a, std::uint32_t b) {
    const std::uint64_t low = a < b ? a : b, high = a < b ? b : a;
    return high << 32U | low;
  }

  Slot& find(std::uint64_t key) {
    std::uint64_t hash = (key ^ key >> 32U) * 0x9e3779b97f4a7c15U;
    hash = (hash ^ hash >> 29U) * 0xbf58476d1ce4e5b9U;
    std::size_t at = hash >> shift_;
    while (slots_[at].key != key && slots_[at].key != kEmpty) {
      at = at + 1 == slots_.size() ? 0 : at + 1;
    }
    return slots_[at];
  }

  void resize(std::size_t size) {
    slots_.assign(size, Slot{});
    shift_ = 64U - static_cast<unsigned>(std::countr_zero(size));
  }

  void grow() {
    std::vector<Slot> old(std::move(slots_));
    resize(2 * old.size());
    for (const Slot& slot : old) {
      if (slot.key != kEmpty) find(slot.key) = slot;
    }
  }

  std::vector<Slot> slots_;
  std::size_t count_ = 0;
  unsigned shift_ = 0;
};

}  // namespace palpate::stimuli
