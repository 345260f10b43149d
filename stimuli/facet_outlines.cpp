#include "stimuli/facet_outlines.h"

#include <string>
#include <utility>
#include <vector>

namespace palpate::stimuli {
namespace {

using Index = HalfEdges::Index;

class Outliner {
 public:
  Outliner(const HalfEdges& mesh, const std::vector<Index>& region_of, Index region_count)
      : mesh_(mesh),
        region_of_(region_of),
        borders_at_(mesh.points.size(), 0),
        border_length_(region_count, 0),
        begin_(region_count, HalfEdges::kNone),
        side_at_(mesh.count(), HalfEdges::kNone) {
    for (Index h = 0; h < mesh.count(); ++h) {
      if (!is_border(h)) continue;
      ++borders_at_[mesh.origin[h]];
      ++border_length_[region_of[mesh.face[h]]];
    }
    for (Index h = mesh.count(); h-- > 0;) {
      if (is_border(h) && is_corner(mesh.origin[h])) begin_[region_of[mesh.face[h]]] = h;
    }
  }

  FacetOutlines outlines(MeshFaults& faults) {
    for (Index region = 0; region < begin_.size(); ++region) trace(region, faults);
    outlines_.first.push_back(outlines_.side_count());
    if (!faults.empty()) return std::move(outlines_);
    for (const Index last : last_) outlines_.opposite.push_back(side_at_[mesh_.twin[last]]);
    return std::move(outlines_);
  }

 private:
  bool is_border(Index h) const {
    return region_of_[mesh_.face[h]] != region_of_[mesh_.face[mesh_.twin[h]]];
  }

  // Between two regions only, a vertex lies within a straight edge.
  bool is_corner(Index vertex) const { return borders_at_[vertex] >= 3; }

  Index next_border(Index h) const {
    h = mesh_.next(h);
    while (!is_border(h)) h = mesh_.next(mesh_.twin[h]);
    return h;
  }

  void trace(Index region, MeshFaults& faults) {
    outlines_.first.push_back(outlines_.side_count());
    const Index begin = begin_[region];
    Index walked = 0;
    if (begin != HalfEdges::kNone) {
      Index h = begin;
      do {
        if (is_corner(mesh_.origin[h])) {
          side_at_[h] = outlines_.side_count();
          outlines_.start.push_back(h);
          outlines_.region.push_back(region);
          last_.push_back(h);
        } else {
          last_.back() = h;
        }
        ++walked;
        h = next_border(h);
      } while (h != begin);
    }
    if (outlines_.side_count() - outlines_.first.back() < 3) {
      faults.add("no polygon", [&] {
        return name(region) +
               ": expected a facet with at least three corners (is the object flat?)";
      });
    } else if (walked != border_length_[region]) {
      faults.add("hole", [&] {
        return name(region) + ": expected a facet with one outline, found one with holes";
      });
    }
  }

  std::string name(Index region) const {
    for (Index f = 0; f < mesh_.face_count(); ++f) {
      if (region_of_[f] == region) return mesh_.name_face(f);
    }
    return "facet";
  }

  const HalfEdges& mesh_;
  const std::vector<Index>& region_of_;
  std::vector<Index> borders_at_;     // of each vertex
  std::vector<Index> border_length_;  // of each region, in half-edges
  std::vector<Index> begin_;          // of each region, a border half-edge at a corner
  std::vector<Index> side_at_;        // of each half-edge that begins a side
  std::vector<Index> last_;           // of each side, its last half-edge
  FacetOutlines outlines_;
};

}  // namespace

FacetOutlines facet_outlines(const HalfEdges& mesh, const std::vector<Index>& region_of,
                             Index region_count, MeshFaults& faults) {
  return Outliner(mesh, region_of, region_count).outlines(faults);
}

}  // namespace palpate::stimuli
