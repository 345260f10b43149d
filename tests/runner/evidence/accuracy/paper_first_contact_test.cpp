#include "runner/evidence/accuracy/paper_first_contact.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "stimuli/convex_mesh.h"
#include "stimuli/primitives.h"

namespace palpate::runner::evidence {
namespace {

/// The edge of a 2 m cube from (1, -1, 1) to (1, 1, 1).
std::uint32_t top_edge(const stimuli::ConvexMesh& mesh) {
  for (std::uint32_t i = 0; i < mesh.edges().size(); ++i) {
    const Vec3 middle =
        0.5 * (mesh.vertices()[mesh.edges()[i].v0] + mesh.vertices()[mesh.edges()[i].v1]);
    if (glm::length(middle - Vec3(1, 0, 1)) < 1e-12) return i;
  }
  ADD_FAILURE() << "no such edge";
  return 0;
}

/// A stylus at right angles to that edge, leaning on it from outside by `height` m.
rendering::LineProbe over_edge(double height, double along = 0) {
  const Vec3 middle = Vec3(1, along, 1) + height / std::sqrt(2) * Vec3(1, 0, 1);
  return {middle - Vec3(1, 0, -1), middle + Vec3(1, 0, -1)};
}

TEST(PaperFirstContact, AnEdgeIsCrossedByASmallMotion) {
  const stimuli::ConvexMesh mesh(stimuli::cube(2));
  const std::uint32_t edge = top_edge(mesh);
  EXPECT_TRUE(crosses_edge(mesh, edge, over_edge(0.001), over_edge(-0.001)));
  EXPECT_TRUE(crosses_edge(mesh, edge, over_edge(0.001, 0.1), over_edge(-0.001, 0.2)));
  EXPECT_FALSE(crosses_edge(mesh, edge, over_edge(0.002), over_edge(0.001)));
  // Past the edge's end: appendix 8 (2).
  EXPECT_FALSE(crosses_edge(mesh, edge, over_edge(0.001, 1.1), over_edge(-0.001, 1.1)));
  // It misses a crossing that begins past the edge's end, although the path crosses the edge.
  EXPECT_FALSE(crosses_edge(mesh, edge, over_edge(0.001, 1.001), over_edge(-0.1, 0.9)));
}

TEST(PaperFirstContact, APolygonIsCrossedByAPoint) {
  const stimuli::ConvexMesh mesh(stimuli::cube(2));
  int crossed = 0, beside = 0;
  for (std::uint32_t i = 0; i < mesh.facets().size(); ++i) {
    crossed += crosses_polygon(mesh, i, Vec3(0.3, 0.2, 1.1), Vec3(0.3, 0.2, 0.9)) ? 1 : 0;
    beside += crosses_polygon(mesh, i, Vec3(1.3, 0.2, 1.1), Vec3(1.3, 0.2, 0.9)) ? 1 : 0;
  }
  EXPECT_EQ(crossed, 1);
  EXPECT_EQ(beside, 0);
  EXPECT_TRUE(paper_first_contact(mesh, {Vec3(0, 0, 1.1), Vec3(0, 0, 2)},
                                  {Vec3(0, 0, 0.9), Vec3(0, 0, 2)}));
  EXPECT_FALSE(paper_first_contact(mesh, {Vec3(0, 0, 1.2), Vec3(0, 0, 2)},
                                   {Vec3(0, 0, 1.1), Vec3(0, 0, 2)}));
}

TEST(PaperFirstContact, LosesContactsOfFastHands) {
  const stimuli::ConvexMesh mesh(stimuli::cylinder(0.03, 0.06, 64));
  const FirstContactLoss slow = first_contact_loss(mesh, 0.1, 0, 300, 1);
  EXPECT_EQ(slow.entries, 300);
  EXPECT_LE(slow.paper_missed, 10);
  const FirstContactLoss fast = first_contact_loss(mesh, 5, 0, 300, 1);
  EXPECT_GE(fast.paper_missed, 20);
  EXPECT_GE(fast.paper_missed, 3 * slow.paper_missed);
  for (const FirstContactLoss& loss : {slow, fast}) {
    EXPECT_EQ(loss.exact_missed, 0);
    EXPECT_LE(loss.paper_never, loss.paper_missed);
    EXPECT_EQ(loss.paper_early, 0);
  }
}

}  // namespace
}  // namespace palpate::runner::evidence
