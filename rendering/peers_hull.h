#pragma once
// What the adaptors of the libraries share: mesh and probe in the libraries' units. Included by
// peers_*.cpp alone.

#include <cstdint>
#include <glm/geometric.hpp>
#include <memory>
#include <vector>

#include "rendering/peers.h"
#include "rendering/separation.h"

namespace palpate::peers {

/// Mesh frame to coordinates in which the object has radius 1 about the origin.
struct Scale {
  explicit Scale(const ConvexMesh& mesh) : centre(mesh.centre()), radius(mesh.radius()) {}
  Vec3 to_unit(const Vec3& p) const { return (p - centre) / radius; }
  Vec3 from_unit(const Vec3& p) const { return centre + radius * p; }

  Vec3 centre;
  double radius;
};

/// The mesh as a support function: climbs from a table of starts over the directions (the faces of
/// a cube, kCells x kCells each), so that a direction asked twice gets the same vertex twice, ties
/// included: Bullet asks again for its witness points.
class Hull {
 public:
  explicit Hull(const ConvexMesh& mesh);
  const Scale& scale() const { return scale_; }
  Vec3 support(const Vec3& direction) const {
    const std::uint32_t vertex = support_vertex(mesh_, direction, start_[cell_of(direction)]);
    return scale_.to_unit(mesh_.vertices()[vertex]);
  }

 private:
  static constexpr int kCells = 32;
  static std::size_t cell_of(const Vec3& direction);

  const ConvexMesh& mesh_;
  Scale scale_;
  std::vector<std::uint32_t> start_;
};

struct Segment {
  Vec3 tip, tail;
  Vec3 support(const Vec3& direction) const {
    return glm::dot(direction, tail - tip) > 0 ? tail : tip;
  }
};

std::unique_ptr<Peer> make_bullet(const ConvexMesh& mesh);
std::unique_ptr<Peer> make_fcl(const ConvexMesh& mesh);

}  // namespace palpate::peers
