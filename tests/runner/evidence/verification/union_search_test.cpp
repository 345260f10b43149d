// The search over unions of convex parts finds no error in the renderer, and finds the errors of
// broken ones.

#include "runner/evidence/verification/union_search.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "runner/evidence/verification/search.h"
#include "runner/evidence/verification/union_walks.h"

namespace palpate::runner::evidence {
namespace {

std::string told(const UnionCounts& counts) {
  std::string text;
  for (const SearchFault& fault : counts.faults) {
    text += "seed " + std::to_string(fault.seed) + " walk " + std::to_string(fault.walk) +
            " tick " + std::to_string(fault.tick) + ": " + fault.what + "\n";
  }
  return text;
}

TEST(UnionSearch, FindsNothingWrong) {
  const UnionCounts counts = search_unions(1, 0, 60);
  EXPECT_EQ(counts.wrong(), 0u) << told(counts);
  EXPECT_GT(counts.ticks, 50 * kTicksPerWalk);
  // The search has covered the critical situations.
  EXPECT_GT(counts.in_contact, counts.ticks / 5);
  EXPECT_GT(counts.several, counts.ticks / 20);
  EXPECT_GT(counts.torques, counts.ticks / 20);
  EXPECT_LE(counts.worst_penetration, 1e-12);
  // Not wrong, but should be rare.
  EXPECT_LE(100 * counts.lagged, counts.in_contact);
  EXPECT_LE(1000 * counts.capped, counts.in_contact);
  EXPECT_LE(200 * counts.released, counts.in_contact);
  EXPECT_LE(50 * counts.elsewhere, counts.compared);
}

void expect_nothing_wrong(std::uint64_t seed, std::uint64_t walk) {
  const UnionCounts counts = search_union(rendering::ray_renderer(), seed, walk);
  EXPECT_EQ(counts.wrong(), 0u) << told(counts);
  EXPECT_LE(counts.worst_penetration, 1e-12);
}

TEST(UnionSearch, IdealToolsInNarrowWedgesAreExact) {
  // Two planes at 0.02 to 0.2 degrees from antiparallel hold the tool.
  expect_nothing_wrong(1, 6231);
  expect_nothing_wrong(1, 6301);
  expect_nothing_wrong(2, 2070);
  expect_nothing_wrong(2, 4597);
  expect_nothing_wrong(3, 1280);
  expect_nothing_wrong(3, 3507);
}

TEST(UnionSearch, PartsCloserThanTheSkinAreNotEntered) {
  // The tool rests a skin off the part that holds it; another part lies within the skin.
  expect_nothing_wrong(1401, 83);
  expect_nothing_wrong(1401, 4623);
  // A facet touched exactly is not in the way.
  EXPECT_EQ(search_union(rendering::ray_renderer(), 1, 60).capped, 0u);
}

TEST(UnionSearch, NarrowGapsAreNotEntered) {
  // In the first walk, turning closes a wedge between two parts to less than two skins; then the
  // tool moves along it. In the other, a slit of 0.17 skins has a second facet on one side, 0.05
  // skins higher.
  for (const std::uint64_t walk : {7208, 11395}) {
    const UnionCounts counts = search_union(rendering::ray_renderer(), 1407, walk);
    EXPECT_EQ(counts.wrong(), 0u) << told(counts);
    EXPECT_EQ(counts.capped, 0u);
  }
  // From free space the tool meets abutting parts without any room between them.
  expect_nothing_wrong(1407, 1026);
  EXPECT_EQ(search_union(rendering::ray_renderer(), 1408, 4350).capped, 0u);
}

TEST(UnionSearch, AGrooveThatEndsBeforeTheRestingToolIsClosed) {
  // Facets 0.02 degrees from antiparallel end 1e-7 m before the place where the tool would rest
  // without skin.
  const UnionCounts counts = search_union(rendering::ray_renderer(), 1407, 9371);
  EXPECT_EQ(counts.wrong(), 0u) << told(counts);
  EXPECT_EQ(counts.capped, 0u);
}

TEST(UnionSearch, ALaggingToolIsShownWithoutForceToo) {
  // The virtual tool has turned into a part; the ideal one, at the same tip, has not.
  expect_nothing_wrong(2, 2979);
  expect_nothing_wrong(3, 2904);
  expect_nothing_wrong(1, 2196);
  expect_nothing_wrong(3, 5836);
}

TEST(UnionSearch, NoToolTurnsIntoACrackBetweenPartsThatAbut) {
  // Two walls back to back: half of the turn towards their common plane, then half of the rest, and
  // so on.
  expect_nothing_wrong(1, 1836);
  expect_nothing_wrong(2, 2865);
  expect_nothing_wrong(3, 3401);
  expect_nothing_wrong(3, 3578);
  expect_nothing_wrong(3, 3921);
}

TEST(UnionSearch, AGapNarrowerThanTwoSkinsMayBeClosed) {
  // 3e-11 m between parts: facets at that distance hold the tool, which the strict definition does
  // not allow.
  std::uint64_t in_gap = 0;
  for (const auto& [seed, walk] : {std::pair{22, 7293}, {23, 17513}, {23, 19555}}) {
    const UnionCounts counts =
        search_union(rendering::ray_renderer(), static_cast<std::uint64_t>(seed),
                     static_cast<std::uint64_t>(walk));
    EXPECT_EQ(counts.wrong(), 0u) << told(counts);
    in_gap += counts.in_gap;
  }
  EXPECT_GT(in_gap, 0u);
}

TEST(UnionSearch, AGrooveTooNarrowToMeasureClampsWithoutLeverage) {
  // A segment over one part and under another, 1e-8 off their common plane: two facets hold it
  // against each other with 1e6 times the push. Force is that of the displacement.
  expect_nothing_wrong(24, 14891);
  expect_nothing_wrong(26, 7812);
}

TEST(UnionSearch, AFacetLeftByLessThanTheSkinIsLeft) {
  // The virtual tool passes an edge of a facet exactly, except for the lag of the ideal one.
  expect_nothing_wrong(1, 1325);
  expect_nothing_wrong(1, 4253);
  expect_nothing_wrong(3, 37);
  expect_nothing_wrong(3, 2824);
}

TEST(UnionSearch, FacetsHoldAToolOnACorner) {
  // Another segment's facet at that corner is nearly parallel.
  expect_nothing_wrong(1, 3071);
}

TEST(UnionSearch, BorderContactsAreOnTheFace) {
  expect_nothing_wrong(1, 276);
  expect_nothing_wrong(1, 5394);
  expect_nothing_wrong(1, 5500);
  expect_nothing_wrong(2, 1092);
  expect_nothing_wrong(2, 4948);
  expect_nothing_wrong(3, 3281);
}

TEST(UnionSearch, AReleasedToolComesBackOutside) { expect_nothing_wrong(1, 4418); }

TEST(UnionSearch, DoesNotDependOnTheDivisionOfWalks) {
  const UnionCounts whole = search_unions(7, 0, 9);
  UnionCounts shared = search_unions(7, 0, 4);
  shared += search_unions(7, 4, 5);
  EXPECT_EQ(shared.in_contact, whole.in_contact);
  EXPECT_EQ(shared.compared, whole.compared);
  EXPECT_EQ(shared.worst_penetration, whole.worst_penetration);
  EXPECT_NE(search_unions(8, 0, 9).in_contact, whole.in_contact);
}

TEST(UnionSearch, CountsNothingWithoutWalks) {
  const UnionCounts none = search_unions(7, 0, 0);
  for (const std::uint64_t count :
       {none.walks, none.ticks, none.in_contact, none.several, none.inside, none.not_minimal,
        none.wrong_force, none.wrong_torque, none.off_place, none.not_finite, none.faulted,
        none.lagged, none.capped, none.released, none.on_edge, none.in_gap, none.torques,
        none.compared, none.elsewhere})
    EXPECT_EQ(count, 0U);
  EXPECT_EQ(none.worst_penetration, 0);
  EXPECT_EQ(none.worst_descent, 0);
}

TEST(UnionSearch, DrawsAllKindsOfWalks) {
  std::set<std::size_t> parts, segments;
  int still = 0;
  double slowest = 1, fastest = 0;
  for (std::uint64_t walk = 0; walk < 100; ++walk) {
    const UnionWalk drawn = random_union_walk(5, walk, kTicksPerWalk);
    parts.insert(drawn.parts.size());
    segments.insert(drawn.tool.size());
    ASSERT_LE(drawn.path.size(), kTicksPerWalk);
    ASSERT_GE(drawn.path.size(), 200u);
    EXPECT_LT(UnionOracle(drawn.parts, drawn.tool).depth(drawn.path[0]), 0) << walk;
    bool turns = false;
    double longest = 0;
    for (std::size_t i = 2; i < drawn.path.size(); ++i) {
      turns |= drawn.path[i].axes != drawn.path[1].axes;
      longest = std::max(longest, glm::length(drawn.path[i].tip - drawn.path[i - 1].tip));
    }
    still += !turns;
    if (!turns) continue;
    slowest = std::min(slowest, longest);
    fastest = std::max(fastest, longest);
  }
  EXPECT_EQ(parts, (std::set<std::size_t>{2, 3, 4, 5, 6, 7, 8}));
  EXPECT_EQ(segments, (std::set<std::size_t>{1, 2, 3}));
  EXPECT_GT(still, 5);  // along the axes
  EXPECT_LT(slowest, 2e-4);
  EXPECT_GT(fastest, 4e-3);
}

/// A renderer with errors in contact.
class Broken final : public rendering::Renderer {
 public:
  enum class How { sunk, floating, weak, twisted, aside, infinite, apart };
  explicit Broken(How how) : how_(how) {}

