#include "runner/evidence/accuracy/peers.h"

#include <array>

#include "runner/evidence/accuracy/peers_hull.h"

namespace palpate::runner::evidence {
namespace {

#ifdef PALPATE_BULLET_VERSION
constexpr const char* kBulletVersion = PALPATE_BULLET_VERSION;
constexpr MakePeer kMakeBullet = peers::make_bullet;
constexpr MakeMeshPeer kMakeBulletMesh = peers::make_bullet_mesh;
#else
constexpr const char* kBulletVersion = "";
constexpr MakePeer kMakeBullet = nullptr;
constexpr MakeMeshPeer kMakeBulletMesh = nullptr;
#endif

#ifdef PALPATE_FCL_VERSION
constexpr const char* kFclVersion = PALPATE_FCL_VERSION;
constexpr MakePeer kMakeFcl = peers::make_fcl;
constexpr MakeMeshPeer kMakeFclMesh = peers::make_fcl_mesh;
#else
constexpr const char* kFclVersion = "";
constexpr MakePeer kMakeFcl = nullptr;
constexpr MakeMeshPeer kMakeFclMesh = nullptr;
#endif

}  // namespace

std::span<const PeerLibrary> peer_libraries() {
  static constexpr std::array kLibraries = {
      PeerLibrary{"bullet", kBulletVersion, "btGjkEpaSolver2, double precision, margin 0",
                  kMakeBullet, "thin capsule against btBvhTriangleMeshShape, deepest contact",
                  kMakeBulletMesh},
      PeerLibrary{"fcl", kFclVersion, "signed distance (GJK, EPA), double precision", kMakeFcl,
                  "thin capsule against BVHModel<OBBRSS>, deepest contact", kMakeFclMesh}};
  return kLibraries;
}

}  // namespace palpate::runner::evidence
