// Contact with unions of convex parts in `palpate accuracy`: the cases are as described, the exact
// displacements are those of ideal tools by definition, and the errors follow their definition.

#include "runner/evidence/accuracy/union_study.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <set>
#include <string>

namespace palpate::runner::evidence {
namespace {

// Whatever the source of the truth, closed forms included: outside all parts, at a local minimum.
TEST(UnionStudy, ExactDisplacementsEqualIdealTools) {
  for (const UnionCaseKind& kind : union_case_kinds()) {
    for (std::uint64_t seed = 1; seed <= 2; ++seed) {
      const UnionCase one = kind.draw(seed, 700);
      ASSERT_EQ(one.path.size(), 700u) << kind.name;
      ASSERT_EQ(one.displacement.size(), 700u);
      const UnionOracle oracle(one.parts, one.tool);
      EXPECT_LT(oracle.depth(one.path[0]), 0) << kind.name;
      int touching = 0;
      for (std::size_t t = 0; t < one.path.size(); ++t) {
        const OraclePose ideal{one.path[t].tip + one.displacement[t], one.path[t].axes};
        const OracleAudit audit = oracle.audit(ideal, one.path[t].tip, 1e-11 * oracle.size());
        ASSERT_LE(audit.penetration, 1e-12 * oracle.size()) << kind.name << " tick " << t;
        ASSERT_LE(audit.descent, 1e-9 * oracle.size()) << kind.name << " tick " << t;
        touching += glm::length(one.displacement[t]) > 1e-9;
      }
      EXPECT_GT(touching, 70) << kind.name << " seed " << seed;
    }
  }
}

/// The cases that tests/rendering/RESULTS.md has figures of.
TEST(UnionStudy, HasFourteenCasesOfSixKinds) {
  std::size_t counted = 0;
  for (const auto& [begin, cases] : std::map<std::string, std::size_t>{{"groove of ", 6},
                                                                       {"16 boxes that ", 2},
                                                                       {"corner of a stair", 1},
                                                                       {"solid cut in four", 1},
                                                                       {"cluster, ", 3},
                                                                       {"hook behind a beam", 1}}) {
    std::size_t found = 0;
    for (const UnionCaseKind& kind : union_case_kinds())
      found += std::string(kind.name).starts_with(begin);
    EXPECT_EQ(found, cases) << begin;
    counted += cases;
  }
  EXPECT_EQ(union_case_kinds().size(), counted);
}

TEST(UnionStudy, MeasuresEveryMethodOnEveryCase) {
  double time = 0, share = -1;
  UnionSettings settings;
  settings.seeds = 2;
  settings.ticks = 400;
  settings.timings = 1;
  const auto rows = union_study(
      settings, [&] { return time += 1000; },
      [&](double done) {
        EXPECT_GE(done, share);
        share = done;
      });
  EXPECT_EQ(share, 1);
  std::set<std::pair<std::string, std::string>> seen;
  std::map<std::string, std::map<std::string, const UnionRow*>> by;
  for (const UnionRow& row : rows) {
    EXPECT_TRUE(seen.insert({row.name, row.method}).second);
    EXPECT_EQ(row.ticks, 800u);
    // The clock is read once before and once after each seed.
    EXPECT_DOUBLE_EQ(row.ns_per_tick, 2 * 1000.0 / 800);
    EXPECT_EQ(row.force.count, row.ticks);
    EXPECT_LE(row.off_by_a_tenth, row.in_contact);
    by[row.name][row.method] = &row;
  }
  EXPECT_EQ(rows.size(), union_case_kinds().size() * union_methods().size());
  for (const auto& [name, methods] : by) {
    const UnionRow& law = *methods.at("law");
    EXPECT_EQ(law.inside, 0u) << name;
    if (law.truth != "oracle") {
      EXPECT_LE(law.force.worst, 1e-6 * kStiffness * 1e-3) << name;  // 1e-6 of the force of 1 mm
    }
  }
  // The errors of a sum of contacts.
  for (const char* method : {"one per part", "penalties"}) {
    EXPECT_GT(by.at("16 boxes that abut").at(method)->off_by_a_tenth, 50u) << method;
    EXPECT_GT(by.at("groove of 90 degrees").at(method)->off_by_a_tenth, 50u) << method;
  }
}

}  // namespace
}  // namespace palpate::runner::evidence