  const char* name() const override { return "broken"; }
  bool side_contact() const override { return true; }
  rendering::Rendering tick(const rendering::Scene& scene, rendering::RenderState& state,
                            const rendering::LineProbe& probe, double dt) const noexcept override {
    rendering::Rendering r = rendering::ray_renderer().tick(scene, state, probe, dt);
    if (r.contacts == 0) return r;
    switch (how_) {
      case How::sunk:
        move(r, -1e-10);
        break;
      case How::floating:
        move(r, 1e-9);  // more than the skin
        break;
      case How::weak:
        r.force *= 1 - 1e-7;
        break;
      case How::twisted:
        r.torque += 1e-3 * glm::length(r.force) * Vec3(0, 0, 1);
        break;
      case How::aside:
        r.deepest.point += Vec3(0, 0, 1e-6);
        break;
      case How::infinite:
        r.torque.y = std::numeric_limits<double>::infinity();
        break;
      case How::apart:
        r.device1 *= 0.999;
        break;
    }
    return r;
  }

 private:
  static void move(rendering::Rendering& r, double out) {
    r.ideal.tip += out * r.deepest.normal;
    r.ideal.tail += out * r.deepest.normal;
  }

  How how_;
};

UnionCounts search_with(Broken::How how) {
  const Broken broken(how);
  UnionCounts counts;
  for (std::uint64_t walk = 0; walk < 9; ++walk) counts += search_union(broken, 3, walk);
  return counts;
}

TEST(UnionSearch, FindsIdealToolsThatPenetrate) {
  EXPECT_GT(search_with(Broken::How::sunk).inside, 100u);
}

TEST(UnionSearch, FindsIdealToolsThatFloat) {
  EXPECT_GT(search_with(Broken::How::floating).not_minimal, 100u);
}

TEST(UnionSearch, FindsWrongForces) {
  EXPECT_GT(search_with(Broken::How::weak).wrong_force, 100u);
  EXPECT_GT(search_with(Broken::How::apart).wrong_force, 100u);
}

TEST(UnionSearch, FindsWrongTorques) {
  EXPECT_GT(search_with(Broken::How::twisted).wrong_torque, 100u);
}

TEST(UnionSearch, FindsContactsOffTheirPlace) {
  EXPECT_GT(search_with(Broken::How::aside).off_place, 100u);
}

TEST(UnionSearch, SaysWhereToLook) {
  const Broken broken(Broken::How::weak);
  std::uint64_t walk = 4;
  UnionCounts counts = search_union(broken, 3, walk);
  while (counts.faults.empty()) counts = search_union(broken, 3, ++walk);
  const SearchFault& fault = counts.faults.front();
  EXPECT_EQ(fault.seed, 3u);
  EXPECT_EQ(fault.walk, walk);
  EXPECT_LT(fault.tick, counts.ticks);
  // The walk shortened to end before that tick has no error; including it, the same one.
  UnionWalk drawn = random_union_walk(3, walk, kTicksPerWalk);
  drawn.path.resize(fault.tick);
  EXPECT_EQ(search_union(broken, drawn).wrong(), 0u);
  drawn = random_union_walk(3, walk, kTicksPerWalk);
  drawn.path.resize(fault.tick + 1);
  const UnionCounts again = search_union(broken, drawn, 8, 9);
  ASSERT_EQ(again.faults.size(), 1u);
  EXPECT_EQ(again.faults[0].what, fault.what);
  EXPECT_EQ(again.faults[0].seed, 8u);
  EXPECT_EQ(again.faults[0].walk, 9u);
}

TEST(UnionSearch, FindsNonFiniteResults) {
  EXPECT_GT(search_with(Broken::How::infinite).not_finite, 3u);
}

}  // namespace
}  // namespace palpate::runner::evidence
