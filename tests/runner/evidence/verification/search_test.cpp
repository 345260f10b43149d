// The randomised search for wrong ticks finds none in the renderers, and finds those of broken
// ones.

#include "runner/evidence/verification/search.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "runner/evidence/verification/random_solids.h"
#include "stimuli/convex_mesh.h"

namespace palpate::runner::evidence {
namespace {

/// From walk 0 on.
SearchCounts search_ticks(std::uint64_t ticks, std::uint64_t seed) {
  return search_walks(seed, 0, ticks / kTicksPerWalk);
}

std::string told(const SearchCounts& counts) {
  std::string text;
  for (const SearchFault& fault : counts.faults) {
    text += "seed " + std::to_string(fault.seed) + " walk " + std::to_string(fault.walk) +
            " tick " + std::to_string(fault.tick) + ": " + fault.what + "\n";
  }
  return text;
}

// Near edges almost parallel to the probe, rounding once turned a passing motion into an entry, or
// into an entry through a facet that the probe was already below.
TEST(Search, FindsNoErrorInFormerlyWrongWalks) {
  struct Place {
    std::uint64_t seed, walk;
  };
  for (const auto [seed, walk] :
       {Place{1, 11098}, Place{1, 15326}, Place{77, 9231}, Place{77, 14631}}) {
    const SearchCounts counts = search_walks(seed, walk, 1);
    EXPECT_EQ(counts.wrong(), 0u) << told(counts);
    EXPECT_GT(counts.in_contact, 0u);
  }
}

TEST(Search, FindsNothingWrong) {
  const SearchCounts counts = search_ticks(100'000, 1);
  EXPECT_EQ(counts.wrong(), 0u) << told(counts);
  EXPECT_EQ(counts.ticks, 100'000u);
  // The search has covered the critical situations.
  EXPECT_GT(counts.in_contact, 30'000u);
  EXPECT_GT(counts.entries, 3'000u);
  EXPECT_GT(counts.walked_finely, 5'000u);
  EXPECT_GT(counts.passages, 500u);
  EXPECT_LT(counts.worst_penetration, 1e-9);
  EXPECT_LT(counts.fallbacks, 100u);
}

TEST(Search, DoesNotDependOnTheDivisionOfWalks) {
  const SearchCounts whole = search_ticks(20'000, 7);
  SearchCounts shared = search_walks(7, 0, 13);
  shared += search_walks(7, 13, 20'000 / kTicksPerWalk - 13);
  EXPECT_EQ(shared.in_contact, whole.in_contact);
  EXPECT_EQ(shared.entries, whole.entries);
  EXPECT_EQ(shared.passages, whole.passages);
  EXPECT_EQ(shared.worst_penetration, whole.worst_penetration);
  EXPECT_NE(search_ticks(20'000, 8).in_contact, whole.in_contact);
}

TEST(Search, CountsAddUpFieldByField) {
  const auto counters = [](SearchCounts& c) {
    return std::array{&c.walks,      &c.ticks,           &c.in_contact,     &c.entries,
                      &c.missed,     &c.phantom,         &c.walked_finely,  &c.passages,
                      &c.shallow,    &c.floating,        &c.passed_through, &c.penetrating,
                      &c.not_finite, &c.endless,         &c.wrong_force,    &c.faulted,
                      &c.fallbacks,  &c.turned_elsewhere};
  };
  SearchCounts one, other;
  for (const std::uint64_t* const count : counters(one)) EXPECT_EQ(*count, 0U);
  for (std::size_t i = 0; i < counters(one).size(); ++i) {
    *counters(one)[i] = i + 1;
    *counters(other)[i] = 1000 * (i + 1);
  }
  one.worst_penetration = 3e-12;
  other.worst_penetration = 2e-12;
  one.faults.resize(7);
  other.faults.resize(7);
  other.faults[2].tick = 99;
  one += other;
  for (std::size_t i = 0; i < counters(one).size(); ++i)
    EXPECT_EQ(*counters(one)[i], 1001 * (i + 1)) << i;
  EXPECT_EQ(one.worst_penetration, 3e-12);
  ASSERT_EQ(one.faults.size(), SearchCounts::kFaultsKept);
  EXPECT_EQ(one.faults[9].tick, 99U);
  EXPECT_EQ(one.wrong(), one.missed + one.passed_through + one.phantom + one.penetrating +
                             one.floating + one.shallow + one.wrong_force + one.not_finite +
                             one.endless + one.faulted);
}

/// A renderer with occasional errors.
class Broken final : public rendering::Renderer {
 public:
  enum class How { missing, sunk, floating, infinite, weak, endless, blind_to_motion, phantom };
  explicit Broken(How how) : how_(how) {}

  const char* name() const override { return "broken"; }
  bool side_contact() const override { return true; }
  rendering::Rendering tick(const rendering::Scene& scene, rendering::RenderState& state,
                            const rendering::LineProbe& probe, double dt) const noexcept override {
    // Sees the pose, but not the motion to it.
    if (how_ == How::blind_to_motion && state.has_last) state.last = probe;
    rendering::Rendering r = rendering::ray_renderer().tick(scene, state, probe, dt);
    const double size = scene.parts()[0].mesh->size();
    if (how_ == How::phantom && r.contacts == 0 && unlucky(probe)) {
      r.contacts = 1;
      r.object = 0;
      r.deepest.normal = Vec3(1, 0, 0);
      r.deepest.depth = 1e-3 * size;
      r.deepest.point = r.ideal.tip += 1e-3 * size * r.deepest.normal;
      r.force = r.device1 = 800 * r.deepest.depth * r.deepest.normal;
    }
    if (r.contacts == 0 || !unlucky(probe)) return r;
    switch (how_) {
      case How::missing:
        r = rendering::Rendering{};
        r.ideal = probe;
        break;
      case How::sunk:
        move(r, -3e-9 * size);
        break;
      case How::floating:
        move(r, 2e-8 * (size + glm::length(probe.tail - probe.tip)));
        break;
      case How::infinite:
        r.torque.y = std::numeric_limits<double>::infinity();
        break;
      case How::weak:
        r.force *= 1 - 1e-8;
        break;
      case How::endless:
        r.faults |= rendering::render_fault::kWalkCapped;
        break;
      case How::blind_to_motion:
      case How::phantom:
        break;
    }
    return r;
  }

 private:
  /// One tick in some fifty, by its pose alone.
  static bool unlucky(const rendering::LineProbe& probe) {
    const double x = std::abs(probe.tip.x);
    return x > 0 && std::fmod(std::floor(x / 1e-17 * 0.37), 53) == 0;
  }
  static void move(rendering::Rendering& r, double out) {
    r.ideal.tip += out * r.deepest.normal;
    r.ideal.tail += out * r.deepest.normal;
  }

  How how_;
};

SearchCounts search_with(Broken::How how) {
  const Broken broken(how);
  SearchCounts counts;
  for (std::uint64_t walk = 0; walk < 60; ++walk) counts += search_walk(broken, 3, walk);
  return counts;
}

TEST(Search, FindsMissedContacts) { EXPECT_GT(search_with(Broken::How::missing).missed, 50u); }

TEST(Search, FindsIdealProbesThatPenetrate) {
  EXPECT_GT(search_with(Broken::How::sunk).penetrating, 20u);
}

TEST(Search, FindsIdealProbesThatFloat) {
  EXPECT_GT(search_with(Broken::How::floating).floating, 20u);
}

TEST(Search, FindsNonFiniteResults) {
  EXPECT_GT(search_with(Broken::How::infinite).not_finite, 50u);
}

TEST(Search, FindsWrongForces) { EXPECT_GT(search_with(Broken::How::weak).wrong_force, 50u); }

TEST(Search, FindsWalksWithoutEnd) { EXPECT_GT(search_with(Broken::How::endless).endless, 50u); }

TEST(Search, FindsPlatesThatAreCrossed) {
  EXPECT_GT(search_with(Broken::How::blind_to_motion).passed_through, 20u);
}

TEST(Search, FindsPhantomContacts) { EXPECT_GT(search_with(Broken::How::phantom).phantom, 20u); }

TEST(Search, SaysWhereToLook) {
  const Broken broken(Broken::How::missing);
  SearchCounts counts;
  for (std::uint64_t walk = 0; counts.faults.empty(); ++walk) {
    counts += search_walk(broken, 3, walk);
  }
  const SearchFault fault = counts.faults.front();
  EXPECT_EQ(fault.seed, 3u);
  const SearchCounts again = search_walk(broken, fault.seed, fault.walk);
  ASSERT_FALSE(again.faults.empty());
  EXPECT_EQ(again.faults.front().tick, fault.tick);
  EXPECT_EQ(again.faults.front().what, fault.what);
  EXPECT_EQ(fault.what.substr(0, 8), "broken, ");
}

TEST(RandomSolids, AreOfEveryKindAndSize) {
  double smallest = 1e9, largest = 0, flattest = 1;
  std::size_t most_sides = 0, most_edges_at_a_corner = 0;
  for (std::uint64_t seed = 0; seed < 500; ++seed) {
    Random random(seed);
    const stimuli::ConvexMesh mesh = random_solid(random);
    smallest = std::min(smallest, mesh.size());
    largest = std::max(largest, mesh.size());
    for (const stimuli::Facet& facet : mesh.facets()) {
      most_sides = std::max<std::size_t>(most_sides, facet.side_count);
      double low = 0;
      for (const Vec3& v : mesh.vertices()) {
        low = std::max(low, facet.offset - glm::dot(facet.normal, v));
      }
      flattest = std::min(flattest, low / mesh.size());
    }
    for (std::size_t v = 0; v < mesh.vertices().size(); ++v) {
      most_edges_at_a_corner = std::max<std::size_t>(most_edges_at_a_corner,
                                                     mesh.fan_first()[v + 1] - mesh.fan_first()[v]);
    }
  }
  EXPECT_LT(smallest, 1e-3);
  EXPECT_GT(largest, 50);
  EXPECT_LT(flattest, 1e-3);
  EXPECT_GT(most_sides, 10u);
  EXPECT_GT(most_edges_at_a_corner, 10u);
}

}  // namespace
}  // namespace palpate::runner::evidence
