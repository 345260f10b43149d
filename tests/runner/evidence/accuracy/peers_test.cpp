// The adaptors of other libraries against the reference: a wrongly connected peer would make our
// results look better than they are.

#include "runner/evidence/accuracy/peers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>

#include "runner/evidence/verification/reference.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"
#include "tests/shared/probe_paths.h"

namespace palpate::runner::evidence {
namespace {

using testing::probe_at;
using testing::random_direction;
using testing::uniform;

struct Tally {
  int answers = 0, silent = 0, wrong = 0;
  void expect_nearly_all_right(const std::string& what) const {
    EXPECT_GT(answers, 100) << what;
    // They sometimes give up or fail, mostly at a bare touch.
    EXPECT_LE(silent + wrong, answers / 50)
        << what << ": " << silent << " silent, " << wrong << " wrong of " << answers;
  }
};

/// One answer against the reference; all three parts of it.
bool right(const stimuli::ConvexMesh& mesh, const rendering::LineProbe& probe,
           const PeerContact& answer, const ReferenceDepth& reference) {
  const double tolerance = 1e-9 * mesh.size();
  if (reference.depth <= 0) {
    return std::abs(-answer.depth - reference_gap(mesh, probe)) <= tolerance;
  }
  if (!(std::abs(answer.depth - reference.depth) <= tolerance)) return false;
  if (std::abs(glm::length(answer.normal) - 1) > 1e-9) return false;
  // Its normal leads the probe out, by either of two equal ways.
  const rendering::LineProbe out = testing::moved(probe, answer.depth * answer.normal);
  if (reference_depth(mesh, out).depth > tolerance) return false;
  // Its point is on the mesh and on the probe once moved out.
  if (std::abs(reference_depth(mesh, {answer.point, answer.point}).depth) > tolerance) return false;
  const Vec3 d = out.tail - out.tip;
  const double length = glm::length(d);
  const Vec3 u = length > 0 ? d / length : Vec3();
  const double along = std::clamp(glm::dot(answer.point - out.tip, u), 0.0, length);
  return glm::length(out.tip + along * u - answer.point) <= tolerance;
}

void check(const PeerLibrary& library, const stimuli::ConvexMesh& mesh, const std::string& shape) {
  const auto peer = library.make(mesh);
  constexpr std::uint64_t kSeed = 7;
  Random random(kSeed);
  Tally inside, outside;
  for (int i = 0; i < 500; ++i) {
    const Vec3 at =
        mesh.centre() + uniform(random, 0, 1.5) * mesh.radius() * random_direction(random);
    const double length = i % 3 == 0 ? 0 : 4 * mesh.radius();
    const rendering::LineProbe probe =
        probe_at(at, random_direction(random), length, random.unit());
    const ReferenceDepth reference = reference_depth(mesh, probe);
    const PeerContact answer = peer->contact(probe);
    Tally& tally = reference.depth > 0 ? inside : outside;
    ++tally.answers;
    if (!std::isfinite(answer.depth)) {
      ++tally.silent;
    } else if (!right(mesh, probe, answer, reference)) {
      ++tally.wrong;
    }
  }
  inside.expect_nearly_all_right(std::string(library.name) + ", inside a " + shape);
  outside.expect_nearly_all_right(std::string(library.name) + ", outside a " + shape);
}

TEST(Peers, AgreeWithTheReference) {
  for (const PeerLibrary& library : peer_libraries()) {
    if (!library.make) continue;
    check(library, stimuli::ConvexMesh(stimuli::cube(0.06)), "cube");
    check(library, stimuli::ConvexMesh(stimuli::icosphere(0.03, 2)), "sphere");
    check(library, stimuli::ConvexMesh(stimuli::cone(0.03, 0.06, 32)), "cone");
    check(library, stimuli::ConvexMesh(stimuli::cylinder(0.03, 0.06, 32)), "cylinder");
    // Far from the origin and small: their tolerances are absolute, ours must not be.
    stimuli::PolygonSoup soup = stimuli::cone(3e-4, 6e-4, 16);
    for (Vec3& v : soup.vertices) v += Vec3(1, 2, 3) * 1e-3;
    check(library, stimuli::ConvexMesh(soup), "small cone");
  }
}

TEST(Peers, AreNamedWhetherBuiltOrNot) {
  const auto libraries = peer_libraries();
  ASSERT_EQ(libraries.size(), 2u);
  for (const PeerLibrary& library : libraries) {
    EXPECT_NE(std::string(library.name), "");
    EXPECT_EQ(library.make != nullptr, std::string(library.version) != "") << library.name;
  }
}

}  // namespace
}  // namespace palpate::runner::evidence
